"""Fused operations: rounded once, the same for derivatives, and only where the source says."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numba import config, njit

from lean_yaw_env.kernel.compilation import fused

compiled_only = pytest.mark.skipif(
    bool(config.DISABLE_JIT), reason="plain Python multiplies and adds, rounding twice"
)


def _sum_first(a, b, c):
    return a * b + c


def _sum_last(a, b, c):
    return c + a * b


def _difference_first(a, b, c):
    return a * b - c


def _difference_last(a, b, c):
    return c - a * b


SIGNS = [
    (_sum_first, 1, 1), (_sum_last, 1, 1), (_difference_first, 1, -1), (_difference_last, -1, 1),
]  # fmt: skip


def _called(formula: Any) -> Any:
    inner = fused(formula)
    return njit(lambda a, b, c: inner(a, b, c))


@compiled_only
@pytest.mark.parametrize(("formula", "product_sign", "term_sign"), SIGNS)
def test_a_product_and_a_sum_are_rounded_once(
    formula: Any, product_sign: int, term_sign: int
) -> None:
    call = _called(formula)
    rng = np.random.default_rng(1)
    for _ in range(50):
        a, b = rng.uniform(-1.0, 1.0, 2).tolist()
        # close to the product: what remains is all in the digits that rounding the product would lose
        c = -product_sign * term_sign * a * b
        exact = product_sign * Fraction(a) * Fraction(b) + term_sign * Fraction(c)
        assert call(a, b, c) == float(exact)


def _product(a, b, c):
    return a * b * c


@compiled_only
@pytest.mark.parametrize(
    ("formula", "slopes"),
    [
        (_difference_last, lambda a, b, c: (-b, -a, 1.0)),
        (_product, lambda a, b, c: (b * c, a * c, a * b)),
    ],
)
def test_a_fused_formula_of_complex_numbers_carries_the_derivative_and_the_same_real_part(
    formula: Any, slopes: Any
) -> None:
    call = _called(formula)
    a, b, c = 0.3, 0.7, 0.2
    tiny = 1e-30
    for seeds in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)):
        arguments = [
            complex(x, tiny * s) if s else x for x, s in zip((a, b, c), seeds, strict=True)
        ]
        result = call(*arguments)
        assert result.real == call(a, b, c)
        # a sum of three products, correct to round-off
        slope = np.dot(seeds, slopes(a, b, c))
        assert result.imag / tiny == pytest.approx(slope, rel=1e-15)


@compiled_only
def test_no_second_order_of_an_imaginary_part_reaches_a_real_one() -> None:
    # with imaginary parts as large as the real ones, the product of complex numbers would be another
    result = _called(_product)(0.3 + 1.0j, 0.7 + 1.0j, 0.2)
    assert result.real == _called(_product)(0.3, 0.7, 0.2)


@pytest.mark.skipif(
    not config.DISABLE_JIT, reason="with the compiler a formula is not called from Python"
)
def test_without_the_compiler_a_formula_is_what_it_says() -> None:
    assert fused(_difference_last)(0.3, 0.7, 0.2) == 0.2 - 0.3 * 0.7

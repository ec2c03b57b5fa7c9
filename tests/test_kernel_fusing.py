"""Fused operations: rounded once, the same for derivatives, and only where the source says."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numba import config, njit

from lean_yaw_env.kernel.compilation import fused
from lean_yaw_env.kernel.fusing import multiply_add

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


@compiled_only
def test_a_fused_formula_of_complex_numbers_carries_the_derivative_and_the_same_real_part() -> None:
    call = _called(_difference_last)
    a, b, c = 0.3, 0.7, 0.2
    tiny = 1e-30
    for seeds in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)):
        arguments = [
            complex(x, tiny * s) if s else x for x, s in zip((a, b, c), seeds, strict=True)
        ]
        result = call(*arguments)
        assert result.real == call(a, b, c)
        # c - a b: one product of each, correct to round-off
        slope = -seeds[0] * b - seeds[1] * a + seeds[2]
        assert result.imag / tiny == pytest.approx(slope, rel=1e-15)


def test_without_the_compiler_a_formula_is_what_it_says() -> None:
    formula = fused(_difference_last)
    plain = getattr(formula, "py_func", formula)
    assert plain(0.3, 0.7, 0.2) == pytest.approx(0.2 - 0.3 * 0.7, abs=1e-16)
    assert multiply_add(2.0, 3.0, 4.0) == 10.0

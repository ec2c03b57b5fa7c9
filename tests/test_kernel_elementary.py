"""The kernels' own sine, cosine and angle, and the coefficients and the order of Verner's pair."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from numba import njit

from lean_yaw_env.kernel import verner
from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.elementary import angle_of, sine_cosine, within_half_turn

Tree = tuple["Tree", ...]


@njit
def _angles(sines, cosines):
    result = np.empty_like(sines)
    for i in range(len(sines)):
        result[i] = angle_of(sines[i], cosines[i])
    return result


@njit
def _sines_and_cosines(angles):
    result = np.empty((len(angles), 2), angles.dtype)
    for i in range(len(angles)):
        result[i, 0], result[i, 1] = sine_cosine(angles[i])
    return result


@njit
def _wrapped(angles):
    result = np.empty_like(angles)
    for i in range(len(angles)):
        result[i] = within_half_turn(angles[i])
    return result


def test_sine_and_cosine_are_as_good_as_the_library_s() -> None:
    angles = np.linspace(-np.pi, np.pi, 20_001)
    exact = np.column_stack([np.sin(angles), np.cos(angles)])
    error = np.abs(_sines_and_cosines(angles) - exact)
    # the polynomial's 2e-16 counts with the cube of the half angle, and four times in 1 - 2 sin^2
    assert error.max() < 4e-15
    assert error[np.abs(angles) < np.pi / 2].max() < 4.5e-16


def test_sine_and_cosine_carry_derivatives_in_imaginary_parts() -> None:
    angles = np.linspace(-3.0, 3.0, 101)
    derivatives = _sines_and_cosines(angles + 1e-30j).imag / 1e-30
    # the slope of a polynomial of degree 15 is off by some ten times its own error
    assert np.abs(derivatives - np.column_stack([np.cos(angles), -np.sin(angles)])).max() < 5e-14


def test_angle_of_inverts_sine_and_cosine() -> None:
    angles = np.linspace(-3.1, 3.1, 20_001)
    error = np.abs(_angles(np.sin(angles), np.cos(angles)) - angles)
    # near half a turn the half angle's cosine is small and its rounding counts for more: 1e-16 / cos(1.55)
    assert error.max() < 1e-14
    assert error[np.abs(angles) < 2.0].max() < 1e-15


def test_angle_of_carries_derivatives_in_imaginary_parts() -> None:
    angles = np.linspace(-2.0, 2.0, 101)
    derivatives = _angles(np.sin(angles + 1e-30j), np.cos(angles + 1e-30j)).imag / 1e-30
    # the seed is good to 1e-5, so the correction's neglected slope is below its cube
    assert np.abs(derivatives - 1.0).max() < 1e-13


def test_any_heading_is_wrapped_to_the_same_direction() -> None:
    headings = np.linspace(-40.0, 40.0, 997)
    wrapped = _wrapped(headings)
    assert (np.abs(wrapped) <= np.pi).all()
    # six turns lose three bits
    assert np.abs(np.exp(1j * wrapped) - np.exp(1j * headings)).max() < 1e-14


def _tableau() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The matrix A, the weights b and the embedded weights of the module's tables."""
    n = verner.STAGES
    a, b, e = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for stage, coefficients in verner.COEFFICIENTS.items():
        for earlier, value in coefficients.items():
            a[stage - 1, earlier - 1] = value
    for weights, table in ((b, verner.WEIGHTS), (e, verner.ERROR_WEIGHTS)):
        for stage, value in table.items():
            weights[stage - 1] = value
    return a, b, b - e


def test_stages_are_taken_at_the_sums_of_their_rows() -> None:
    a, _, _ = _tableau()
    nodes = [verner.NODES[stage] for stage in range(1, verner.STAGES + 1)]
    # rows hold numbers up to 123 that cancel: 123 times the rounding
    assert np.abs(a.sum(axis=1) - nodes).max() < 3e-14
    assert (np.triu(a) == 0.0).all()


@cache
def _rooted_trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees with so many nodes, a tree being the sorted tuple of its root's branches."""
    return tuple(sorted(set(_forests(order - 1))))


def _forests(nodes: int) -> Iterator[Tree]:
    if nodes == 0:
        yield ()
    for first in range(1, nodes + 1):
        for tree, rest in itertools.product(_rooted_trees(first), tuple(_forests(nodes - first))):
            yield tuple(sorted((tree, *rest)))


def _nodes(tree: Tree) -> int:
    return 1 + sum(_nodes(branch) for branch in tree)


def _density(tree: Tree) -> int:
    product = _nodes(tree)
    for branch in tree:
        product *= _density(branch)
    return product


def _weights_of(tree: Tree, a: np.ndarray) -> np.ndarray:
    result = np.ones(len(a))
    for branch in tree:
        result = result * (a @ _weights_of(branch, a))
    return result


@pytest.mark.parametrize(("order", "count"), [(1, 1), (4, 4), (6, 20), (7, 48), (8, 115)])
def test_the_pair_meets_every_order_condition(order: int, count: int) -> None:
    a, b, embedded = _tableau()
    trees = _rooted_trees(order)
    assert len(trees) == count  # Cayley's numbers of rooted trees
    for tree in trees:
        wanted = float(Fraction(1, _density(tree)))
        # products of coefficients up to 123 and weights up to 32, rounded: measured 2e-13
        assert b @ _weights_of(tree, a) == pytest.approx(wanted, abs=2e-12)
        if order <= 7:
            assert embedded @ _weights_of(tree, a) == pytest.approx(wanted, abs=2e-12)


def test_weights_sum_to_one_and_estimates_to_nothing() -> None:
    _, b, embedded = _tableau()
    # the rounding of weights up to 32
    assert abs(b.sum() - 1.0) < 2e-14
    assert abs(embedded.sum() - 1.0) < 2e-14


def test_the_embedded_result_is_of_seventh_order_only() -> None:
    a, _, embedded = _tableau()
    misses = [abs(embedded @ _weights_of(t, a) - 1 / _density(t)) for t in _rooted_trees(8)]
    assert max(misses) > 1e-6  # else the error estimate would always be zero


_swing = verner.stepper(1, inlined(lambda c, t, x: x), inlined(lambda c, x, v: (-np.sin(x),)))


@njit
def _pendulum_step(x: float, w: float, h: float) -> tuple[float, float, float]:
    """One step for x'' = -sin x; also the error estimate."""
    x, w, error, _, _ = _swing(0.0, 0.0, x, w, -np.sin(x), h)
    return x, w, error


def _pendulum(steps: int) -> tuple[float, float]:
    x, w = 1.0, 0.2
    for _ in range(steps):
        x, w, _ = _pendulum_step(x, w, 4.0 / steps)
    return x, w


def test_doubling_the_steps_divides_the_error_by_two_to_the_eighth_or_more() -> None:
    exact = np.array(_pendulum(100))
    errors = [np.abs(np.array(_pendulum(n)) - exact).max() for n in (4, 8, 16)]
    assert errors[-1] > 5e-13  # else rounding would be what is compared
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # the ninth-order term still counts at these step lengths, less so at the shorter ones: 10.1, then 8.9
    assert (orders > 8.0).all()
    assert orders[1] < orders[0] < 10.5


def test_the_error_estimate_bounds_the_error_of_a_step() -> None:
    x, w = 1.0, 0.2
    for _ in range(64):
        x, w, _ = _pendulum_step(x, w, 1.0 / 64)
    coarse_x, coarse_w, estimate = _pendulum_step(1.0, 0.2, 1.0)
    assert max(abs(coarse_x - x), abs(coarse_w - w)) < estimate < 1e-4

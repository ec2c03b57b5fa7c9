"""Checks of arguments: what they let through, in which type, and what their messages say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lean_yaw_env.validation import (
    require_array,
    require_choice,
    require_count,
    require_finite,
    require_flag,
    require_number,
    require_vector,
)


@given(
    value=st.floats(allow_nan=True),
    low=st.floats(-1e3, 1e3),
    width=st.floats(0.0, 1e3),
    bounds=st.sampled_from(["[]", "(]", "[)", "()"]),
)
def test_a_number_passes_if_and_only_if_it_is_in_the_interval(value, low, width, bounds):
    high = low + width
    above = low <= value if bounds[0] == "[" else low < value
    below = value <= high if bounds[1] == "]" else value < high
    if above and below:
        assert require_number("x", value, low, high, bounds) == value
        assert require_array("x", [value], (1,), low, high, bounds) == value
        return
    with pytest.raises(ValueError, match="x must be in"):
        require_number("x", value, low, high, bounds)
    with pytest.raises(ValueError, match="x must hold numbers in"):
        require_array("x", [value], (1,), low, high, bounds)


@pytest.mark.parametrize("value", [1, 1.0, np.float32(1.0), np.int8(1)])
def test_a_number_becomes_a_float(value):
    assert type(require_number("x", value, 0.0, 2.0)) is float
    np.testing.assert_array_equal(require_vector("x", value), [1.0])


def test_an_array_is_a_copy():
    given_array = np.zeros(3)
    require_array("x", given_array, (3,))[0] = 1.0
    assert given_array[0] == 0.0


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda: require_number("x", "1", 0, 2), r"x must be a number in \[0, 2\], got '1'"),
        (lambda: require_number("x", True, 0, 2), r"x must be a number in \[0, 2\], got True"),
        (lambda: require_number("x", 3, 0, 2), r"x must be in \[0, 2\], got 3"),
        (lambda: require_finite("x", None), "x must be a finite number, got None"),
        (lambda: require_finite("x", math.inf), "x must be a finite number, got inf"),
        (lambda: require_count("x", 2.0), "x must be a whole number from 1 to 10000000, got 2.0"),
        (lambda: require_count("x", 0, 1, 9), "x must be from 1 to 9, got 0"),
        (lambda: require_flag("x", 1), "x must be True or False, got 1"),
        (lambda: require_choice("x", "lft", ("left", "right")), "got 'lft'; did you mean 'left'?"),
        (lambda: require_choice("x", None, ("left", "right")), "x must be one of left, right"),
        (lambda: require_array("x", [[1.0], []], (2, 1)), r"x must hold numbers in shape \(2, 1\)"),
        (lambda: require_array("x", ["a"], (1,)), r"x must hold numbers in shape \(1,\), got \['a"),
        (lambda: require_array("x", [True], (1,)), r"x must hold numbers in shape \(1,\)"),
        (lambda: require_array("x", [1.0], (None, 2)), r"x must have shape \(n, 2\), got \(1,\)"),
        (lambda: require_array("x", [math.nan], (1,)), "x must hold finite numbers, got nan"),
        (lambda: require_array("x", [3], (1,), 0, 2, "[]"), r"x must hold numbers in \[0, 2\], got"),
        (lambda: require_vector("x", []), "x must hold one number or more, got none"),
        (lambda: require_vector("x", [[1.0]]), r"x must have shape \(n,\), got \(1, 1\)"),
    ],
)  # fmt: skip
def test_a_message_names_the_argument_what_is_allowed_and_the_value(check, message):
    with pytest.raises(ValueError, match=message):
        check()

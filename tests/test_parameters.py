"""Parameters, section states and commands: defaults, ranges, and what bad ones are told."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lean_yaw_env import STATE_FIELDS, WalkerParameters
from lean_yaw_env.kernel.records import Body
from lean_yaw_env.parameters import (
    MIRROR,
    PARAMETER_NAMES,
    STATE_SIZE,
    require_foot,
    require_inter_leg_angle,
    require_mass_offset,
    require_number,
    require_state,
)

RANGES = {
    "hip_width": (0.0, 2.0, "[]"),
    "foot_radius": (0.0, 1.0, "[)"),
    "ankle_tilt": (0.0, math.pi / 2, "(]"),
    "slope": (-0.5, 0.5, "[]"),
    "ankle_stiffness": (0.0, 100.0, "[]"),
    "ankle_damping": (0.0, 100.0, "[]"),
    "shift_time": (0.01, 10.0, "[]"),
    "friction_limit": (0.0, math.inf, "(]"),
    "max_step_duration": (0.0, 100.0, "(]"),
}


def test_defaults_are_table_1() -> None:
    parameters = WalkerParameters()
    assert (parameters.hip_width, parameters.foot_radius) == (0.3, 0.5)
    assert (parameters.ankle_tilt, parameters.slope) == (0.55, 0.01)
    # no springs, a fixed slope, and a buried foot trips: what the paper leaves out is off
    assert (parameters.ankle_stiffness, parameters.ankle_damping) == (0.0, 0.0)
    assert not parameters.slope_turns
    assert parameters.early_contact == "trip"
    assert parameters.friction_limit == math.inf


def test_state_fields_are_in_the_order_everything_uses() -> None:
    names = tuple(field.name for field in STATE_FIELDS)
    assert names == ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate")
    assert all(field.unit and field.description and field.symbol for field in STATE_FIELDS)
    assert len(MIRROR) == STATE_SIZE
    with pytest.raises(ValueError, match="read-only"):
        MIRROR[0] = 1.0


def test_parameters_are_frozen_comparable_and_survive_pickling() -> None:
    parameters = WalkerParameters(hip_width=0.2)
    with pytest.raises(FrozenInstanceError):
        parameters.hip_width = 0.4  # pyright: ignore[reportAttributeAccessIssue]
    assert pickle.loads(pickle.dumps(parameters)) == parameters
    assert hash(parameters) == hash(WalkerParameters(hip_width=0.2))
    assert parameters != WalkerParameters()


def test_kernels_get_the_same_numbers_in_the_order_of_their_record() -> None:
    parameters = WalkerParameters(0.1, 0.2, 0.3, 0.04, 0.5, 0.6, True, "strike", 0.7, 0.8, 0.9)
    assert parameters.body() == Body(0.1, 0.2, 0.3, 0.04, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.0)
    assert WalkerParameters().body()[-2:] == (0.0, 0.0)
    assert set(RANGES) == set(PARAMETER_NAMES) - {"slope_turns", "early_contact"}


@pytest.mark.parametrize("name", RANGES)
def test_a_range_s_ends_are_allowed_or_refused_as_stated(name: str) -> None:
    low, high, bounds = RANGES[name]
    for end, allowed in ((low, bounds[0] == "["), (high, bounds[1] == "]")):
        if allowed:
            assert getattr(replace(WalkerParameters(), **{name: end}), name) == end
        else:
            with pytest.raises(ValueError, match=f"{name} must be in"):
                replace(WalkerParameters(), **{name: end})


@pytest.mark.parametrize("name", RANGES)
@pytest.mark.parametrize("value", [math.nan, -math.inf, "wide", None, True, [0.3], 1j, -1e9])
def test_a_bad_parameter_is_refused_by_name_value_and_range(name: str, value: Any) -> None:
    low, high, bounds = RANGES[name]
    interval = f"{bounds[0]}{low:g}, {high:g}{bounds[1]}"
    pattern = f"^{name} must be .*{re.escape(interval)}.*{re.escape(repr(value))}$"
    with pytest.raises(ValueError, match=pattern):
        replace(WalkerParameters(), **{name: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slope_turns": 1}, "slope_turns must be True or False, got 1"),
        ({"early_contact": "bounce"}, "early_contact must be one of trip, strike, got 'bounce'"),
    ],
)
def test_a_bad_option_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WalkerParameters(**change)


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(TypeError, match="leg_length"):
        WalkerParameters(leg_length=1.0)  # pyright: ignore[reportCallIssue]


@given(st.integers(0, 1), st.floats(-0.5, 0.5))
def test_numbers_of_any_kind_become_floats(whole: int, slope: float) -> None:
    parameters = WalkerParameters(hip_width=whole, slope=np.float64(slope))
    assert type(parameters.hip_width) is float
    assert type(parameters.slope) is float
    assert (parameters.hip_width, parameters.slope) == (whole, slope)


@given(st.lists(st.floats(-1.5, 1.5), min_size=5, max_size=5))
def test_a_state_is_copied_as_it_is(values: list[float]) -> None:
    given_state = np.array(values)
    state = require_state(given_state)
    assert (state == values).all()
    state[0] = 7.0
    assert given_state[0] == values[0]


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ([0.0] * 4, r"state must have shape \(5,\), got \(4,\)"),
        ([[0.0] * 5], r"got \(1, 5\)"),
        (["a"] * 5, r"state must hold numbers in shape \(5,\)"),
        ([[1.0], 2.0, 3.0, 4.0, 5.0], "state must hold numbers"),
        ([0.0, 1.6, 0.0, 0.0, 0.0], r"stance_pitch must be in \(-1.5708, 1.5708\), got 1.6"),
        ([0.0, 0.0, -1.6, 0.0, 0.0], r"ankle_angle must be in \(-1.5708, 1.5708\), got -1.6"),
        ([math.nan, 0.0, 0.0, 0.0, 0.0], "heading must be in .*, got nan"),
        ([0.0, 0.0, 0.0, math.inf, 0.0], "stance_pitch_rate must be in .*, got inf"),
        ([0.0, 0.0, 0.0, 0.0, -2e6], r"ankle_rate must be in \(-1e\+06, 1e\+06\), got -2000000.0"),
    ],
)
def test_a_bad_state_is_refused_by_coordinate(state: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        require_state(state)


@pytest.mark.parametrize("stance", ["Left", "", None, 1, "both"])
def test_a_bad_foot_is_refused(stance: Any) -> None:
    with pytest.raises(ValueError, match="stance must be one of left, right, got"):
        require_foot(stance)


@pytest.mark.parametrize("value", [0.0, math.pi / 2, -0.3, math.nan, "0.3"])
def test_a_bad_inter_leg_angle_is_refused(value: Any) -> None:
    with pytest.raises(ValueError, match=r"inter_leg_angle must be .*\(0, 1.5708\)"):
        require_inter_leg_angle(value)


@pytest.mark.parametrize("value", [1.01, -1.01, math.nan, None])
def test_a_bad_mass_offset_is_refused(value: Any) -> None:
    with pytest.raises(ValueError, match=r"previous_offset must be .*\[-1, 1\]"):
        require_mass_offset(value, "previous_offset")


@given(st.floats(0.0, 1.0))
def test_an_interval_holds_what_lies_within(value: float) -> None:
    assert require_number("share", value, 0.0, 1.0) == value

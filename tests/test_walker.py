"""The friendly walker: steps and walks as the paper describes them, one walk against its steps, and bad input."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from lean_yaw_env import Fall, Walker, WalkerParameters
from lean_yaw_env.kernel.trace import COLUMNS
from lean_yaw_env.parameters import MIRROR, Vector
from tests.reference import ReferenceWalker

# --- what the paper says of walks (section 4.4)


def test_figure_14_the_centre_of_mass_sways_by_eight_thousandths(gait: Vector) -> None:
    walk = Walker().walk(2, state=gait, samples_per_step=200)
    sideways = walk.path[:, 3]
    assert np.ptp(sideways) / 2 == pytest.approx(0.008, abs=1e-4)  # the paper's
    assert np.ptp(sideways) / 2 == pytest.approx(0.00797, abs=1e-5)


def test_figure_15_a_small_offset_steers_to_a_new_heading(gait: Vector) -> None:
    walk = Walker().walk(900, state=gait, mass_offset=0.006)
    assert walk.fall is None
    # 0.64 to the right; sin(heading) = -offset / tan(slope) is 0.643 for the mean of left and right prints
    assert walk.headings[-2:].mean() == pytest.approx(-0.64, abs=0.005)
    # "approached over about 150 steps": by then most of the way
    assert -0.45 < walk.headings[149:151].mean() < -0.3
    assert walk.headings[299:301].mean() < -0.53


def test_figure_15_a_large_offset_turns_in_a_radius_of_eight_until_it_heads_uphill(
    gait: Vector,
) -> None:
    walk = Walker().walk(300, state=gait, mass_offset=0.05)
    middle = 0.5 * (walk.footprints[1:] + walk.footprints[:-1])
    length = np.linalg.norm(np.diff(middle, axis=0), axis=1).sum()
    radius = length / abs(walk.headings[-1] - walk.headings[0])
    assert 8.0 < radius < 9.0
    # "it has turned more than 90 degrees and thus receives no energy input"
    assert walk.fall is Fall.BACKWARD
    assert walk.headings[-1] < -math.pi / 2


def test_on_a_slope_that_turns_it_walks_indefinitely_in_circles(gait: Vector) -> None:
    walk = Walker(WalkerParameters(slope_turns=True)).walk(1000, state=gait, mass_offset=0.05)
    assert walk.fall is None
    assert walk.headings[-1] < -5 * 2 * math.pi
    middle = 0.5 * (walk.footprints[1:] + walk.footprints[:-1])[-300:]
    solution = np.linalg.lstsq(
        np.column_stack([2 * middle, np.ones(300)]), (middle**2).sum(axis=1), rcond=None
    )[0]
    radii = np.linalg.norm(middle - solution[:2], axis=1)
    assert radii.mean() == pytest.approx(8.19, abs=0.01)
    # what is left of the start after 350 strides of multiplier 0.959
    assert np.ptp(radii) < 2e-6


def test_a_walk_that_starts_uphill_falls(gait: Vector) -> None:
    walk = Walker().walk(100, state=gait + np.array([math.pi, 0.0, 0.0, 0.0, 0.0]))
    assert walk.fall is Fall.BACKWARD
    assert walk.n_steps < 30


@pytest.mark.parametrize("factor", [3.0, 0.0])
@pytest.mark.parametrize("coordinate", [0, 1, 2, 4])
def test_it_recovers_from_200_percent_more_or_100_percent_less_of_any_angle_or_the_ankle_rate(
    coordinate: int, factor: float, gait: Vector
) -> None:
    state = gait.copy()
    state[coordinate] *= factor
    # a stance pitch of +200 % comes out only if a buried swing foot counts as a heel strike
    early = "strike" if (coordinate, factor) == (1, 3.0) else "trip"
    walk = Walker(WalkerParameters(early_contact=early)).walk(800, state=state)
    assert walk.fall is None
    assert np.abs(walk.states[-1, 1:] - gait[1:]).max() < 1e-3


def test_the_stance_rate_may_be_halved_but_not_taken_away(gait: Vector) -> None:
    assert Walker().walk(200, state=gait * [1, 1, 1, 0.5, 1]).fall is None
    # "otherwise the model falls backward"; from rest it leans first
    assert Walker().walk(200, state=gait * [1, 1, 1, 0.3, 1]).fall is Fall.BACKWARD
    assert Walker().walk(200, state=gait * [1, 1, 1, 0.0, 1]).fall is Fall.SIDEWAYS


@pytest.mark.parametrize(("early", "limit"), [("strike", 2.11), ("trip", 1.52)])
def test_the_largest_stance_pitch_it_recovers_from_depends_on_what_a_buried_foot_does(
    early: Any, limit: float, gait: Vector
) -> None:
    walker = Walker(WalkerParameters(early_contact=early))
    for more, recovers in ((limit - 0.02, True), (limit + 0.02, False)):
        state = gait.copy()
        state[1] *= 1.0 + more
        assert (walker.walk(100, state=state).fall is None) == recovers


# --- a walk is its steps


def test_a_walk_chains_its_steps(gait: Vector) -> None:
    walker = Walker()
    angles, offsets = np.linspace(0.29, 0.31, 7), np.linspace(-0.01, 0.02, 7)
    walk = walker.walk(
        7, state=gait, inter_leg_angle=angles, mass_offset=offsets, previous_offset=-0.015
    )
    state, stance, before = gait, "left", -0.015
    place = np.zeros(2)
    for k in range(7):
        result = walker.step(
            state,
            stance=stance,
            inter_leg_angle=angles[k],
            mass_offset=offsets[k],
            previous_offset=before,
        )
        state, stance, before = result.state, result.stance, result.mass_offset
        place = place + result.displacement
        assert (walk.states[k + 1] == state).all()
        assert walk.stances[k + 1] == stance
        assert (walk.footprints[k + 1] == place).all()
        assert walk.durations[k] == result.duration
        assert walk.energies[k] == result.energy
        assert walk.mass_offsets[k + 1] == before
    assert walk.n_steps == 7
    assert walk.fall is None
    assert (walk.headings == walk.states[:, 0]).all()
    assert walk.distance == np.linalg.norm(place)


def test_a_walk_ends_where_it_falls(gait: Vector) -> None:
    walk = Walker().walk(20, state=gait * [1, 3, 1, 1, 1], samples_per_step=5)
    assert walk.fall is Fall.TRIP
    assert walk.n_steps == 2
    assert len(walk.states) == len(walk.stances) == len(walk.footprints) == 3
    assert len(walk.path) == 15  # the fall's own samples as well


def test_the_path_is_continuous_from_step_to_step(gait: Vector) -> None:
    walk = Walker().walk(6, state=gait, samples_per_step=50, mass_offset=0.01)
    ends, starts = walk.path[49:-1:50], walk.path[50::50]
    # the masses do not jump at heel strike; the step's own accuracy
    assert np.abs(ends - starts).max() < 1e-10
    assert (np.diff(walk.path[:, 0]) >= -1e-12).all()
    assert walk.path[-1, 0] == pytest.approx(walk.durations.sum(), abs=1e-12)


def test_the_motion_ends_where_the_step_strikes(gait: Vector) -> None:
    state = gait * 1.1
    result = Walker().step(state, mass_offset=0.02, previous_offset=0.0)
    motion = Walker().stance_motion(
        state, duration=result.duration, samples=9, mass_offset=0.02, previous_offset=0.0
    )
    assert tuple(motion) == COLUMNS
    assert motion["time"][-1] == pytest.approx(result.duration, abs=1e-13)
    assert motion["mass_offset"][0] == 0.0
    assert motion["mass_offset"][-1] == 0.02
    centre, _, _ = ReferenceWalker().swing_foot(
        0.0, motion["stance_pitch"][-1], motion["ankle_angle"][-1], 0.3, 1.0
    )
    assert centre[1] == pytest.approx(0.5, abs=1e-10)  # the foot's radius above the floor


def test_the_contact_force_is_what_the_centre_of_mass_s_acceleration_asks(gait: Vector) -> None:
    motion = Walker().stance_motion(gait, duration=0.7, samples=1401, mass_offset=0.02)
    step = 0.7 / 1400
    accelerations = [np.diff(motion[f"centre_{axis}"], 2) / step**2 for axis in "xyz"]
    sine, cosine = math.sin(0.01), math.cos(0.01)
    heading = gait[0]
    ahead = accelerations[0] - sine * math.cos(heading)
    aside = accelerations[2] - sine * math.sin(heading)
    up = accelerations[1] + cosine
    # second differences: 1e-7 of curvature, and rounding of 1e-16 over the step squared
    assert np.abs(up - motion["normal_force"][1:-1]).max() < 1e-6
    friction = np.hypot(ahead, aside) / up
    assert np.abs(friction - motion["friction_demand"][1:-1]).max() < 1e-6


def test_both_feet_walk_alike(gait: Vector) -> None:
    left = Walker().walk(10, state=gait)
    right = Walker().walk(10, state=gait * MIRROR, stance="right")
    assert (right.states == left.states * MIRROR).all()
    assert (right.footprints == left.footprints * [1.0, -1.0]).all()


def test_the_offset_is_locked_by_a_heel_strike_in_mid_shift(gait: Vector) -> None:
    walker = Walker(WalkerParameters(shift_time=2.0))
    walk = walker.walk(3, state=gait, mass_offset=0.02, previous_offset=0.0)
    assert 0.0 < walk.mass_offsets[1] < 0.02
    assert walk.mass_offsets[1] < walk.mass_offsets[2] < 0.02


# --- values and bad input


def test_results_are_frozen_and_survive_pickling(gait: Vector) -> None:
    result = Walker().step(gait)
    with pytest.raises(FrozenInstanceError):
        result.duration = 1.0  # pyright: ignore[reportAttributeAccessIssue]
    copy = pickle.loads(pickle.dumps(result))
    assert (copy.state == result.state).all()
    assert pickle.loads(pickle.dumps(Walker())) == Walker()


def test_a_step_does_not_change_its_arguments(gait: Vector) -> None:
    state = gait.copy()
    result = Walker().step(state)
    assert (state == gait).all()
    result.state[:] = 0.0
    assert (Walker().step(state).state != 0.0).any()


def test_falls_compare_with_their_names() -> None:
    assert {fall.value for fall in Fall} == {
        "backward", "forward", "sideways", "trip", "lift-off", "slip", "no-heel-strike"
    }  # fmt: skip
    assert Fall.LIFT_OFF == "lift-off"
    assert all(isinstance(Fall(fall.value), Fall) for fall in Fall)


GOOD = [0.0, 0.155, 0.0, -0.4, 0.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"state": GOOD[:4]}, r"state must have shape \(5,\)"),
        ({"state": [math.nan, *GOOD[1:]]}, "state: heading must be in"),
        ({"stance": "middle"}, "stance must be one of left, right, got 'middle'"),
        ({"inter_leg_angle": 1.6}, r"inter_leg_angle must be in \(0, 1.5708\), got 1.6"),
        ({"mass_offset": -1.5}, r"mass_offset must be in \[-1, 1\], got -1.5"),
        ({"previous_offset": "left"}, r"previous_offset must be a number in \[-1, 1\]"),
    ],
)
def test_a_bad_step_is_refused_by_name(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Walker().step(**({"state": GOOD} | arguments))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_steps": 0}, "n_steps must be from 1 to 10000000, got 0"),
        ({"n_steps": "many"}, "n_steps must be a whole number"),
        ({"n_steps": 2.0}, "n_steps must be a whole number from 1 to 10000000, got 2.0"),
        ({"n_steps": True}, "n_steps must be a whole number"),
        ({"samples_per_step": 1}, "samples_per_step must be 0 or from 2 to 10000, got 1"),
        (
            {"samples_per_step": 2.5},
            "samples_per_step must be a whole number from 0 to 10000, got 2.5",
        ),
        ({"mass_offset": [[0.0], 0.1, 0.2]}, "mass_offset must hold numbers"),
        ({"mass_offset": None}, "mass_offset must be a number, got None"),
        ({"mass_offset": [0.0, 0.1]}, "mass_offset must be one number or 3 of them"),
        ({"inter_leg_angle": [0.3, 0.3, 9.0]}, "inter_leg_angle must be in"),
        ({"mass_offset": [0.0, 0.0, math.nan]}, "mass_offset must be in"),
        ({"stance": None}, "stance must be"),
    ],
)
def test_a_bad_walk_is_refused_by_name(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Walker().walk(**({"n_steps": 3, "state": GOOD} | arguments))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 0.0}, "duration must be in"),
        ({"duration": math.inf}, "duration must be in"),
        ({"samples": 1}, "samples must be from 2 to 1000000, got 1"),
        ({"samples": 2.7}, "samples must be a whole number from 2 to 1000000, got 2.7"),
    ],
)
def test_a_bad_motion_is_refused_by_name(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Walker().stance_motion(GOOD, **({"duration": 0.5} | arguments))


def test_a_walker_takes_parameters_only() -> None:
    with pytest.raises(ValueError, match="parameters must be WalkerParameters, got "):
        Walker({"slope": 0.1})  # pyright: ignore[reportArgumentType]
    assert Walker() == Walker(replace(WalkerParameters()))

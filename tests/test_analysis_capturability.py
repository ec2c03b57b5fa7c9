"""Capturability: which states chosen steps save, held against plain walks, its own mirror image and finer choices."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lean_yaw_env.analysis import (
    Capture,
    Choices,
    ClosedLoopMap,
    PassiveMap,
    active_map,
    basin,
    capturability,
    capture,
    capture_map,
    filling,
    find_limit_cycle,
    load_dataset,
    refine_capture,
)
from lean_yaw_env.errors import SolverError
from lean_yaw_env.kernel.records import FAILED
from lean_yaw_env.parameters import MIRROR, Foot, Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

SETTLE = 60
WALKER = Walker(WalkerParameters(slope_turns=True, friction_limit=0.6))
GAIT = find_limit_cycle(WALKER).state
AXES = {
    "ankle_angle": GAIT[2] + np.linspace(-0.3, 0.3, 11),
    "ankle_rate": GAIT[4] + np.linspace(-0.8, 0.8, 11),
}
COARSE = Choices(np.linspace(0.15, 0.45, 3), np.linspace(-0.05, 0.05, 3))


def slice_states() -> Vector:
    angles, rates = (grid.ravel() for grid in np.meshgrid(*AXES.values(), indexing="ij"))
    states = np.tile(GAIT, (angles.size, 1))
    states[:, 2], states[:, 4] = angles, rates
    return states


STATES = slice_states()


@pytest.fixture(scope="module")
def found() -> Capture:
    return capture(WALKER, STATES, most_steps=2, settle_steps=SETTLE)


class WithOffset:
    """A controller's view that adds the mass offset in force to the state, and that always commands the paper's constant action."""

    remembered: Mapping[str, str] = {}
    headings = ()
    scales, reach = np.ones(6), np.ones(2)

    def observe(self, states: Vector, foot: Foot) -> Vector:
        return states

    def command(self, states: Vector, foot: Foot, actions: Vector) -> Vector:
        return actions

    def remember(self, states: Vector, outputs: Mapping[str, Vector]) -> Vector:
        return np.empty((len(states), 0))


CONTROLLED = ClosedLoopMap(
    WALKER, WithOffset(), lambda seen: np.tile([0.3, 0.0], (len(seen), 1)), np.append(GAIT, 0.0)  # pyright: ignore[reportArgumentType]
)  # fmt: skip


def test_states_saved_without_a_chosen_step_are_those_the_controller_walks_on_from(found) -> None:
    walked = basin(WALKER, *AXES.items(), n_steps=SETTLE)
    assert np.array_equal(found.least_steps == 0, (walked.ending == 0.0).to_numpy().ravel())


def test_a_plan_saves_its_state_walked_by_the_single_walker(found) -> None:
    saved = np.flatnonzero((found.least_steps > 0) & (found.least_steps <= 2))
    assert saved.size > 20
    for i in saved[::3]:
        n = found.least_steps[i]
        chosen = found.plans[i, :n]
        angles = [*chosen[:, 0], *np.full(SETTLE, 0.3)]
        offsets = [*chosen[:, 1], *np.zeros(SETTLE)]
        walk = WALKER.walk(n + SETTLE, state=STATES[i], inter_leg_angle=angles, mass_offset=offsets, previous_offset=0.0)  # fmt: skip
        assert walk.fall is None
        assert np.isnan(found.plans[i, n:]).all()


def test_every_other_sequence_fails_where_nothing_saves(found) -> None:
    lost = np.flatnonzero(found.least_steps == 3)[::9]
    choices = Choices()
    for i in lost:
        for angle in choices.inter_leg_angles:
            for offset in choices.mass_offsets:
                angles, offsets = [angle, *[0.3] * SETTLE], [offset, *[0.0] * SETTLE]
                walk = WALKER.walk(SETTLE + 1, state=STATES[i], inter_leg_angle=angles, mass_offset=offsets, previous_offset=0.0)  # fmt: skip
                assert walk.fall is not None


def test_more_steps_and_finer_choices_never_save_fewer() -> None:
    levels = refine_capture(WALKER, STATES, COARSE, most_levels=3, most_steps=2, tolerance=0.0)
    sizes = [choices.commands.shape[0] for choices, _ in levels]
    assert sizes == [9, 25, 81][: len(levels)]
    for (_, coarse), (choices, fine) in pairwise(levels):
        assert np.all(fine.least_steps <= coarse.least_steps)
        # what a finer search builds on the coarser one is what it finds alone
        alone = capture(WALKER, STATES[::7], choices, most_steps=2)
        assert np.array_equal(alone.least_steps, fine.least_steps[::7])
    for _, each in levels:
        assert each.share(0) <= each.share(1) <= each.share(2)
    one_step = capture(WALKER, STATES, levels[-1][0], most_steps=1)
    assert np.array_equal(one_step.least_steps, np.minimum(levels[-1][1].least_steps, 2))


def test_after_a_plans_first_step_the_mirror_image_needs_one_step_fewer(found) -> None:
    two = np.flatnonzero(found.least_steps == 2)[::3]
    after = []
    for i in two:
        angle, offset = found.plans[i, 0]
        step = WALKER.step(STATES[i], inter_leg_angle=angle, mass_offset=offset, previous_offset=0.0)  # fmt: skip
        assert step.fall is None
        after.append(np.append(MIRROR * step.state, -step.mass_offset))
    assert np.array_equal(
        capture(CONTROLLED, np.array(after), most_steps=1).least_steps, np.ones(two.size)
    )


def test_a_controller_takes_over_like_the_constant_command_it_gives(found) -> None:
    states = np.column_stack([STATES, np.zeros(len(STATES))])[::4]
    controlled = capture(CONTROLLED, states, most_steps=2)
    assert np.array_equal(controlled.least_steps, found.least_steps[::4])
    assert np.array_equal(controlled.plans, found.plans[::4], equal_nan=True)


def test_nothing_depends_on_how_many_are_searched_at_a_time(found, monkeypatch) -> None:
    monkeypatch.setattr(capturability, "_LEAVES", 100)
    monkeypatch.setattr(capturability, "_CHUNK", 17)
    again = capture(WALKER, STATES[::3], most_steps=2, threads=2)
    assert np.array_equal(again.least_steps, found.least_steps[::3])
    assert np.array_equal(again.plans, found.plans[::3], equal_nan=True)


def test_an_interrupted_map_goes_on_and_holds_the_first_commands(tmp_path: Path, found, monkeypatch) -> None:  # fmt: skip
    path = tmp_path / "capture.nc"
    monkeypatch.setattr(filling, "_FEWEST", 50)
    search, calls = capturability.capture, []

    def interrupted(*given, **named):
        calls.append(given)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return search(*given, **named)

    monkeypatch.setattr(capturability, "capture", interrupted)
    with pytest.raises(KeyboardInterrupt):
        capture_map(WALKER, AXES, path=path)
    assert int((load_dataset(path).least_steps >= 0).sum()) == 44  # a region of four rows
    data = capture_map(WALKER, AXES, path=path)
    assert np.array_equal(data.least_steps.to_numpy().ravel(), found.least_steps)
    first = np.stack([data.inter_leg_angle, data.mass_offset], axis=-1).reshape(-1, 2)
    assert np.array_equal(first, found.plans[:, 0], equal_nan=True)
    with pytest.raises(ValueError, match="another question"):
        capture_map(WALKER, AXES, COARSE, path=path)


def test_the_gentlest_command_comes_first_and_finer_choices_hold_the_coarser_ones() -> None:
    commands = Choices().commands
    assert commands[0] == pytest.approx([0.3, 0.0])
    assert commands.shape == (35, 2)
    # as far from the middle: away from the stance foot, which is the left one, comes first
    assert commands[commands[:, 0] == commands[0, 0], 1][1:3] == pytest.approx([0.025, -0.025])
    finer = Choices().finer().commands
    assert len(finer) == 13 * 9
    for command in commands:
        assert np.abs(finer - command).max(axis=1).min() < 1e-12


def test_an_offset_changes_by_no_more_than_it_may() -> None:
    held = Choices(np.array([0.25, 0.3]), np.array([-0.05, 0.0, 0.05]), largest_change=0.005)
    found = capture(WALKER, STATES, held, most_steps=1)
    assert np.nanmax(np.abs(found.plans[:, :, 1])) <= 0.005
    free = capture(WALKER, STATES, Choices(np.array([0.25, 0.3]), np.array([-0.005, 0.0, 0.005])), most_steps=1)  # fmt: skip
    assert np.array_equal(found.least_steps, free.least_steps)


def test_a_solvers_failure_is_raised_and_no_fall(monkeypatch) -> None:
    def failing(bodies, commands, states, sides, rows, first, last) -> None:
        rows[first:last] = FAILED

    monkeypatch.setattr(active_map, "step_batch", failing)
    with pytest.raises(SolverError):
        capture(WALKER, STATES[:3], most_steps=0)
    with pytest.raises(SolverError, match="did not converge"):
        capture(WALKER, STATES[:3], most_steps=1, known=Capture(np.full(3, 2), np.full((3, 1, 2), np.nan)))  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"most_steps": 5}, "most_steps must be from 0 to 4"),
        ({"settle_steps": 0}, "settle_steps must be"),
        ({"states": STATES[:, :4]}, "states must have shape"),
        (
            {"known": Capture(np.zeros(2, dtype=int), np.zeros((2, 2, 2)))},
            "known must be of the same states",
        ),
    ],
)
def test_bad_arguments_are_refused_by_name(change: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        capture(WALKER, **{"states": STATES, **change})  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"inter_leg_angles": np.array([0.3, 0.2])}, "inter_leg_angles must be growing"),
        ({"inter_leg_angles": np.array([0.0, 0.2])}, "inter_leg_angle must be in"),
        ({"mass_offsets": np.array([-0.1, 0.05])}, "mass_offsets must be the same to both sides"),
        ({"mass_offsets": np.array([-2.0, 2.0])}, "mass_offsets must be in"),
        ({"largest_change": -1.0}, "largest_change must be in"),
    ],
)
def test_bad_choices_are_refused_by_name(arguments: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Choices(**arguments)


def test_a_walker_without_commands_is_refused() -> None:
    passive = PassiveMap(PassiveWalker(WalkerParameters(hip_width=0.0, slope=0.01)))
    with pytest.raises(ValueError, match="that takes commands"):
        capture(
            passive, np.array([[0.0, 0.2, 0.0, -0.2, 0.0, 0.0]]) * np.ones((4, 1)), most_steps=1
        )

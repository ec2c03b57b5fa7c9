"""A walker with a controller is a section map like the bare walker: every analysis gives the same of both where the controller does nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from lean_yaw_env.analysis import (
    ClosedLoopMap,
    active_map,
    basin,
    continue_gait,
    find_limit_cycle,
    find_periodic_gait,
    floor_demand,
    largest_disturbance,
    largest_pushes,
    modes,
    stability_map,
    step_derivatives,
)
from lean_yaw_env.analysis.attraction import push_ways
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.errors import NoGaitError, SolverError
from lean_yaw_env.kernel.records import FAILED
from lean_yaw_env.parameters import MIRROR, STATE_SIZE, Foot, Vector, WalkerParameters
from lean_yaw_env.walker import Walker

TABLE_1 = Walker(WalkerParameters())
GAIT = find_limit_cycle(TABLE_1)


class PlainInterface:
    """Shows the state as it is, mirrored on the right foot; an action is the inter-leg angle and the offset away from the stance foot."""

    remembered: Mapping[str, str] = {"previous_heading": "heading"}
    headings = ()
    scales = np.array([0.6, 0.03, 0.05, 0.1, 0.1, 0.05, 0.6])
    reach = np.array([0.15, 0.05])

    def observe(self, states: Vector, foot: Foot) -> Vector:
        sign = np.append(MIRROR, [-1.0, -1.0]) if foot == "right" else 1.0
        return states * sign

    def command(self, states: Vector, foot: Foot, actions: Vector) -> Vector:
        return actions * [1.0, 1.0 if foot == "left" else -1.0]

    def remember(self, states: Vector, outputs: Mapping[str, Vector]) -> Vector:
        return states[:, :1]


def closed_loop(predict, walker: Walker = TABLE_1) -> ClosedLoopMap:
    start = np.array([*GAIT.state, 0.0, GAIT.state[0]])
    return ClosedLoopMap(walker, PlainInterface(), predict, start)  # pyright: ignore[reportArgumentType]


def idle(observations: Vector) -> Vector:
    return np.tile([0.3, 0.0], (len(observations), 1))


def pumping(observations: Vector) -> Vector:
    return np.tile([0.3, 0.02], (len(observations), 1))


def feedback(observations: Vector) -> Vector:
    """Longer steps the faster it walks, and the masses moved against the lean."""
    faster = -0.42 - observations[:, 3]
    return np.column_stack([0.3 + 0.2 * faster, 0.3 * observations[:, 2]])


IDLE, FEEDBACK = closed_loop(idle), closed_loop(feedback)


def test_a_controller_that_does_nothing_leaves_gait_and_multipliers_as_they_are() -> None:
    found = find_limit_cycle(IDLE)
    assert found.state[:5] == pytest.approx(GAIT.state, abs=1e-11)
    for value in GAIT.eigenvalues:
        assert np.abs(found.eigenvalues - value).min() < 1e-9
    for name in ("speed", "step_length", "greatest_friction", "gravity_work", "turning_radius"):
        assert getattr(found, name) == pytest.approx(getattr(GAIT, name), abs=1e-10)


def test_a_controller_that_pumps_is_the_walker_at_that_command() -> None:
    found, bare = find_limit_cycle(closed_loop(pumping)), find_limit_cycle(TABLE_1, mass_offset=(0.02, -0.02))  # fmt: skip
    assert found.state[:5] == pytest.approx(bare.state, abs=1e-10)
    assert found.shift_work == pytest.approx(bare.shift_work, abs=1e-10)
    demands = floor_demand(closed_loop(pumping)), floor_demand(TABLE_1, mass_offset=(0.02, -0.02))
    for name in ("least_normal_force", "greatest_friction", "greatest_yaw_torque"):
        assert getattr(demands[0], name) == pytest.approx(getattr(demands[1], name), abs=1e-8)


@pytest.mark.parametrize("parameter", ["slope", "hip_width", "foot_radius"])
def test_derivatives_of_map_agree_with_differences(parameter: str) -> None:
    state = find_limit_cycle(FEEDBACK).state
    image, matrix, by_parameter = FEEDBACK.sensitivity(state, parameter)
    assert image == pytest.approx(FEEDBACK.image(state), abs=1e-12)
    for k, way in enumerate(1e-5 * np.eye(state.size)):
        ahead, behind = FEEDBACK.image(state + way), FEEDBACK.image(state - way)
        # steps good to 1e-10 over 2e-5, and the controller's slopes to 1e-6 of their scale
        assert matrix[:, k] == pytest.approx((ahead - behind) / 2e-5, rel=1e-4, abs=1e-4)
    value = FEEDBACK.value(parameter)
    ahead, behind = (FEEDBACK.moved(parameter, value + h).image(state) for h in (1e-5, -1e-5))
    assert by_parameter == pytest.approx((ahead - behind) / 2e-5, rel=1e-4, abs=1e-4)


def test_idle_branch_is_that_of_the_bare_walker() -> None:
    idle_branch, bare = (
        continue_gait(each, "slope", (0.008, 0.014), longest_step=0.1) for each in (IDLE, TABLE_1)
    )
    assert idle_branch.ended == bare.ended == "slope reached 0.014"
    assert idle_branch.cycle(-1).speed == pytest.approx(bare.cycle(-1).speed, abs=1e-6)
    stride = np.sort(np.abs(bare.eigenvalues[-1]) ** 2)
    assert np.sort(np.abs(idle_branch.eigenvalues[-1]))[-4:] == pytest.approx(stride[-4:], abs=1e-5)


def test_feedback_is_followed_to_where_it_loses_stability_which_the_multipliers_say() -> None:
    branch = continue_gait(FEEDBACK, "slope", (0.002, 0.02), upward=False, longest_step=0.1)
    stable = branch.is_stable
    assert stable.any()
    for index in (0, -1):
        cycle = branch.cycle(index)
        walk = walk_many(
            FEEDBACK.moved("slope", branch.values[index]), cycle.state[None] + 1e-6, 60
        )
        assert walk.survived[0] or not stable[index]


def test_idle_basin_and_disturbance_are_those_of_the_bare_walker() -> None:
    axes = (
        ("ankle_angle", GAIT.state[2] + np.linspace(-0.2, 0.2, 7)),
        ("ankle_rate", GAIT.state[4] + np.linspace(-0.5, 0.5, 7)),
    )
    idle_basin, bare = (basin(each, *axes, n_steps=30) for each in (IDLE, TABLE_1))
    assert np.array_equal(idle_basin.ending, bare.ending)
    assert np.array_equal(idle_basin.steps, bare.steps)
    around_start = basin(IDLE, *axes, centre=IDLE.start, n_steps=30)
    assert np.array_equal(around_start.ending, bare.ending)
    assert "distance" not in around_start
    idle_push, push = (largest_disturbance(each, "ankle_rate", most=3.0) for each in (IDLE, TABLE_1))  # fmt: skip
    assert idle_push.largest == pytest.approx(push.largest, abs=1e-6)


def test_a_basins_file_is_refused_to_another_controller(tmp_path) -> None:
    axes = (("ankle_angle", [-0.01, 0.0]), ("ankle_rate", [-0.1, 0.0]))
    path = tmp_path / "basin.nc"
    first = basin(IDLE, *axes, centre=IDLE.start, n_steps=3, path=path)
    assert first.identical(basin(IDLE, *axes, centre=IDLE.start, n_steps=3, path=path))
    with pytest.raises(ValueError, match="another question"):
        basin(FEEDBACK, *axes, centre=FEEDBACK.start, n_steps=3, path=path)
    assert first.identical(basin(IDLE, *axes, centre=IDLE.start, n_steps=3, path=path))


def test_a_map_over_parameters_holds_the_closed_loops_gaits() -> None:
    result = stability_map(FEEDBACK, {"slope": [0.01, 0.012]})
    assert (result.status == 1).all()
    cycle = find_limit_cycle(FEEDBACK.moved("slope", 0.012))
    assert float(result.speed.sel(slope=0.012)) == pytest.approx(cycle.speed, abs=1e-9)


def test_the_largest_push_is_survived_and_a_little_more_is_not() -> None:
    cycle = find_limit_cycle(FEEDBACK)
    pushes = largest_pushes(cycle, directions=8)
    assert pushes.is_limited.all()
    ways = push_ways(FEEDBACK, pushes.angles)
    sizes = pushes.sizes[:, None]
    assert walk_many(FEEDBACK, cycle.state + sizes * ways, 60).survived.all()
    beyond = cycle.state + (sizes + 1.01 * pushes.tolerance) * ways
    assert not walk_many(FEEDBACK, beyond, 60).survived.any()
    # half of it, a size of its own, is survived in every direction: the basin has no hole there
    assert walk_many(FEEDBACK, cycle.state + 0.5 * sizes * ways, 60).survived.all()


def test_a_push_that_nothing_fells_is_as_large_as_was_looked() -> None:
    pushes = largest_pushes(find_limit_cycle(IDLE), directions=4, most=0.05)
    assert not pushes.is_limited.any() and np.allclose(pushes.sizes, 0.05)


def test_pushes_start_from_the_direction_zero_of_the_pitch_rate() -> None:
    ways = push_ways(IDLE, np.array([0.0, 0.5 * np.pi]))
    assert np.allclose(ways, [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 1, 0, 0]])


def test_the_basin_shrinks_as_more_steps_are_asked_for() -> None:
    axes = (
        ("ankle_angle", GAIT.state[2] + np.linspace(-0.3, 0.3, 15)),
        ("ankle_rate", GAIT.state[4] + np.linspace(-0.8, 0.8, 15)),
    )
    few, many = (basin(IDLE, *axes, n_steps=n).ending == 0.0 for n in (5, 60))
    assert bool(few[7, 7]) and bool(many[7, 7])
    assert not bool((many & ~few).any())
    assert 0.0 < float(many.mean()) < float(few.mean()) < 1.0


def test_every_mode_of_a_closed_loop_has_a_name_and_a_bound_of_its_error() -> None:
    found = modes(find_limit_cycle(FEEDBACK))
    assert {mode.about for mode in found} <= {"heading", "lean", "pitch", "masses"}
    exact = modes(GAIT)
    assert all(mode.error == 0.0 for mode in exact)
    # differences of a controller in double precision are good to 1e-9 of its scales
    assert max(mode.error for mode in found if not mode.is_zero) < 1e-4


def test_a_gait_of_two_steps_is_no_gait_of_four() -> None:
    with pytest.raises(NoGaitError, match="settled to a gait of 2 steps or fewer"):
        find_periodic_gait(FEEDBACK, n_steps=4)


# --- failures


def failing(bodies, commands, states, sides, rows, first, last) -> None:
    rows[first:last] = 0.0
    rows[first:last, 5] = FAILED


def test_a_solvers_failure_is_raised_and_no_fall(monkeypatch) -> None:
    monkeypatch.setattr(active_map, "step_batch", failing)
    walks = walk_many(FEEDBACK, FEEDBACK.start[None], 3)
    assert walks.endings[0] == FAILED
    assert np.array_equal(walks.states[0], FEEDBACK.start)  # where the failing step began
    with pytest.raises(SolverError, match="did not converge"):
        walks.require_solved()
    with pytest.raises(SolverError, match="did not converge"):
        find_limit_cycle(FEEDBACK)
    with pytest.raises(SolverError, match="did not converge"):
        largest_pushes(GAIT, directions=2)


def test_a_failure_in_the_linear_step_is_raised_and_no_fall(monkeypatch) -> None:
    failed = FAILED, np.zeros(10), np.zeros((10, 8))
    monkeypatch.setattr(step_derivatives, "step_jacobian", lambda *arguments: failed)
    with pytest.raises(SolverError, match="did not converge"):
        FEEDBACK.linearise(FEEDBACK.start)


def test_a_controllers_bad_answer_is_refused() -> None:
    def not_a_number(observations: Vector) -> Vector:
        return np.full((len(observations), 2), np.nan)

    for bad, message in (
        (not_a_number, "finite numbers, got nan"),
        (lambda seen: np.zeros((len(seen), 3)), r"must have shape \(1, 2\), got \(1, 3\)"),
    ):
        with pytest.raises(ValueError, match=f"predict's actions.*{message}"):
            walk_many(closed_loop(bad), FEEDBACK.start[None], 1)


def test_bad_arguments_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="n_steps must be even, got 3"):
        FEEDBACK.over(3)
    with pytest.raises(ValueError, match="state must have shape"):
        replace(FEEDBACK, start=GAIT.state)
    with pytest.raises(ValueError, match="parameter must be one of hip_width"):
        FEEDBACK.moved("inter_leg_angle", 0.2)
    with pytest.raises(ValueError, match="takes no inter_leg_angle"):
        find_limit_cycle(FEEDBACK, inter_leg_angle=0.2)
    with pytest.raises(ValueError, match="directions must be"):
        largest_pushes(GAIT, directions=0)
    with pytest.raises(ValueError, match="most must be"):
        largest_pushes(GAIT, most=0.0)
    with pytest.raises(ValueError, match="n_steps must be"):
        walk_many(FEEDBACK, FEEDBACK.start[None], 0)
    assert FEEDBACK.names[:STATE_SIZE] == tuple(GAIT.section_map.names)

"""Regulation and guidance: optimal and stabilising by the exact map, mirror-symmetric, and better than what they replace."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import solve_discrete_lyapunov

from agents import AgentRequest, FixedController, make_agent
from agents.controllers.gaits import ALL_HEADINGS, ANGLES, Pumping, gait_nodes, linearise_step
from agents.controllers.guidance import (
    PathGuidance,
    PathSettings,
    WaypointGuidance,
    WaypointSettings,
    guided,
)
from agents.controllers.lqr import HeadingLqr, LqrSettings
from agents.controllers.schedule import GainSchedule, LqrWeights, last_turn, periodic_gains
from agents.evaluation.scoring import run_episodes
from agents.observations import ObservationLayout
from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis.active_map import ActiveMap
from lean_yaw_env.analysis.fixed_point import solve_fixed_point
from lean_yaw_env.analysis.limit_cycle import cycle_at, find_gait
from lean_yaw_env.envs.options import EnvOptions, gait_of
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.kernel.records import Command
from lean_yaw_env.parameters import MIRROR

WEIGHTS = LqrWeights()
RAW = EnvOptions(mirror=False)
MIDDLE = int(np.argmin(np.abs(np.array(ANGLES) - 0.3)))
TASKS = ("Heading", "SpeedHeading", "Metastable", "Slalom", "Waypoint", "Level", "UTurn")
AGENTS_BY_TASK = {task: guided(task, EnvOptions()) for task in TASKS}


@pytest.fixture(scope="module")
def schedule() -> GainSchedule:
    return GainSchedule(WalkerParameters(), WEIGHTS, Pumping())


def mirrored_step(walker, state, offset, angle, change):
    """The regulated state after one step, in the frame of the left foot; the step itself, not its derivatives."""
    after = walker.step(
        state, inter_leg_angle=angle, mass_offset=offset + change, previous_offset=offset
    )
    return np.append(MIRROR * after.state, -after.mass_offset)


def test_the_linear_step_is_the_limit_of_small_differences(walker, gait):
    step = linearise_step(walker, gait, Command(0.3, 0.0, 0.0))
    small = 1e-6
    for column in range(6):
        nudge = small * np.eye(6)[column]
        ahead = mirrored_step(walker, gait + nudge[:5], nudge[5], 0.3, 0.0)
        back = mirrored_step(walker, gait - nudge[:5], -nudge[5], 0.3, 0.0)
        # central differences: small^2 times the third derivative, and round-off of 1e-13 / small
        assert np.allclose(step.by_state[:, column], (ahead - back) / (2.0 * small), atol=2e-6)
    for column, (angle, change) in enumerate([(small, 0.0), (0.0, small)]):
        ahead = mirrored_step(walker, gait, 0.0, 0.3 + angle, change)
        back = mirrored_step(walker, gait, 0.0, 0.3 - angle, -change)
        assert np.allclose(step.by_input[:, column], (ahead - back) / (2.0 * small), atol=2e-6)


@pytest.mark.parametrize("offsets", [(0.0, 0.0), (0.02, -0.015)])
def test_the_speed_s_derivatives_are_the_limit_of_small_differences(walker, gait, offsets):
    start, (before, change) = gait + 0.2 * np.eye(5)[0], offsets
    exact = linearise_step(walker, start, Command(0.3, before + change, before)).speed

    def speed(point):
        step = walker.step(
            point[:5],
            previous_offset=point[5],
            inter_leg_angle=point[6],
            mass_offset=point[5] + point[7],
        )
        heading = 0.5 * (point[0] + step.state[0])
        along = step.displacement @ [math.cos(heading), -math.sin(heading)]
        return along / step.duration

    middle, small = np.array([*start, before, 0.3, change]), 1e-6
    differences = [
        (speed(middle + nudge) - speed(middle - nudge)) / (2.0 * small)
        for nudge in small * np.eye(8)
    ]
    # small^2 times the third derivative, and round-off of 1e-13 / small
    assert exact == pytest.approx(differences, abs=1e-7)


@pytest.mark.parametrize("heading", [0.0, 0.3, -0.6])
def test_feedback_pulls_all_eigenvalues_of_the_stride_inside_those_of_the_open_loop(
    walker, heading
):
    offset = -math.tan(0.01) * math.sin(heading)
    left, right = _held_gaits(walker, offset)
    now, then = (
        linearise_step(walker, left, Command(0.3, offset, offset)),
        linearise_step(walker, right, Command(0.3, -offset, -offset)),
    )
    one, other = periodic_gains(now, then, WEIGHTS)
    again = periodic_gains(then, now, WEIGHTS)
    # the Riccati equation of the other stride, solved to 1e-10 and better
    assert np.allclose([other, one], again, rtol=1e-6, atol=1e-8)
    closed = (then.by_state - then.by_input @ other) @ (now.by_state - now.by_input @ one)
    # without feedback the offset stays where it is: the stride of the walker alone
    free = (then.by_state @ now.by_state)[:5, :5]
    assert np.abs(np.linalg.eigvals(closed)).max() < np.abs(np.linalg.eigvals(free)).max() < 1.0


def _held_gaits(walker, offset):
    """The gait that an offset holds, and its right stance as a left one."""
    left = find_gait(walker, mass_offset=offset)
    return left, MIRROR * walker.step(left, mass_offset=offset).state


@pytest.mark.parametrize("weights", [WEIGHTS, LqrWeights(speed=0.05)])
def test_the_gain_is_worth_no_less_than_any_near_it(walker, gait, weights):
    step = linearise_step(walker, gait, Command(0.3, 0.0, 0.0))
    gain = periodic_gains(step, step, weights)[0]
    state_cost, input_cost = weights.matrices()

    def cost_to_go(feedback):
        closed = step.by_state - step.by_input @ feedback
        speed = (step.speed[:6] - step.speed[6:] @ feedback) / weights.speed
        cost = state_cost + feedback.T @ input_cost @ feedback + np.outer(speed, speed)
        return np.trace(solve_discrete_lyapunov(closed.T, cost))

    best = cost_to_go(gain)
    rng = np.random.default_rng(0)
    for _ in range(20):
        # 2 % of each gain: well above round-off, well within stability
        near = gain * (1.0 + 0.02 * rng.normal(size=gain.shape))
        assert cost_to_go(near) > best


def test_gaits_are_as_fast_as_their_linear_steps_say(walker):
    at = MIDDLE
    nodes = gait_nodes(walker.parameters, Pumping())
    shorter, node, longer = (nodes[k][4] for k in (at - 1, at, at + 1))
    # a gait's step repeats itself: z = (A z + B v), so z = (1 - A)^-1 B v and its speed is that of z and v
    angle = 0.5 * (ANGLES[at + 1] - ANGLES[at - 1])
    free = [0, 1, 2, 3, 4]
    a, b = node.step.by_state[np.ix_(free, free)], node.step.by_input[free, 0]
    z = np.linalg.solve(np.eye(5) - a, b)
    slope = node.step.speed[free] @ z + node.step.speed[6]
    # central difference over 0.025 rad each way of a curve that bends by a tenth of its slope there
    assert (longer.speed - shorter.speed) / (2.0 * angle) == pytest.approx(slope, rel=0.1)


def test_the_last_turn_follows_from_the_state_that_it_left(walker, gait):
    weights = last_turn(linearise_step(walker, gait, Command(0.3, 0.0, 0.0)), WEIGHTS)
    base = walker.step(gait)
    rng = np.random.default_rng(1)
    for _ in range(20):
        start = gait + rng.uniform(-0.01, 0.01, 5) * [0, 1, 1, 1, 1]
        after = walker.step(start, mass_offset=0.004, previous_offset=0.0)
        turned = after.state[0] - base.state[0]
        left = np.append(MIRROR * (after.state - base.state), -0.004)[1:]
        # the turn is read off the left-hand frame; what is left is of second order in 0.01
        assert -weights @ left == pytest.approx(turned, abs=2e-3)
        assert abs(turned) < 0.2


def test_schedules_are_linear_between_nodes_as_scipy_has_it_and_held_at_the_edges(schedule):
    grid = (schedule.angles, schedule.headings)
    scipys = RegularGridInterpolator(grid, schedule._table)
    generator = np.random.default_rng(0)
    # beyond the edges too, and on nodes
    angles = np.concatenate([generator.uniform(0.0, 0.6, 200), schedule.angles])
    headings = np.concatenate([generator.uniform(-1.0, 1.0, 200), np.resize(schedule.headings, 13)])
    held = [np.clip(x, nodes[0], nodes[-1]) for x, nodes in zip((angles, headings), grid, strict=True)]  # fmt: skip
    expected = scipys(np.stack(held, axis=-1))
    found = schedule.at(angles, headings)
    flat = [found.state, found.inter_leg_angle[:, None], found.gain.reshape(-1, 12), found.turn]
    columns = [*range(6), *range(9, expected.shape[1])]
    # rounding alone: the products are summed in another order
    np.testing.assert_allclose(np.hstack(flat), expected[:, columns], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.held_offset, expected[:, 6], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.pumping, expected[:, 7], rtol=1e-12, atol=1e-12)


def test_scheduled_speeds_are_those_of_the_angles_they_give(schedule):
    speeds = np.linspace(0.3, 0.55, 6)
    angles = schedule.angles_of(speeds, np.zeros(6))
    for speed, angle in zip(speeds, angles, strict=True):
        # linear between angles 0.025 apart
        walker = Walker(WalkerParameters())
        gait = schedule.at(np.array(angle), np.array(0.0)).state
        found = solve_fixed_point(ActiveMap(walker, float(angle)), gait)
        cycle = cycle_at(ActiveMap(walker, float(angle)), found)
        assert cycle.speed == pytest.approx(speed, abs=2e-3)


@settings(max_examples=15)
@given(numbers=st.lists(st.floats(-2.0, 2.0), min_size=12, max_size=12))
def test_the_other_foot_is_answered_by_the_mirror_image(numbers):
    odd = ("heading", "ankle_angle", "ankle_rate", "mass_offset", "stance_foot", "heading_error")
    odd += ("cross_track_error", "path_heading_error", "preview", "goal_bearing")
    for task in TASKS:
        agent = guided(task, RAW)
        names = ObservationLayout.of(task, RAW).names
        seen = np.array(numbers[: len(names)], dtype=np.float32)
        seen[names.index("stance_foot")] = 1.0
        flips = np.array([-1.0 if name.startswith(odd) else 1.0 for name in names])
        one, other = agent.predict(seen)[0], agent.predict((flips * seen).astype(np.float32))[0]
        assert one == pytest.approx(other * np.array([1.0, -1.0]), abs=1e-5)  # float32


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("shape", [(), (2, 3)])
def test_actions_have_the_observations_shape_and_lie_in_the_action_space(task, shape):
    agent = AGENTS_BY_TASK[task]
    width = len(ObservationLayout.of(task, EnvOptions()).names)
    seen = np.random.default_rng(0).uniform(-10.0, 10.0, (*shape, width)).astype(np.float32)
    actions, state = agent.predict(seen)
    assert state is None
    assert actions.shape == (*shape, 2)
    assert actions.dtype == np.float32
    assert np.abs(actions).max() <= 1.0
    # each row is answered as if it were alone
    if shape:
        alone = agent.predict(seen[(0,) * len(shape)])[0]
        assert actions[(0,) * len(shape)] == pytest.approx(alone, abs=1e-6)


def test_the_gait_itself_is_answered_by_its_own_command():
    env = WalkerEnv("Heading", start_disturbance=0.0)
    seen, _ = env.reset(seed=0, options={"command": 0.0})
    lqr = HeadingLqr("Heading", settings=LqrSettings(inter_leg_angle=0.3))
    # the start's mean heading is one footprint's, 0.0015 rad off the gait's
    assert np.abs(lqr.predict(seen)[0]).max() < 0.02


@pytest.mark.parametrize(
    ("task", "metric", "least", "options"),
    [
        # means over 1,000 held-out episodes in brackets; 24 episodes stray from them by a tenth or so
        ("Heading", "settled_fraction", 0.8, EnvOptions()),  # (0.87)
        ("SpeedHeading", "settled_fraction", 0.6, EnvOptions()),  # (0.71)
        ("Waypoint", "goals", 3.5, EnvOptions()),  # (4.8)
        ("UTurn", "return", 75.0, EnvOptions()),  # (96 over 200 episodes)
    ],
)
def test_a_task_is_done_as_well_as_measured(task, metric, least, options):
    results = run_episodes(AGENTS_BY_TASK[task], task, episodes=24, options=options)
    assert results.metrics[metric].mean() > least


def test_a_commanded_speed_is_walked_where_the_paper_has_one_speed():
    regulated = run_episodes(AGENTS_BY_TASK["SpeedHeading"], "SpeedHeading", episodes=24)
    fixed = run_episodes(FixedController(), "SpeedHeading", episodes=24)
    error = "mean_absolute_speed_error"
    assert regulated.metrics[error].mean() < 0.8 * fixed.metrics[error].mean()


@pytest.mark.parametrize("bearing", [0.5 * math.pi, -0.5 * math.pi])
def test_a_goal_within_the_turning_circle_is_not_turned_to(bearing):
    layout = ObservationLayout.of("Waypoint", EnvOptions())
    inside, ahead = (_seen(layout, goal_distance=2.0, goal_bearing=b) for b in (bearing, 0.0))
    outside = _seen(layout, goal_distance=14.0, goal_bearing=bearing)
    agent = AGENTS_BY_TASK["Waypoint"]
    straight = agent.predict(ahead)[0][1]
    assert agent.predict(inside)[0][1] == straight
    # to the left (positive) by an offset to the left (negative)
    assert math.copysign(1.0, straight - agent.predict(outside)[0][1]) == math.copysign(
        1.0, bearing
    )


def _seen(layout, **quantities):
    """An observation of these quantities; the others are the gait's on the left foot, or zero."""
    values = dict.fromkeys(layout.names, 0.0)
    state = ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate")
    values |= dict(zip(state, gait_of(WalkerParameters()), strict=True)) | quantities
    rows = zip(layout.names, layout.centres, layout.scales, strict=True)
    return np.array([(values[name] - c) / s for name, c, s in rows], dtype=np.float32)


@pytest.mark.parametrize("heading", [0.0, 1.4, math.pi])
def test_a_gait_that_pumps_repeats_along_every_heading_of_the_slope(walker, heading):
    nodes = gait_nodes(walker.parameters, Pumping(0.02, 0.03))
    column = int(np.argmin(np.abs(np.array(ALL_HEADINGS) - heading)))
    node = nodes[MIDDLE][column]
    start = node.state + ALL_HEADINGS[column] * np.eye(5)[0]
    left, right = node.held_offset + node.pumping, node.held_offset - node.pumping
    first = walker.step(start, mass_offset=left, previous_offset=right)
    second = walker.step(
        first.state, stance="right", mass_offset=right, previous_offset=first.mass_offset
    )
    turned = second.state - start
    # the heading given is that of the mean of two footprints, a gait's own 0.01 rad or so to one side
    assert np.abs(np.mod(turned[0] + 1.0, 2.0 * math.pi) - 1.0) < 1e-3
    assert np.abs(turned[1:]).max() < 1e-3


def test_feedback_holds_a_gait_that_pumps():
    walker = Walker(WalkerParameters(slope=0.0))
    node = gait_nodes(walker.parameters, Pumping(0.03))[MIDDLE][0]
    gain = periodic_gains(node.step, node.step, WEIGHTS)[0]
    closed = node.step.by_state - node.step.by_input @ gain
    assert np.abs(np.linalg.eigvals(closed)).max() < 1.0


def test_on_the_level_the_gait_that_pumps_is_answered_by_its_own_command():
    env = WalkerEnv("Level", start_disturbance=0.0)
    seen, _ = env.reset(seed=0, options={"command": 0.0})
    lqr = HeadingLqr("Level", settings=LqrSettings(inter_leg_angle=0.3, pumping=Pumping(0.03)))
    # the start's mean heading is one footprint's, some 0.01 rad off the gait's
    assert lqr.predict(seen)[0] == pytest.approx([0.0, 0.6], abs=0.15)


def test_a_walker_without_a_gait_gets_no_regulator(monkeypatch):
    request = AgentRequest("LeanYaw/Level-v1", EnvOptions())
    monkeypatch.setattr("agents.settings.all_settings", dict)
    # nothing tuned, so nothing that pumps: on the level there is no gait
    with pytest.raises(NoGaitError):
        make_agent("lqr", request)


def test_the_registry_makes_them_by_one_name():
    for task, agent in AGENTS_BY_TASK.items():
        made = make_agent("lqr", AgentRequest(f"LeanYaw/{task}-v1", EnvOptions()))
        assert type(made) is type(agent)


def test_bad_numbers_tasks_and_slopes_are_refused_by_name():
    with pytest.raises(ValueError, match=r"heading must be in \(0, inf\), got 0"):
        LqrWeights(heading=0.0)
    with pytest.raises(ValueError, match=r"offset_change must be in \(0, inf\), got inf"):
        LqrWeights(offset_change=math.inf)
    with pytest.raises(ValueError, match="inter_leg_angle must be in"):
        LqrSettings(inter_leg_angle=0.6)
    with pytest.raises(ValueError, match="largest_error must be in"):
        LqrSettings(largest_error=0.0)
    with pytest.raises(ValueError, match="ahead must be in"):
        PathSettings(ahead=9.0)
    with pytest.raises(ValueError, match="radius must be in"):
        WaypointSettings(radius=-1.0)
    with pytest.raises(ValueError, match="task must be one that shows heading_error"):
        HeadingLqr("Walk")
    with pytest.raises(ValueError, match="task must be one that shows cross_track_error"):
        PathGuidance("Heading")
    with pytest.raises(ValueError, match="task must be one that shows goal_bearing"):
        WaypointGuidance("Heading")
    with pytest.raises(ValueError, match="pumping downhill must be"):
        Pumping(-0.01)
    with pytest.raises(NoGaitError):
        HeadingLqr("Level", settings=LqrSettings())

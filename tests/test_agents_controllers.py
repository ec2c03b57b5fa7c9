"""The agents that need no training: shapes, symmetry, closed forms, and that feedback steers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents import (
    AGENTS,
    AgentRequest,
    FixedController,
    HeadingFeedback,
    HeadingGains,
    RandomController,
    make_agent,
)
from agents.evaluation.scoring import run_episodes
from agents.observations import ObservationLayout
from lean_yaw_env.envs.options import EnvOptions, gait_of
from lean_yaw_env.parameters import MIRROR, WalkerParameters

ID = "LeanYaw/Heading-v1"
LAYOUT = ObservationLayout.of("Heading", EnvOptions())
RAW = EnvOptions(mirror=False)
RAW_LAYOUT = ObservationLayout.of("Heading", RAW)


def observe(layout: ObservationLayout, **quantities: float) -> np.ndarray:
    """An observation of these quantities; the others are the gait's on the left foot, or zero."""
    values = dict.fromkeys(layout.names, 0.0)
    state = ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate")
    values |= dict(zip(state, gait_of(WalkerParameters()), strict=True)) | quantities
    return np.array(
        [
            (values[name] - centre) / scale
            for name, centre, scale in zip(layout.names, layout.centres, layout.scales, strict=True)
        ],
        dtype=np.float32,
    )


@pytest.mark.parametrize("agent", [FixedController(), RandomController(), HeadingFeedback()])
@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3)])
def test_actions_have_the_observations_leading_shape_and_lie_in_the_action_space(agent, shape):
    observation = np.random.default_rng(0).uniform(-10.0, 10.0, (*shape, 7)).astype(np.float32)
    actions, state = agent.predict(observation)
    assert state is None
    assert actions.shape == (*shape, 2)
    assert actions.dtype == np.float32
    assert np.abs(actions).max() <= 1.0


def test_the_fixed_controller_never_acts():
    assert not FixedController().predict(np.full((5, 7), 3.0))[0].any()


def test_random_actions_depend_on_their_seed_alone_and_fill_the_space():
    observation = np.zeros((2000, 7))
    first = RandomController(1).predict(observation)[0]
    assert np.array_equal(first, RandomController(1).predict(observation)[0])
    assert not np.array_equal(first, RandomController(2).predict(observation)[0])
    # uniform: mean 0 within 5 standard errors of 1/sqrt(3 * 4000), extremes reached
    assert abs(first.mean()) < 5.0 / math.sqrt(3.0 * 4000.0)
    assert first.min() < -0.99
    assert first.max() > 0.99


@given(heading=st.floats(-0.6, 0.6))
def test_on_its_heading_pure_feedforward_holds_the_offset_of_the_closed_form(heading):
    gains = HeadingGains(feedforward=1.0, inter_leg_angle=0.0)
    seen = observe(LAYOUT, heading=heading)
    action = HeadingFeedback(gains=gains).predict(seen)[0]
    # sin(phi) = -mu / tan(slope); observations and actions are float32
    offset = -math.tan(0.01) * math.sin(heading)
    assert action[1] * 0.05 == pytest.approx(offset, abs=2e-8)
    assert action[0] == 0.0


@given(
    state=st.tuples(*(st.floats(-0.3, 0.3) for _ in range(5))),
    error=st.floats(-1.2, 1.2),
    offset=st.floats(-0.05, 0.05),
)
def test_feedback_on_raw_observations_is_the_mirror_image_on_the_other_foot(state, error, offset):
    feedback = HeadingFeedback(options=RAW)
    names = ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate")
    left = dict(zip(names, state, strict=True))
    right = dict(zip(names, (MIRROR * np.array(state)).tolist(), strict=True))
    seen_left = observe(RAW_LAYOUT, stance_foot=1.0, heading_error=error, mass_offset=offset, **left)  # fmt: skip
    seen_right = observe(RAW_LAYOUT, stance_foot=-1.0, heading_error=-error, mass_offset=-offset, **right)  # fmt: skip
    one, other = feedback.predict(seen_left)[0], feedback.predict(seen_right)[0]
    assert one[0] == other[0]
    assert one[1] == pytest.approx(-other[1], abs=1e-6)  # float32


def test_feedback_acts_alike_on_raw_and_mirrored_observations_of_the_left_foot():
    quantities = {"heading": 0.2, "ankle_angle": 0.03, "ankle_rate": -0.1, "heading_error": 0.1}
    mirrored = HeadingFeedback().predict(observe(LAYOUT, **quantities))[0]
    raw = HeadingFeedback(options=RAW).predict(observe(RAW_LAYOUT, stance_foot=1.0, **quantities))[
        0
    ]
    assert np.array_equal(mirrored, raw)


def test_an_action_without_a_range_is_left_alone():
    options = EnvOptions(inter_leg_angle_range=0.0, mass_offset_range=0.0)
    feedback = HeadingFeedback(options=options)
    assert not feedback.predict(observe(LAYOUT, heading_error=0.5))[0].any()


def test_feedback_steers_where_the_fixed_controller_cannot():
    steered = run_episodes(HeadingFeedback(), "Heading", episodes=48)
    straight = run_episodes(FixedController(), "Heading", episodes=48)
    assert steered.survived.all()
    # measured over 1000 episodes: 0.092 against 0.304 rad
    assert steered.metrics["mean_absolute_heading_error"].mean() < 0.1
    assert straight.metrics["mean_absolute_heading_error"].mean() > 0.2


def test_every_registered_controller_can_be_made_for_heading():
    for name in AGENTS:
        if AGENTS[name].kind in ("baseline", "feedback"):
            agent = make_agent(name, AgentRequest(ID, EnvOptions()))
            assert agent.predict(np.zeros((2, 7)))[0].shape == (2, 2)


def test_bad_names_shapes_gains_and_tasks_are_refused_by_name():
    with pytest.raises(ValueError, match=r"agent must be one of random, fixed, .*ppo"):
        make_agent("sac!", AgentRequest(ID, EnvOptions()))
    with pytest.raises(ValueError, match=r"observation must have shape \(\.\.\., 7\)"):
        HeadingFeedback().predict(np.zeros(6))
    with pytest.raises(ValueError, match="observation must have shape"):
        FixedController().predict(np.float32(1.0))
    with pytest.raises(ValueError, match="proportional must be a finite number"):
        HeadingGains(proportional=math.nan)
    with pytest.raises(ValueError, match="task must be one that shows heading_error"):
        HeadingFeedback("Walk")

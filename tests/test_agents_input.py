"""What agents do with observations that no environment gives: they raise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents import AgentRequest, FixedController, RandomController, make_agent
from agents.agent import attach
from agents.registry import env_id_of, names_for
from lean_yaw_env.envs import WalkerVectorEnv
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import GOAL_TASK

FEATURES = 7
BAD: list[tuple[Any, str]] = [
    (np.full((1, FEATURES), np.nan), "finite numbers"),
    (np.array([[0.0] * (FEATURES - 1) + [np.inf]]), "finite numbers"),
    (np.zeros((1, FEATURES + 1)), "shape"),
    (np.zeros((1, FEATURES - 1)), "shape"),
    (np.zeros(()), "shape"),
    (np.zeros((1, FEATURES), dtype=complex), "finite numbers"),
    (np.zeros((1, FEATURES), dtype=bool), "finite numbers"),
    ([["0.0"] * FEATURES], "finite numbers"),
    (None, "finite numbers"),
]


def made(name: str) -> Any:
    """An agent for Heading, in an environment of one walker if it needs one."""
    agent = make_agent(name, AgentRequest(env_id_of("Heading"), EnvOptions(), runs=None))
    env = WalkerVectorEnv(1, "Heading")
    env.reset(seed=0)
    attach(agent, env)
    return agent


@pytest.mark.parametrize(
    "name", names_for(AgentRequest(env_id_of("Heading"), EnvOptions(), runs=None))
)
def test_every_agent_refuses_observations_that_are_no_finite_numbers_of_its_shape(
    name: str,
) -> None:
    agent = made(name)
    assert np.isfinite(agent.predict(np.zeros((1, FEATURES)))[0]).all()
    for observation, message in BAD:
        with pytest.raises(ValueError, match=f"observation must .*{message}"):
            agent.predict(observation)


@pytest.mark.parametrize("agent", [FixedController(), RandomController()])
def test_agents_for_any_task_refuse_what_is_no_observation_at_all(agent: Any) -> None:
    assert agent.predict(np.zeros((3, 20)))[0].shape == (3, 2)
    for observation in (np.array([np.nan]), 1.0, None, "words", [[1.0], [1.0, 2.0]]):
        with pytest.raises(ValueError, match=r"observation must|inhomogeneous"):
            agent.predict(observation)


@pytest.mark.parametrize("name", ["random", "fixed", "lqr", "her"])
def test_agents_of_goals_refuse_incomplete_and_undefined_goals(name: str) -> None:
    agent = make_agent(name, AgentRequest(env_id_of(GOAL_TASK), EnvOptions(), runs=None))
    good = {"observation": np.zeros(9), "achieved_goal": np.zeros(2), "desired_goal": np.ones(2)}
    assert agent.predict(good)[0].shape == (2,)  # type: ignore[arg-type]
    for changes in ({"desired_goal": np.array([np.nan, 0.0])}, {"observation": np.zeros(3)}):
        with pytest.raises(ValueError, match="observation must"):
            agent.predict({**good, **changes})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="observation must"):
        agent.predict({"observation": np.zeros(9)})  # type: ignore[arg-type]

"""Datasets of episodes for offline reinforcement learning, in Minari's format; ``python -m agents dataset``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal, get_args

import gymnasium as gym
import numpy as np
from tqdm import trange

import lean_yaw_env
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.validation import require_choice, require_count

from .agent import Agent, State, attach
from .registry import AgentRequest, env_id_of, make_agent
from .seeds import MOST_WALKERS, training_seed

Kind = Literal["expert", "medium", "random", "mixed"]
KINDS: tuple[Kind, ...] = get_args(Kind)
MEDIUM_NOISE = 0.5
"""Standard deviation of what is added to each action of the expert; actions reach from -1 to 1."""


def make_dataset(
    task: str,
    kind: Kind,
    out: Path,
    *,
    expert: str = "ppo",
    episodes: int = 300,
    seed: int = 0,
    progress: bool = True,
) -> str:
    """Write a dataset into a folder; return its id, "leanyaw/<task>/<kind>-v<version>".

    Parameters
    ----------
    task : a task's name
    kind : "expert" is a shipped agent, the first of its trainings; "medium" is the same with noise of ``MEDIUM_NOISE`` on every action; "random" draws
        actions evenly; of "mixed", every third episode is one of each
    out : folder of Minari's datasets, ``MINARI_DATASETS_PATH``
    expert : an agent's name
    episodes : 1 to ``MOST_WALKERS``
    seed : of a training; the episodes are of its environment seeds, so that none is a validation's or a test's

    Raises
    ------
    ValueError
        If an argument is bad, the agent is not for the task, or the dataset is there already.
    gymnasium.error.DependencyNotInstalled
        If Minari is not installed.
    """
    require_choice("kind", kind, KINDS)
    require_count("episodes", episodes, 1, MOST_WALKERS)
    env_id, first = env_id_of(task), training_seed(seed)
    agent = make_agent(expert, AgentRequest(env_id, EnvOptions(), runs=None))
    with needs_extra("compat"):
        import minari  # pyright: ignore[reportMissingImports]
    out.mkdir(parents=True, exist_ok=True)
    os.environ["MINARI_DATASETS_PATH"] = str(out.absolute())
    name = f"leanyaw/{task.lower()}/{kind}-v{env_id.rpartition('-v')[2]}"
    recorder = minari.DataCollector(gym.make(env_id), record_infos=False)
    cycle = ("random", "medium", "expert") if kind == "mixed" else (kind,)
    for k in trange(episodes, desc=name, unit="episode", disable=not progress):
        _record(recorder, agent, cycle[k % len(cycle)], first + k)
    recorder.create_dataset(
        dataset_id=name,
        algorithm_name=expert if kind == "expert" else f"{kind} ({expert})",
        description=f"{episodes} episodes of {env_id}, {kind}; environment seeds from {first} on.",
        code_permalink=f"lean-yaw-env {lean_yaw_env.__version__}",
    )
    recorder.close()
    return name


def _record(recorder: Any, agent: Agent, kind: str, seed: int) -> None:
    """Let the recorder see one episode."""
    generator = np.random.default_rng(seed)
    observation, _ = recorder.reset(seed=seed)
    attach(agent, recorder.unwrapped)
    state: State = None
    starts, ends = np.array(True), False
    while not ends:
        if kind == "random":
            action = generator.uniform(-1.0, 1.0, recorder.action_space.shape)
        else:
            action, state = agent.predict(observation, state, starts, True)
        if kind == "medium":
            noise = generator.normal(0.0, MEDIUM_NOISE, np.shape(action))
            action = np.clip(action + noise, -1.0, 1.0)
        action = np.asarray(action, dtype=np.float32)
        observation, _, terminated, truncated, _ = recorder.step(action)
        starts, ends = np.array(False), terminated or truncated

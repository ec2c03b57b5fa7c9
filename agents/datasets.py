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
from lean_yaw_env.files import read_json, require_path, scratch
from lean_yaw_env.validation import require_choice, require_count, require_flag

from .agent import Agent, State, attach
from .registry import AGENTS, AgentRequest, env_id_of, make_agent
from .seeds import MOST_WALKERS, training_seed

Kind = Literal["expert", "medium", "random", "mixed"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_PLACE = "MINARI_DATASETS_PATH"
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
    """Write a dataset into a folder, whole or not at all; return its id, "leanyaw/<task>/<kind>-v<version>". One of the same episodes stays as it is.

    Parameters
    ----------
    task : a task's name
    kind : "expert" is a shipped agent, the first of its trainings; "medium" is the same with noise of ``MEDIUM_NOISE`` on every action; "random" draws
        actions evenly; of "mixed", every third episode is one of each
    out : folder of Minari's datasets, which ``MINARI_DATASETS_PATH`` is set to
    expert : an agent's name
    episodes : 1 to ``MOST_WALKERS``
    seed : of a training; the episodes are of its environment seeds, so that none is a validation's or a test's

    Raises
    ------
    ValueError
        If an argument is bad, the agent is not for the task, or there is something else in the dataset's place.
    gymnasium.error.DependencyNotInstalled
        If Minari is not installed.
    """
    require_choice("kind", kind, KINDS)
    require_choice("expert", expert, AGENTS)
    require_path(out, "out")
    require_flag("progress", progress)
    require_count("episodes", episodes, 1, MOST_WALKERS)
    env_id, first = env_id_of(task), training_seed(seed)
    agent = make_agent(expert, AgentRequest(env_id, EnvOptions(), runs=None))
    with needs_extra("compat"):
        import minari  # pyright: ignore[reportMissingImports]
        from minari import namespace as namespaces  # pyright: ignore[reportMissingImports]
    name = f"leanyaw/{task.lower()}/{kind}-v{env_id.rpartition('-v')[2]}"
    algorithm = expert if kind == "expert" else f"{kind} ({expert})"
    description = (
        f"{episodes} episodes of {env_id}, {algorithm}; environment seeds from {first} on."
    )
    place = out.absolute() / name
    if place.exists():
        if read_json(place / "data" / "metadata.json").get("description") != description:
            raise ValueError(f"{str(place)!r} holds another dataset; remove it or name another folder")  # fmt: skip
        return name
    with scratch(out.absolute()) as folder:
        os.environ[_PLACE] = str(folder)
        recorder = minari.DataCollector(gym.make(env_id), record_infos=False)
        cycle = ("random", "medium", "expert") if kind == "mixed" else (kind,)
        for k in trange(episodes, desc=name, unit="episode", disable=not progress):
            _record(recorder, agent, cycle[k % len(cycle)], first + k)
        recorder.create_dataset(
            dataset_id=name,
            algorithm_name=algorithm,
            description=description,
            code_permalink=f"lean-yaw-env {lean_yaw_env.__version__}",
        )
        recorder.close()
        os.environ[_PLACE] = str(out.absolute())
        namespace = name.rpartition("/")[0]
        if namespace not in namespaces.list_local_namespaces():
            namespaces.create_namespace(namespace)
        (folder / name).rename(place)
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

"""Agents by name, made for a task: the one place where a new one is registered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from agents.agent import Agent
from agents.controllers.guidance import guided
from agents.controllers.heading_feedback import HeadingFeedback
from agents.controllers.simple import FixedController, RandomController
from agents.files import read_json
from agents.policies.storage import CARD_FILE, DEFAULT_ALGORITHM, load, task_of
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import ENV_IDS


@dataclass(frozen=True)
class AgentRequest:
    """What an agent is made for.

    Attributes
    ----------
    env_id : an environment's id
    options : the environment's
    seed : for agents that draw
    path : folder of a trained policy, for agents that are trained; the newest under ``runs``, or the package's own, otherwise
    runs : where trainings leave their folders
    """

    env_id: str
    options: EnvOptions
    seed: int = 0
    path: Path | None = None
    runs: Path = Path("runs")


def _feedback(request: AgentRequest) -> Agent:
    return HeadingFeedback(task_of(request.env_id), request.options)


def _trained(algorithm: str) -> Callable[[AgentRequest], Agent]:
    """Makes an algorithm's trained policy: of the folder asked for, the newest run or the package."""

    def made(request: AgentRequest) -> Agent:
        folder = request.path or newest_policy(request.env_id, request.runs, algorithm)
        source = request.env_id if folder is None else folder
        return load(source, env_id=request.env_id, algorithm=algorithm)

    return made


AGENTS: dict[str, Callable[[AgentRequest], Agent]] = {
    "random": lambda request: RandomController(request.seed),
    "fixed": lambda request: FixedController(),
    "feedback": _feedback,
    "ppo": _trained("ppo"),
    "lqr": lambda request: guided(task_of(request.env_id), request.options),
}
"""Every agent, in the order of tables."""


def make_agent(name: str, request: AgentRequest) -> Agent:
    """Make an agent.

    Raises
    ------
    ValueError
        If there is no such agent, or it is not one for this task.
    PolicyFileError
        If a trained one is not found or cannot be loaded.
    """
    if name not in AGENTS:
        raise ValueError(f"agents must be among {', '.join(AGENTS)}, not {name!r}")
    return AGENTS[name](request)


def make_all(request: AgentRequest) -> dict[str, Agent]:
    """Every agent that there is for this task; those that need a training which is not found are left out."""
    agents: dict[str, Agent] = {}
    for name in AGENTS:
        try:
            agents[name] = make_agent(name, request)
        except ValueError:
            continue
    return agents


def env_id_of(task: str) -> str:
    """The environment's id for a task's name, or ``ValueError``."""
    for env_id in ENV_IDS:
        if task_of(env_id) == task:
            return env_id
    names = ", ".join(task_of(env_id) for env_id in ENV_IDS)
    raise ValueError(f"task must be one of {names}, not {task!r}")


def newest_policy(env_id: str, runs: Path, algorithm: str = DEFAULT_ALGORITHM) -> Path | None:
    """The folder of an algorithm's policy for an environment that was written last under ``runs``, if there is any."""
    found: list[tuple[float, Path]] = []
    for card in runs.glob(f"*/{CARD_FILE}"):
        try:
            values = read_json(card)
        except ValueError:
            continue
        wanted = {"env_id": env_id, "algorithm": algorithm}
        if isinstance(values, dict) and {key: values.get(key) for key in wanted} == wanted:
            found.append((card.stat().st_mtime, card.parent))
    return max(found)[1] if found else None

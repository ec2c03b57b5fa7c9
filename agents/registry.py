"""Agents by name, made for a task: the one place where a new one is registered."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.files import read_json, require_path
from lean_yaw_env.registration import ALL_ENV_IDS, ALL_TASKS, GOAL_TASK, TASK_VERSIONS
from lean_yaw_env.rendering.palette import AGENT_COLOURS, INK, unit_colour
from lean_yaw_env.validation import (
    LARGEST_SEED,
    require_choice,
    require_count,
    require_instance,
    require_text,
)

from .agent import Agent
from .controllers.guidance import guided
from .controllers.linear import LinearLaw
from .controllers.mpc import MpcController
from .controllers.simple import FixedController, HeadingFeedback, RandomController
from .observations import ObservationLayout
from .policies.policy_files import (
    CARD_FILE,
    DEFAULT_ALGORITHM,
    load,
    shipped_folder,
    shipped_seeds,
    task_of,
)
from .settings import all_settings

Kind = Literal["baseline", "feedback", "planner", "learned"]
"""How an agent chooses: blindly, by feedback from its observation, by a search on the walker itself at every step, or as it was trained."""
KINDS: tuple[Kind, ...] = get_args(Kind)
QUICK_KINDS: tuple[Kind, ...] = ("baseline", "feedback", "learned")
"""Kinds that take next to no time to act."""


@dataclass(frozen=True)
class AgentRequest:
    """What an agent is made for: an environment's id and options, a seed for agents that draw, and where trained policies are.

    A trained policy is the one in the folder ``path``; without it the newest under ``runs``; without that the package's own.
    """

    env_id: str
    options: EnvOptions
    seed: int = 0
    path: Path | None = None
    runs: Path | None = Path("runs")

    def __post_init__(self) -> None:
        require_text("env_id", self.env_id)
        require_instance("options", self.options, EnvOptions)
        require_count("seed", self.seed, 0, LARGEST_SEED)
        for name in ("path", "runs"):
            if getattr(self, name) is not None:
                require_path(getattr(self, name), name)

    @property
    def task(self) -> str:
        return task_of(self.env_id)

    @property
    def layout(self) -> ObservationLayout:
        """What the environment's observations hold."""
        return ObservationLayout.of(self.task, self.options)


@dataclass(frozen=True)
class AgentEntry:
    """An agent of the registry: its kind, what makes it for a request, the names of the tasks that it is for, and options that it needs.

    These options hold in the place of the environment's: an oracle walks in an environment that shows what others must find out.
    """

    kind: Kind
    make: Callable[[AgentRequest], Agent]
    tasks: tuple[str, ...] = ALL_TASKS
    options: Mapping[str, Any] = field(default_factory=dict)

    def needed_options(self, options: EnvOptions) -> EnvOptions:
        """Options of the environment with those that the agent needs."""
        return replace(options, **self.options)


def _lqr(request: AgentRequest) -> Agent:
    # the same observations, and the settings tuned for more than one goal
    return guided("Waypoint" if request.task == GOAL_TASK else request.task, request.options)


def _mpc(request: AgentRequest) -> Agent:
    base = make_base(request)[1]
    return MpcController(request.task, request.options, base, seed=request.seed)


def make_base(request: AgentRequest) -> tuple[str, Agent]:
    """The agent that planners deviate from, with its name: the package's PPO; without one for these observations the regulator, or without a gait the
    fixed controller."""
    for seed in shipped_seeds(request.env_id, "ppo")[:1]:
        policy = load(shipped_folder(request.env_id, "ppo", seed), env_id=request.env_id)
        if policy.card.layout == request.layout:
            return "ppo", policy
    try:
        return "lqr", guided(request.task, request.options)
    except NoGaitError:
        return "fixed", FixedController()


def _trained(algorithm: str) -> Callable[[AgentRequest], Agent]:
    """Makes an algorithm's trained policy: of the folder asked for, the newest run or the package."""

    def made(request: AgentRequest) -> Agent:
        folders = policy_folders(algorithm, request)
        source = folders[0] if folders else request.env_id  # whose absence is explained there
        return load(source, env_id=request.env_id, algorithm=algorithm)

    return made


_STEERED = ("Heading", "SpeedHeading", "UTurn", "Level", "Energy", "UnknownBody", "Hills")
"""Tasks that command a heading."""

_REGULATED = tuple(task for task in ALL_TASKS if task not in ("LevelUphill", "Energy"))
"""Tasks that the regulator is for. Without a slope it needs settings of pumping, which are found for Level alone."""

LINEAR_TASKS = tuple(all_settings().get("linear", {}))
"""Tasks for which a linear law was found."""

AGENTS: dict[str, AgentEntry] = {
    "random": AgentEntry("baseline", lambda asked: RandomController(asked.seed, asked.layout)),
    "fixed": AgentEntry("baseline", lambda asked: FixedController(asked.layout)),
    "feedback": AgentEntry(
        "feedback", lambda asked: HeadingFeedback(asked.task, asked.options), _STEERED
    ),
    "lqr": AgentEntry("feedback", _lqr, _REGULATED),
    "linear": AgentEntry(
        "feedback", lambda asked: LinearLaw(asked.task, asked.options), LINEAR_TASKS
    ),
    "mpc": AgentEntry("planner", _mpc, tuple(TASK_VERSIONS)),
    "ppo": AgentEntry("learned", _trained("ppo")),
    "sac": AgentEntry("learned", _trained("sac")),
    "apg": AgentEntry("learned", _trained("apg")),
    "tqc": AgentEntry("learned", _trained("tqc")),
    "frames": AgentEntry("learned", _trained("frames")),
    "recurrent": AgentEntry("learned", _trained("recurrent")),
    "oracle": AgentEntry("learned", _trained("oracle"), ("UnknownBody",), {"show_body": True}),
    "her": AgentEntry("learned", _trained("her"), (GOAL_TASK,)),
}
"""Every agent, in the order of tables; a learned one has the name of its algorithm."""


def agent_entry(name: str) -> AgentEntry:
    """The entry of that name, or ``ValueError`` naming those there are."""
    return AGENTS[require_choice("agent", name, AGENTS)]


def agent_colour(name: str) -> tuple[float, float, float]:
    """An agent's colour in parts of one, the same in every picture; that of ink for one that has none."""
    return unit_colour(AGENT_COLOURS.get(name, INK))


def make_agent(name: str, request: AgentRequest) -> Agent:
    """Make an agent by its name.

    Raises
    ------
    ValueError
        If there is no such agent, or it is not one for this task.
    PolicyFileError
        If a trained one is not found or cannot be loaded.
    NoGaitError
        If it needs a gait that the walker of these options does not have.
    """
    entry = agent_entry(name)
    if require_instance("request", request, AgentRequest).task not in entry.tasks:
        raise ValueError(f"{name} is an agent for {', '.join(entry.tasks)}, got {request.task!r}")
    return entry.make(request)


def names_for(request: AgentRequest, kinds: Collection[Kind] = KINDS) -> tuple[str, ...]:
    """Names of the agents of some kinds that are for this task; of the learned, those that a training is found of."""
    return tuple(
        name
        for name, entry in AGENTS.items()
        if entry.kind in kinds
        and request.task in entry.tasks
        and (entry.kind != "learned" or policy_folders(name, request))
    )


def make_all(request: AgentRequest, kinds: Collection[Kind] = QUICK_KINDS) -> dict[str, Agent]:
    """Every agent of some kinds that there is for this task, as ``names_for``, but for those that need a gait the walker does not have."""
    agents: dict[str, Agent] = {}
    for name in names_for(request, kinds):
        with suppress(NoGaitError):
            agents[name] = make_agent(name, request)
    return agents


def policy_folders(algorithm: str, request: AgentRequest) -> list[Path]:
    """Where the trained policies asked for are: one folder, or of the package's own all, one for each seed; none if there is none."""
    if request.path is not None:
        return [request.path]
    if request.runs is not None:
        newest = newest_policy(request.env_id, request.runs, algorithm)
        if newest is not None:
            return [newest]
    return [
        shipped_folder(request.env_id, algorithm, seed)
        for seed in shipped_seeds(request.env_id, algorithm)
    ]


def env_id_of(task: str) -> str:
    """The environment's id for a task's name, or ``ValueError``."""
    require_choice("task", task, ALL_TASKS)
    return next(env_id for env_id in ALL_ENV_IDS if task_of(env_id) == task)


def newest_policy(env_id: str, runs: Path, algorithm: str = DEFAULT_ALGORITHM) -> Path | None:
    """The folder of an algorithm's policy for an environment that was written last under ``runs``, if there is any."""
    found: list[tuple[float, Path]] = []
    # a run's folder, or that of one seed of a series; what else is below, as evaluations, is not searched
    for card in (*runs.glob(f"*/{CARD_FILE}"), *runs.glob(f"*/seed*/{CARD_FILE}")):
        try:
            values = read_json(card)
        except ValueError:
            continue
        wanted = {"env_id": env_id, "algorithm": algorithm}
        if isinstance(values, dict) and {key: values.get(key) for key in wanted} == wanted:
            found.append((card.stat().st_mtime, card.parent))
    return max(found)[1] if found else None

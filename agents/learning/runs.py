"""A training from settings to a folder of results: train, judge beside the baselines, draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from tqdm import tqdm

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json, write_json
from lean_yaw_env.validation import require_count

from ..agent import Agent
from ..evaluation.episodes import Row
from ..evaluation.pictures import save_agents_footprints
from ..evaluation.row_tables import rows_to_plain
from ..evaluation.scoring import evaluate
from ..policies.policy import Policy, package_versions
from ..policies.policy_files import CARD_FILE, options_from_plain, options_to_plain, save, task_of
from ..registry import AgentRequest, env_id_of, make_all
from ..seeds import MOST_EPISODES, evaluation_seed, training_seed
from .algorithms import settings_for, settings_from_plain, train
from .curves import save_learning_curve
from .learner import LearnerSettings, settings_to_plain
from .recorder import Report, TrainingLog

RUN_FILE = "run.json"
CHECKPOINT_FILE = "checkpoint.safetensors"
LOG_FILE = "episodes.csv"
CURVE_FILE = "learning_curve.png"
FOOTPRINTS_FILE = "footprints.png"
EVALUATION_FILE = "evaluation.json"
STATISTICS_FILE = "observation_statistics.json"
EVALUATION = 0
"""Seed of the episodes that runs are judged on: the same for all of them, so that what differs is the training."""


@dataclass(frozen=True)
class Training:
    """What to train, and everything that decides how; kept in the run's folder, so that it can be gone on with.

    Attributes
    ----------
    env_id : an environment's id
    seed : of the policy's start, the walkers and all that is drawn
    settings : the algorithm's
    options : the environment's
    episodes : of the evaluation
    threads : of torch and of the walkers
    checkpoint_seconds : least time between two checkpoints
    tensorboard : write TensorBoard's logs too
    algorithm : a name in ``ALGORITHMS``
    """

    env_id: str
    seed: int
    settings: LearnerSettings
    options: EnvOptions
    episodes: int = 1000
    threads: int = 1
    checkpoint_seconds: float = 5.0
    tensorboard: bool = False
    algorithm: str = "ppo"

    @classmethod
    def of_task(
        cls, task: str, *, seed: int = 0, steps: int | None = None, **others: Any
    ) -> Training:
        """The training that is tuned for a task, with another number of steps if one is given.

        Raises
        ------
        ValueError
            If a name or number is bad.
        """
        env_id = env_id_of(task)
        training_seed(seed)
        require_count("episodes", others.get("episodes", cls.episodes), 1, MOST_EPISODES)
        require_count("threads", others.get("threads", cls.threads), 1, 1024)
        settings = settings_for(others.get("algorithm", cls.algorithm), task)
        if steps is not None:
            settings = replace(settings, steps=steps)
        return cls(env_id, seed, settings, EnvOptions(), **others)

    @property
    def task(self) -> str:
        return task_of(self.env_id)


@dataclass(frozen=True)
class FinishedRun:
    """What a training left behind."""

    folder: Path
    policy: Policy
    rows: list[Row]


def new_folder(out: Path, training: Training, ending: str) -> Path:
    """The path of a folder that is not there yet, named by task, algorithm, time and ``ending``."""
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    name = f"{training.task}-{training.algorithm}-{stamp}-{ending}"
    folder, number = out / name, 1
    while folder.exists():
        number += 1
        folder = out / f"{name}-{number}"
    return folder


def new_run(training: Training, out: Path) -> Path:
    """Make the folder of a new run under ``out``, and note in it what is trained."""
    folder = new_folder(out, training, f"seed{training.seed}")
    make_run(training, folder)
    return folder


def make_run(training: Training, folder: Path) -> None:
    """Make a run's folder, which must not be there, and note in it what is trained."""
    folder.mkdir(parents=True)
    record = asdict(training) | {
        "settings": settings_to_plain(training.settings),
        "options": options_to_plain(training.options),
        "versions": package_versions(),
        "walkers_seed": training_seed(training.seed),
        "evaluation_seed": evaluation_seed(EVALUATION),
    }
    write_json(folder / RUN_FILE, record)


def is_finished(folder: Path) -> bool:
    """Whether a run has been trained and judged."""
    return (folder / EVALUATION_FILE).exists() and (folder / CARD_FILE).exists()


def read_run(folder: Path) -> Training:
    """What a run's folder says is trained in it, or ``ValueError``."""
    record = read_json(folder / RUN_FILE)
    names = set(Training.__dataclass_fields__)
    try:
        values = {key: value for key, value in record.items() if key in names}
        values["settings"] = settings_from_plain(
            values.get("algorithm", Training.algorithm), values["settings"]
        )
        values["options"] = options_from_plain(values["options"])
        return Training(**values)
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"{str(folder / RUN_FILE)!r} is not a run's: {error}") from error


def read_log(folder: Path) -> TrainingLog:
    """The episodes of a finished run, or ``ValueError``."""
    seconds = float(read_json(folder / CARD_FILE)["training"]["seconds"])
    return TrainingLog.read(folder / LOG_FILE, seconds)


def run(folder: Path, *, progress: bool = True, report: Report | None = None) -> FinishedRun:
    """Train what a run's folder says, or go on with it, and leave there all that comes of it.

    Parameters
    ----------
    folder : that ``new_run`` made
    progress : show bars
    report : told of the steps done and the latest returns, between updates

    Raises
    ------
    ValueError
        If the folder's files are damaged.
    """
    training = read_run(folder)
    trained = train(
        training.algorithm,
        training.env_id,
        training.settings,
        seed=training.seed,
        options=training.options,
        checkpoint=folder / CHECKPOINT_FILE,
        checkpoint_seconds=training.checkpoint_seconds,
        threads=training.threads,
        progress=progress,
        report=report,
        tensorboard=folder / "tensorboard" if training.tensorboard else None,
    )
    save(trained.policy, folder)
    _write_statistics(folder, trained.policy)
    trained.log.write(folder / LOG_FILE)
    agents = _judged_agents(training, trained.policy)
    rows = _judge(training, agents, progress)
    _draw(folder, training, agents, trained.log, rows)
    write_json(folder / EVALUATION_FILE, rows_to_plain(rows))  # last: it marks the run as finished
    return FinishedRun(folder, trained.policy, rows)


def _judged_agents(training: Training, policy: Policy) -> dict[str, Agent]:
    """The trained policy beside the quick agents that need no training and know the task."""
    request = AgentRequest(training.env_id, training.options, seed=training.seed)
    return make_all(request, ("baseline", "feedback")) | {policy.card.algorithm: policy}


def _judge(training: Training, agents: Mapping[str, Agent], progress: bool) -> list[Row]:
    total = training.episodes * len(agents)
    with tqdm(total=total, desc="evaluating", unit="episode", disable=not progress) as bar:
        return evaluate(
            training.task,
            agents,
            episodes=training.episodes,
            seed=EVALUATION,
            options=training.options,
            progress=bar.update,
        )


def _draw(
    folder: Path,
    training: Training,
    agents: Mapping[str, Agent],
    log: TrainingLog,
    rows: list[Row],
) -> None:
    steps = training.settings.steps
    title = f"{training.algorithm.upper()} on {training.task}, seed {training.seed}: {steps:,} steps in {log.seconds:.0f} s"
    save_learning_curve(log, rows, training.algorithm, title, steps, folder / CURVE_FILE)
    save_agents_footprints(
        agents, training.task, folder / FOOTPRINTS_FILE,
        seed=evaluation_seed(EVALUATION), options=training.options,
    )  # fmt: skip


def _write_statistics(folder: Path, policy: Policy) -> None:
    """The statistics that the policy normalises observations by, for people; the policy's own file has them too."""
    mean, variance = policy.weights["observation_mean"], policy.weights["observation_variance"]
    write_json(
        folder / STATISTICS_FILE,
        {
            name: {"mean": float(m), "variance": float(v)}
            for name, m, v in zip(policy.card.layout.names, mean, variance, strict=True)
        },
    )

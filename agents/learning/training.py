"""A training from settings to a folder of results: train, judge beside the baselines, draw."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from agents.agent import Agent
from agents.evaluation.pictures import save_agents_footprints, save_learning_curve
from agents.evaluation.reporting import progress_bar
from agents.evaluation.scoring import Row, evaluate
from agents.evaluation.tables import rows_to_plain
from agents.files import read_json, write_json
from agents.learning.algorithms import (
    Settings,
    algorithm_named,
    settings_from_plain,
    settings_to_plain,
)
from agents.learning.results import Report, TrainingLog
from agents.policies.policy import Policy
from agents.policies.storage import CARD_FILE, options_from_plain, options_to_plain, save, task_of
from agents.registry import AgentRequest, env_id_of, make_all
from agents.seeds import MOST_EPISODES, evaluation_seed, training_seed
from agents.versions import package_versions
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import written_whole
from lean_yaw_env.parameters import require_number

RUN_FILE = "run.json"
CHECKPOINT_FILE = "checkpoint.safetensors"
LOG_FILE = "episodes.csv"
CURVE_FILE = "learning_curve.png"
FOOTPRINTS_FILE = "footprints.png"
EVALUATION_FILE = "evaluation.json"
_LOG_COLUMNS = ("steps", "return", "length", "survived")
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
    settings: Settings
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
        require_number("episodes", others.get("episodes", cls.episodes), 1, MOST_EPISODES)
        require_number("threads", others.get("threads", cls.threads), 1, 1024)
        settings = algorithm_named(others.get("algorithm", cls.algorithm)).settings_for(env_id)
        if steps is not None:
            settings = replace(settings, steps=steps)
        return cls(env_id, seed, settings, EnvOptions(), **others)


@dataclass(frozen=True)
class Result:
    """What a training left behind."""

    folder: Path
    policy: Policy
    rows: list[Row]


def new_run(training: Training, out: Path) -> Path:
    """Make the folder of a new run under ``out``, named by task, algorithm, time and seed, and note in it what is trained."""
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    name = f"{task_of(training.env_id)}-{training.algorithm}-{stamp}-seed{training.seed}"
    folder = out / name
    number = 1
    while folder.exists():
        number += 1
        folder = out / f"{name}-{number}"
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


def started_run(
    task: str, out: Path, folder: Path | None = None, choices: Mapping[str, Any] | None = None
) -> Path:
    """The folder of a new run with the task's settings and these choices, arguments of ``Training.of_task``.

    Raises
    ------
    ValueError
        If a choice is bad, or a folder is given: that is for runs to resume.
    """
    if folder is not None:
        raise ValueError(f"run must not be given without --resume, but is {str(folder)!r}")
    return new_run(Training.of_task(task, **(choices or {})), out)


def resumed_run(
    task: str, out: Path, folder: Path | None = None, choices: Mapping[str, Any] | None = None
) -> Path:
    """The folder of a run to go on with: the one given, or the newest unfinished one.

    Raises
    ------
    ValueError
        If there is none, it is finished, or there are choices: a run keeps its own.
    """
    if choices:
        names = ", ".join(choices)
        raise ValueError(f"a resumed run keeps its own settings; leave out {names}")
    if folder is None:
        return unfinished_run(task, out)
    read_run(folder)
    if is_finished(folder):
        raise ValueError(f"the run in {str(folder)!r} is finished")
    return folder


def unfinished_run(task: str, out: Path) -> Path:
    """The newest run of a task under ``out`` that is not finished, or ``ValueError`` if there is none."""
    found = unfinished_runs(task, out)
    if not found:
        raise ValueError(
            f"there is no unfinished training of {task} under {str(out)!r}; start one without --resume"
        )
    return max(found, key=lambda folder: (folder / RUN_FILE).stat().st_mtime)


def unfinished_runs(task: str, out: Path) -> list[Path]:
    """The runs of a task under ``out`` that are not finished."""
    env_id = env_id_of(task)
    return [
        path.parent
        for path in out.glob(f"*/{RUN_FILE}")
        if read_json(path).get("env_id") == env_id and not is_finished(path.parent)
    ]


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


def run(folder: Path, *, progress: bool = True, report: Report | None = None) -> Result:
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
    trained = algorithm_named(training.algorithm).train(
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
    _write_log(folder, trained.log)
    agents = _judged_agents(training, trained.policy)
    rows = _judge(training, agents, progress)
    _draw(folder, training, agents, trained.log, rows)
    write_json(folder / EVALUATION_FILE, rows_to_plain(rows))  # last: it marks the run as finished
    return Result(folder, trained.policy, rows)


def _judged_agents(training: Training, policy: Policy) -> dict[str, Agent]:
    """The trained policy beside the quick agents that need no training and know the task."""
    request = AgentRequest(training.env_id, training.options, seed=training.seed)
    return make_all(request, ("baseline", "feedback")) | {policy.card.algorithm: policy}


def _judge(training: Training, agents: Mapping[str, Agent], progress: bool) -> list[Row]:
    with progress_bar(training.episodes * len(agents), progress) as bar:
        return evaluate(
            task_of(training.env_id),
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
    task = task_of(training.env_id)
    title = f"{training.algorithm.upper()} on {task}, seed {training.seed}: {training.settings.steps:,} steps in {log.seconds:.0f} s"
    save_learning_curve(log, rows, title, training.settings.steps, folder / CURVE_FILE)
    save_agents_footprints(
        agents, task, folder / FOOTPRINTS_FILE,
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


def read_log(folder: Path) -> TrainingLog:
    """The episodes of a finished run, or ``ValueError``."""
    path = folder / LOG_FILE
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header, *lines = csv.reader(file)
        if tuple(header) != _LOG_COLUMNS:
            raise ValueError(f"its columns must be {', '.join(_LOG_COLUMNS)}")
        columns = list(zip(*lines, strict=True)) if lines else [()] * len(_LOG_COLUMNS)
        steps, returns, lengths, survived = (np.array(column, dtype=float) for column in columns)
        seconds = float(read_json(folder / CARD_FILE)["training"]["seconds"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"no episodes can be read from {str(path)!r}: {error}") from error
    counts = (steps.astype(np.int64), returns, lengths.astype(np.int64), survived > 0.0)
    return TrainingLog(*counts, seconds)


def _write_log(folder: Path, log: TrainingLog) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_LOG_COLUMNS)
    writer.writerows(
        zip(
            log.steps.tolist(),
            log.returns.tolist(),
            log.lengths.tolist(),
            log.survived.astype(int).tolist(),
            strict=True,
        )
    )
    with written_whole(folder / LOG_FILE) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")

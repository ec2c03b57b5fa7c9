"""A training from settings to a folder of results: train, evaluate beside the baselines, draw."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import locked, read_json, write_json
from lean_yaw_env.registration import ALL_ENV_IDS
from lean_yaw_env.validation import require_choice, require_count, require_flag, require_number

from ..evaluation.episodes import Row
from ..evaluation.pictures import save_agents_footprints
from ..evaluation.row_tables import rows_to_plain
from ..evaluation.scoring import evaluate
from ..policies.policy import Policy, package_versions
from ..policies.policy_files import (
    CARD_FILE,
    load,
    options_from_plain,
    options_to_plain,
    save,
    task_of,
)
from ..registry import AgentRequest, agent_entry, env_id_of, make_all
from ..seeds import MOST_EPISODES, first_seed, training_seed
from ..settings import with_values
from .algorithms import ALGORITHMS, algorithm_for, settings_for, train
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


@dataclass(frozen=True)
class Training:
    """What to train, and everything that decides how; kept in the run's folder, so that it can be resumed.

    Attributes
    ----------
    env_id : an environment's id
    seed : of the policy's initial weights, the walkers and everything that is drawn
    settings : the algorithm's
    options : the environment's
    episodes : of the evaluation
    threads : of torch and of the walkers
    checkpoint_seconds : least time between two checkpoints
    tensorboard : write TensorBoard's logs too
    algorithm : a name in ``ALGORITHMS``
    is_compared : evaluate and draw the baselines and feedback controllers too
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
    is_compared: bool = True

    def __post_init__(self) -> None:
        training_seed(self.seed)
        require_choice("env_id", self.env_id, ALL_ENV_IDS)
        entry = algorithm_for(self.algorithm, self.task)
        if type(self.settings) is not entry.settings:
            raise ValueError(f"settings must be {entry.settings.__name__}, got {self.settings!r}")
        require_count("episodes", self.episodes, 1, MOST_EPISODES)
        require_count("threads", self.threads, 1, 1024)
        require_number("checkpoint_seconds", self.checkpoint_seconds, 0.0, math.inf)
        for name in ("tensorboard", "is_compared"):
            require_flag(name, getattr(self, name))

    @classmethod
    def of_task(
        cls,
        task: str,
        *,
        seed: int = 0,
        steps: int | None = None,
        options: EnvOptions | None = None,
        **others: Any,
    ) -> Training:
        """The training with the package's settings for a task, with another number of steps and other options if they are given.

        Raises
        ------
        ValueError
            If a name or number is bad.
        """
        env_id = env_id_of(task)
        settings = settings_for(others.get("algorithm", cls.algorithm), task)
        if steps is not None:
            settings = replace(settings, steps=steps)
        agent = agent_entry(others.get("algorithm", cls.algorithm))
        needed = agent.needed_options(options or EnvOptions())
        return cls(env_id, seed, settings, needed, **others)

    @property
    def task(self) -> str:
        return task_of(self.env_id)


class FinishedRun(NamedTuple):
    """The results of a training: the policy and the rows of its evaluation."""

    policy: Policy
    rows: list[Row]


def new_folder(out: Path, training: Training, ending: str) -> Path:
    """The path of a folder that does not exist yet, named by task, algorithm, time and ``ending``."""
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    name = f"{training.task}-{training.algorithm}-{stamp}-{ending}"
    folder, number = out / name, 1
    while folder.exists():
        number += 1
        folder = out / f"{name}-{number}"
    return folder


def new_run(training: Training, out: Path) -> Path:
    """Make the folder of a new run under ``out``, and write into it what is trained."""
    folder = new_folder(out, training, f"seed{training.seed}")
    make_run(training, folder)
    return folder


def make_run(training: Training, folder: Path) -> None:
    """Make a run's folder, which must not exist, and write into it what is trained."""
    folder.mkdir(parents=True)
    record = asdict(training) | {
        "settings": settings_to_plain(training.settings),
        "options": options_to_plain(training.options),
        "versions": package_versions(),
        "walkers_seed": training_seed(training.seed),
        "evaluation_seed": first_seed("validation"),
    }
    write_json(folder / RUN_FILE, record)


def is_finished(folder: Path) -> bool:
    """Whether a run has been trained and evaluated."""
    return (folder / EVALUATION_FILE).exists() and (folder / CARD_FILE).exists()


def read_run(folder: Path) -> Training:
    """The training that a run's folder holds, or ``ValueError``."""
    record = read_json(folder / RUN_FILE)
    try:
        values = {key: record[key] for key in Training.__dataclass_fields__}
        settings = ALGORITHMS[values["algorithm"]].settings()
        if set(values["settings"]) != set(vars(settings)):
            raise ValueError(f"its settings must hold {', '.join(vars(settings))}")
        values["settings"] = with_values(settings, values["settings"])
        values["options"] = options_from_plain(values["options"])
        training = Training(**values)
        seeds = (training_seed(training.seed), first_seed("validation"))
        if (record["walkers_seed"], record["evaluation_seed"]) != seeds:
            raise ValueError(f"its seeds of walkers and evaluation must be {seeds}")
        return training
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{str(folder / RUN_FILE)!r} is not a run's: {error}") from error


def read_log(folder: Path) -> TrainingLog:
    """The episodes of a finished run, or ``ValueError``."""
    return TrainingLog.read(folder / LOG_FILE, float(load(folder).card.training["seconds"]))


def run(folder: Path, *, progress: bool = True, report: Report | None = None) -> FinishedRun:
    """Train what a run's folder holds, from its checkpoint on if there is one, and write all results into the folder.

    Parameters
    ----------
    folder : that ``new_run`` made
    progress : show bars
    report : called between updates

    Raises
    ------
    ValueError
        If the folder's files are damaged.
    BusyError
        If another process is at work in the folder.
    """
    with locked(folder):
        return _run(folder, read_run(folder), progress, report)


def _run(folder: Path, training: Training, progress: bool, report: Report | None) -> FinishedRun:
    task, steps = training.task, training.settings.steps
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
    policy, log = trained.policy, trained.log
    save(policy, folder)
    _write_statistics(folder, policy)
    log.write(folder / LOG_FILE)
    request = AgentRequest(training.env_id, training.options, seed=training.seed)
    others = make_all(request, ("baseline", "feedback")) if training.is_compared else {}
    agents = others | {training.algorithm: policy}
    total = training.episodes * len(agents)
    with tqdm(total=total, desc="evaluating", unit="episode", disable=not progress) as bar:
        rows = evaluate(
            task, agents,
            episodes=training.episodes, options=training.options, progress=bar.update,
        )  # fmt: skip
    title = f"{training.algorithm.upper()} on {task}, seed {training.seed}: {steps:,} steps in {log.seconds:.0f} s"
    save_learning_curve(log, rows, training.algorithm, title, steps, folder / CURVE_FILE)
    walked = {name: (agent, training.options) for name, agent in agents.items()}
    save_agents_footprints(walked, task, folder / FOOTPRINTS_FILE, seed=first_seed("validation"))
    write_json(folder / EVALUATION_FILE, rows_to_plain(rows))  # last: it marks the run as finished
    return FinishedRun(policy, rows)


def _write_statistics(folder: Path, policy: Policy) -> None:
    """The statistics that normalise observations, for people; the policy's own file has them too."""
    size = len(policy.card.layout.names)  # of the latest frame, where a policy sees several
    mean, variance = (
        policy.weights[f"observation_{name}"][-size:] for name in ("mean", "variance")
    )
    record = {
        name: {"mean": float(m), "variance": float(v)}
        for name, m, v in zip(policy.card.layout.names, mean, variance, strict=True)
    }
    write_json(folder / STATISTICS_FILE, record)

"""The learning algorithms by name: the one place where a new one is registered, and the call that trains any of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import ALL_TASKS, GOAL_TASK, TASK_VERSIONS
from lean_yaw_env.validation import require_choice

from ..observations import ObservationLayout
from ..policies.policy import Policy, PolicyCard, package_versions
from ..policies.policy_files import task_of
from ..settings import tuned
from .apg import GradientLearner, GradientSettings
from .her import HERLearner, HERSettings
from .learner import Learner, LearnerSettings, settings_to_plain
from .ppo import FramesSettings, PPOLearner, PPOSettings
from .recorder import CheckpointError, Recorder, Report, TrainingLog
from .recurrent import RecurrentLearner, RecurrentSettings
from .sac import SACLearner, SACSettings
from .tqc import TQCLearner, TQCSettings


@dataclass(frozen=True)
class Trained:
    """What a training gives."""

    policy: Policy
    log: TrainingLog


@dataclass(frozen=True)
class Algorithm:
    """A learning algorithm.

    Attributes
    ----------
    settings : the class of its settings, a ``LearnerSettings``
    make : its learner's class
    tasks : that it can learn
    shipped : tasks whose trained agents come with the package
    seeds : number of these for each task
    """

    settings: type[Any]
    make: Callable[..., Learner]
    tasks: tuple[str, ...] = ALL_TASKS
    shipped: tuple[str, ...] = ()
    seeds: int = 5


_TASKS = tuple(TASK_VERSIONS)
_UNKNOWN = ("UnknownBody",)
ALGORITHMS: dict[str, Algorithm] = {
    "ppo": Algorithm(PPOSettings, PPOLearner, shipped=_TASKS, seeds=10),
    "sac": Algorithm(SACSettings, SACLearner, shipped=("Metastable",)),
    "apg": Algorithm(
        GradientSettings, GradientLearner, _TASKS, shipped=("Heading", "SpeedHeading", "Slalom")
    ),
    "tqc": Algorithm(TQCSettings, TQCLearner),
    "frames": Algorithm(FramesSettings, PPOLearner, shipped=_UNKNOWN),
    "recurrent": Algorithm(RecurrentSettings, RecurrentLearner, shipped=_UNKNOWN),
    "oracle": Algorithm(PPOSettings, PPOLearner, _UNKNOWN, shipped=_UNKNOWN),
    "her": Algorithm(HERSettings, HERLearner, (GOAL_TASK,), shipped=(GOAL_TASK,), seeds=1),
}
"""By the names that their policies carry."""


def algorithm_for(name: str, task: str) -> Algorithm:
    """The algorithm of that name, or ``ValueError`` if there is none or it cannot learn the task."""
    entry = ALGORITHMS[require_choice("algorithm", name, ALGORITHMS)]
    require_choice(f"task of {name}", task, entry.tasks)
    return entry


def settings_for(algorithm: str, task: str) -> Any:
    """An algorithm's settings for a task: those that come with the package, or the default ones.

    Raises
    ------
    ValueError
        For an algorithm or a task there is not, or a task that the algorithm cannot learn.
    """
    return tuned(algorithm, task, algorithm_for(algorithm, task).settings())


def train(
    algorithm: str,
    env_id: str,
    settings: LearnerSettings,
    *,
    seed: int = 0,
    options: EnvOptions | None = None,
    checkpoint: Path | None = None,
    checkpoint_seconds: float = 5.0,
    threads: int = 1,
    progress: bool = True,
    report: Report | None = None,
    tensorboard: Path | None = None,
) -> Trained:
    """Train a policy, from the checkpoint on if its file is there.

    A training that was interrupted and is resumed with the same arguments returns what it would have returned uninterrupted, bit for bit.

    Parameters
    ----------
    algorithm : a name in ``ALGORITHMS``
    env_id, settings, seed, options : what to train
    checkpoint : file for the training's state, written every ``checkpoint_seconds`` or less often; None for none
    threads : of torch and of the walkers
    progress : show a bar
    report : called between updates
    tensorboard : folder for TensorBoard's logs; None for none

    Raises
    ------
    ValueError
        If a number is out of its range, or the algorithm cannot learn the task under these options.
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    chosen = EnvOptions() if options is None else options
    entry = ALGORITHMS[require_choice("algorithm", algorithm, ALGORITHMS)]
    before = torch.get_num_threads()
    torch.set_num_threads(
        threads
    )  # torch's own default, one for each core, makes small networks slower
    try:
        learner = entry.make(env_id, settings, seed, chosen, threads, tensorboard)
        recorder = Recorder(
            settings.steps,
            learner.capture,
            checkpoint=checkpoint,
            seconds=checkpoint_seconds,
            progress=progress,
            label=f"training, seed {seed}",
            report=report,
        )
        recorder.resume(learner.restore)
        if not 0 <= learner.steps < settings.steps + settings.update_steps:
            raise CheckpointError(
                f"the checkpoint is of {learner.steps:,} steps, and the training ends at {settings.steps:,}"
            )
        with recorder.running(learner.steps):
            learner.learn(recorder)
            recorder.between_updates(learner.steps, last=True)
    finally:
        torch.set_num_threads(before)
    log = recorder.log()
    card = PolicyCard(
        env_id=env_id,
        options=chosen,
        layout=ObservationLayout.of(task_of(env_id), chosen),
        algorithm=algorithm,
        activation=learner.activation,
        output=learner.output,
        seed=seed,
        settings=settings_to_plain(settings),
        training={"steps": learner.steps, "seconds": round(log.seconds, 1)},
        versions=package_versions(),
    )
    return Trained(Policy(card, learner.weights()), log)

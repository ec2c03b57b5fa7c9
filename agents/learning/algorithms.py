"""The learning algorithms by name: the one place where a new one is registered, and the call that trains any of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.registration import ALL_TASKS, GOAL_TASK, TASK_VERSIONS
from lean_yaw_env.validation import require_choice

from ..observations import ObservationLayout
from ..policies.policy import Policy, PolicyCard, package_versions
from ..policies.policy_files import task_of
from ..settings import tuned
from .apg import GradientLearner, GradientSettings
from .her import HERLearner, HERSettings
from .learner import LearnerSettings, MakeLearner, settings_to_plain, torch_threads
from .ppo import PPOLearner, PPOSettings
from .recorder import Recorder, Report, TrainingLog
from .sac import SACLearner, SACSettings


@dataclass(frozen=True)
class Trained:
    """What a training gives."""

    policy: Policy
    log: TrainingLog


@dataclass(frozen=True)
class Algorithm:
    """What a training needs to know of an algorithm.

    Attributes
    ----------
    settings : class of its settings, a ``LearnerSettings``
    make : its learner's class
    tasks : that it can learn
    """

    settings: type[Any]
    make: MakeLearner
    tasks: tuple[str, ...] = ALL_TASKS


ALGORITHMS: dict[str, Algorithm] = {
    "ppo": Algorithm(PPOSettings, PPOLearner),
    "sac": Algorithm(SACSettings, SACLearner),
    "apg": Algorithm(GradientSettings, GradientLearner, tuple(TASK_VERSIONS)),
    "her": Algorithm(HERSettings, HERLearner, (GOAL_TASK,)),
}
"""By the names that their policies carry."""


def settings_for(algorithm: str, task: str) -> Any:
    """An algorithm's settings for a task: those that come with the package, or the default ones.

    Raises
    ------
    ValueError
        For an algorithm or a task there is not, or a task that the algorithm cannot learn.
    """
    entry = ALGORITHMS[require_choice("algorithm", algorithm, ALGORITHMS)]
    require_choice(f"task of {algorithm}", task, entry.tasks)
    return tuned(algorithm, task, entry.settings())


def settings_from_plain(algorithm: str, plain: dict[str, Any]) -> Any:
    """The settings that ``learner.settings_to_plain`` wrote, or ``TypeError`` or ``ValueError``."""
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()}
    return ALGORITHMS[require_choice("algorithm", algorithm, ALGORITHMS)].settings(**values)


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
    """Train a policy, going on from the checkpoint if its file is there.

    Interrupted and gone on with the same arguments, a training gives what it would have given uninterrupted, bit for bit.

    Parameters
    ----------
    algorithm : a name in ``ALGORITHMS``
    env_id, settings, seed, options : what to train
    checkpoint : file for the training's state, written whole; none without
    checkpoint_seconds : least time between two of them
    threads : of torch and of the walkers
    progress : show a bar
    report : told of the steps done and the latest returns, between updates
    tensorboard : folder for TensorBoard's logs; none without

    Raises
    ------
    ValueError
        If a number is out of its range, or the algorithm cannot learn the task under these options.
    CheckpointError
        If the checkpoint is damaged or another training's.
    """
    chosen = EnvOptions() if options is None else options
    with torch_threads(threads):
        learner = ALGORITHMS[require_choice("algorithm", algorithm, ALGORITHMS)].make(
            env_id, settings, seed, chosen, threads, tensorboard
        )
        recorder = Recorder(
            settings.steps,
            learner.capture,
            checkpoint=checkpoint,
            seconds=checkpoint_seconds,
            progress=progress,
            label=f"training, seed {seed}",
            report=report,
        )
        saved = recorder.saved()
        if saved is not None:
            learner.restore(saved)
        recorder.start(learner.steps)
        try:
            learner.learn(recorder)
            recorder.finish(learner.steps)
        finally:
            recorder.close()
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

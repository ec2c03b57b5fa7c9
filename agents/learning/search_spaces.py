"""What a search for settings may change, and how far: one function for each algorithm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from optuna import Trial

from agents.learning.ppo_settings import PPOSettings
from agents.learning.sac_settings import SACSettings

_LAYERS = ("32x32", "64x64", "128x128")


def suggested_ppo(trial: Trial, settings: PPOSettings) -> PPOSettings:
    """PPO's settings of a trial; steps, walkers and pushes stay as they are, since scores differ by them whatever the rest."""
    start = start_of("ppo", settings)
    steps_per_update = _chosen(trial, start, "steps_per_update", (32, 64, 128, 256))
    minibatches = _chosen(trial, start, "minibatches", (2, 4, 8, 16, 32))
    samples = settings.walkers * steps_per_update
    return replace(
        settings,
        steps_per_update=steps_per_update,
        # few walkers make too few samples for so many parts: then every update is one part
        batch_size=samples // minibatches if samples % minibatches == 0 else samples,
        epochs=trial.suggest_int("epochs", 1, 12),
        learning_rate=trial.suggest_float("learning_rate", 2e-4, 1e-2, log=True),
        time_constant=trial.suggest_float("time_constant", 6.0, 100.0, log=True),
        gae_lambda=trial.suggest_float("gae_lambda", 0.8, 1.0),
        clip_range=trial.suggest_float("clip_range", 0.05, 0.4),
        entropy=trial.suggest_float("entropy", 0.0, 0.02),
        initial_log_std=trial.suggest_float("initial_log_std", -3.0, 0.0),
        hidden=_layers(trial, start),
    )


def suggested_sac(trial: Trial, settings: SACSettings) -> SACSettings:
    """SAC's settings of a trial."""
    start = start_of("sac", settings)
    return replace(
        settings,
        gradient_steps=trial.suggest_int("gradient_steps", 1, 16, log=True),
        batch_size=_chosen(trial, start, "batch_size", (128, 256, 512, 1024)),
        learning_rate=trial.suggest_float("learning_rate", 1e-4, 5e-3, log=True),
        time_constant=trial.suggest_float("time_constant", 6.0, 100.0, log=True),
        target_rate=trial.suggest_float("target_rate", 1e-3, 5e-2, log=True),
        target_entropy=trial.suggest_float("target_entropy", -8.0, 0.0),
        initial_entropy_weight=trial.suggest_float("initial_entropy_weight", 1e-3, 1.0, log=True),
        hidden=_layers(trial, start),
    )


def start_of(algorithm: str, settings: Any) -> dict[str, Any]:
    """The values, by the names of a trial, that stand for settings as they are."""
    values = {name: getattr(settings, name) for name in _SEARCHED[algorithm]}
    if algorithm == "ppo":
        values["minibatches"] = settings.walkers * settings.steps_per_update // settings.batch_size
    return values | {"hidden": "x".join(str(units) for units in settings.hidden)}


SPACES: dict[str, Callable[[Trial, Any], Any]] = {"ppo": suggested_ppo, "sac": suggested_sac}
"""By algorithm."""

_SEARCHED = {
    "ppo": (
        "steps_per_update", "epochs", "learning_rate", "time_constant", "gae_lambda", "clip_range",
        "entropy", "initial_log_std",
    ),
    "sac": (
        "gradient_steps", "batch_size", "learning_rate", "time_constant", "target_rate",
        "target_entropy", "initial_entropy_weight",
    ),
}  # fmt: skip


def _layers(trial: Trial, start: Mapping[str, Any]) -> tuple[int, ...]:
    # as words, since a study's file keeps no tuples
    words = _chosen(trial, start, "hidden", _LAYERS)
    return tuple(int(units) for units in words.split("x"))


def _chosen(trial: Trial, start: Mapping[str, Any], name: str, choices: tuple[Any, ...]) -> Any:
    """One of some choices, or what the settings have now."""
    own = start[name]
    return trial.suggest_categorical(name, choices if own in choices else (*choices, own))

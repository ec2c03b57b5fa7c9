"""The learning algorithms by name: the one place where a new one is registered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from agents.learning.gradient.settings import GradientSettings
from agents.learning.gradient.settings import settings_for as gradient_settings_for
from agents.learning.gradient.training import train_gradient
from agents.learning.ppo import train_ppo
from agents.learning.ppo_settings import PPOSettings, settings_for
from agents.learning.results import Trained
from agents.learning.sac import train_sac
from agents.learning.sac_settings import SACSettings
from agents.learning.sac_settings import settings_for as sac_settings_for


class Settings(Protocol):
    """A frozen dataclass of plain values, with the number of steps among them."""

    @property
    def steps(self) -> int: ...


@dataclass(frozen=True)
class Algorithm:
    """What a training needs to know of an algorithm.

    Attributes
    ----------
    settings : class of its settings
    settings_for : gives an environment's settings, by its id
    train : of the signature of ``train_ppo``
    """

    settings: type
    settings_for: Callable[[str], Any]
    train: Callable[..., Trained]


ALGORITHMS: dict[str, Algorithm] = {
    "ppo": Algorithm(PPOSettings, settings_for, train_ppo),
    "sac": Algorithm(SACSettings, sac_settings_for, train_sac),
    "apg": Algorithm(GradientSettings, gradient_settings_for, train_gradient),
}
"""By the names that their policies carry."""


def algorithm_named(name: str) -> Algorithm:
    """The algorithm of this name, or ``ValueError``."""
    if name not in ALGORITHMS:
        raise ValueError(f"algorithm must be one of {', '.join(ALGORITHMS)}, not {name!r}")
    return ALGORITHMS[name]


def settings_to_plain(settings: Any) -> dict[str, Any]:
    """Settings as JSON holds them."""
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in asdict(settings).items()
    }


def settings_from_plain(algorithm: str, plain: dict[str, Any]) -> Any:
    """The settings that ``settings_to_plain`` wrote, or ``TypeError`` or ``ValueError``."""
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()}
    return algorithm_named(algorithm).settings(**values)

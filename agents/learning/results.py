"""What a training gives, whatever the algorithm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.policies.policy import Policy

Report = Callable[[int, float], object]
"""Told now and then how many environment steps a training has come to, and the mean return of its latest episodes, NaN before the first.

What it raises ends the training.
"""


@dataclass(frozen=True)
class TrainingLog:
    """Every episode of a training, in the order in which they ended.

    Attributes
    ----------
    steps : shape (episodes,)
        Environment steps of the training when the episode ended.
    returns, lengths : shape (episodes,)
        The episode's return and its steps.
    survived : bool, shape (episodes,)
    seconds : wall-clock time of training, over all its sittings
    """

    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    survived: NDArray[np.bool_]
    seconds: float


@dataclass(frozen=True)
class Trained:
    """What a training gives."""

    policy: Policy
    log: TrainingLog

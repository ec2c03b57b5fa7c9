"""How a setting changes in the course of a training."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Falling:
    """A learning rate that falls linearly to a share of itself, called with the share of the training that is left."""

    first: float
    last_share: float

    def __call__(self, progress_left: float) -> float:
        return self.first * (self.last_share + (1.0 - self.last_share) * progress_left)

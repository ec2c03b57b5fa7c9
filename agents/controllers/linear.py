"""Linear laws: actions that are a matrix times the observation, found by direct search (``agents.tuning.linear``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lean_yaw_env.envs.observation import COMMON_ODD, STANCE_FOOT
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.parameters import Vector
from lean_yaw_env.validation import require_shape

from ..observations import ObservationLayout
from ..settings import tuned
from .simple import MemorylessController


@dataclass(frozen=True)
class LinearSettings:
    """Settings of ``LinearLaw``."""

    weights: tuple[float, ...] = ()
    """Row by row of a matrix (2, numbers observed + 1) whose last column is constant; without any, actions are zero: the fixed controller."""


class LinearLaw(MemorylessController):
    """Actions clip(W observation + b) of the observation as of a left stance; those of a right one are the mirror image.

    Parameters
    ----------
    task, options : the environment's
    settings : those tuned for the task otherwise

    Attributes
    ----------
    matrix : shape (..., 2, numbers observed + 1)
        More than one is one for each observation.

    Raises
    ------
    ValueError
        If the weights are not as many as the task's observation needs.
    """

    def __init__(
        self, task: str, options: EnvOptions | None = None, settings: LinearSettings | None = None
    ) -> None:
        chosen = EnvOptions() if options is None else options
        own = tuned("linear", task, LinearSettings()) if settings is None else settings
        made = task_named(task)
        self._layout = ObservationLayout.of(task, chosen)
        names = EnvOptions().observation_names(made)
        self._columns = [self._layout.names.index(name) for name in names]
        odd = (*COMMON_ODD[:STANCE_FOOT], *(feature.is_odd for feature in made.observed))
        self._mirrored = np.where(odd[: len(names)], -1.0, 1.0)
        self._is_mirrored = chosen.mirror
        shape = (ACTION_SIZE, len(names) + 1)
        self.matrix: Vector = np.zeros(shape)
        if own.weights:
            self.matrix = require_shape("weights", own.weights, (shape[0] * shape[1],)).reshape(shape)  # fmt: skip

    def _actions(self, observation: Any) -> NDArray[np.float32]:
        seen = self._layout.require(observation)
        features, side = seen[..., self._columns].astype(float), np.ones(seen.shape[:-1])
        if not self._is_mirrored:
            side = np.where(seen[..., STANCE_FOOT] < 0.0, -1.0, 1.0)
            features = np.where(side[..., None] < 0.0, self._mirrored * features, features)
        # sums in a fixed order, so that a walker's action does not depend on how many there are
        actions = self.matrix[..., -1] + np.einsum(
            "...ij,...j->...i", self.matrix[..., :-1], features
        )
        actions[..., 1] *= side
        return np.clip(actions, -1.0, 1.0).astype(np.float32)

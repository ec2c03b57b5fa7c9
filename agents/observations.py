"""What an environment's observation holds, and how to read physical quantities from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.goal_env import seen_from_walker
from lean_yaw_env.envs.observation import (
    COMMON_CENTRES,
    COMMON_NAMES,
    COMMON_SCALES,
    STANCE_FOOT,
)
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.state import BODY_NAMES
from lean_yaw_env.envs.tasks import task_named

_CENTRES = dict(zip(COMMON_NAMES, COMMON_CENTRES, strict=True))
_SCALES = dict(zip(COMMON_NAMES, COMMON_SCALES, strict=True))


@dataclass(frozen=True)
class ObservationLayout:
    """The names of an observation's numbers, and what turns each into its physical quantity.

    Attributes
    ----------
    names : one for each number of the observation
    centres, scales : as many
        quantity = centre + scale * observation.
    """

    names: tuple[str, ...]
    centres: tuple[float, ...]
    scales: tuple[float, ...]

    @classmethod
    def of(cls, task: str, options: EnvOptions, needs: Iterable[str] = ()) -> ObservationLayout:
        """The layout of a task's observations under these options, or ``ValueError`` if it lacks a name that is needed."""
        made = task_named(task)
        names = options.observation_names(made)
        for name in needs:
            if name not in names:
                raise ValueError(
                    f"task must be one that shows {name}, got {task!r}, which shows {', '.join(names)}"
                )
        body = zip(BODY_NAMES, made.body_reach, strict=True)
        parameters = options.walker_parameters(made)
        centres = _CENTRES | {name: getattr(parameters, name) for name in BODY_NAMES}
        centres |= {feature.name: feature.centre for feature in made.observed}
        scales = _SCALES | dict(body) | {feature.name: feature.scale for feature in made.observed}
        return cls(
            names,
            tuple(centres[name] for name in names),
            tuple(scales[name] for name in names),
        )

    def require(self, observation: ArrayLike | Mapping[str, Any]) -> NDArray[np.float32]:
        """The observation as an array of shape (..., features), that of ``WaypointGoalEnv`` as seen from the walker.

        Raises
        ------
        ValueError
            If it has another shape, or a number is not finite.
        """
        seen: Any = observation
        if isinstance(observation, Mapping):
            mirror = COMMON_NAMES[STANCE_FOOT] not in self.names
            try:
                seen = seen_from_walker(observation, mirror=mirror)
            except (KeyError, IndexError, TypeError) as error:
                raise ValueError(
                    f"observation must be as the environment gives it, got {observation!r}"
                ) from error
        array = require_observation(seen)
        if array.shape[-1] != len(self.names):
            raise ValueError(
                f"observation must have shape (..., {len(self.names)}) of {', '.join(self.names)}, got {array.shape}"
            )
        return array

    def quantity(self, observation: NDArray[np.float32], name: str) -> NDArray[np.float64]:
        """A quantity of observations (..., features) in its own unit, shape (...)."""
        column = self.names.index(name)
        return self.centres[column] + self.scales[column] * observation[..., column].astype(float)


def require_observation(observation: ArrayLike) -> NDArray[np.float32]:
    """Observations of any task as an array of shape (..., features), or ``ValueError`` if they are not finite numbers."""
    try:
        array = np.asarray(observation)
    except ValueError:  # lists of different lengths
        array = np.empty((), dtype=object)
    if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise ValueError(f"observation must hold finite numbers, got {observation!r}")
    if array.ndim == 0:
        raise ValueError(f"observation must have shape (..., features), got {observation!r}")
    return array.astype(np.float32, copy=False)

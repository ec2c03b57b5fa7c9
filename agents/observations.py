"""What an environment's observation holds, and how to read physical quantities from it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.envs.transition import OFFSET_SCALE, STATE_CENTRES, STATE_SCALES
from lean_yaw_env.parameters import STATE_FIELDS

_CENTRES = dict(zip((field.name for field in STATE_FIELDS), STATE_CENTRES, strict=True))
_SCALES = dict(zip((field.name for field in STATE_FIELDS), STATE_SCALES, strict=True))
_CENTRES |= {"mass_offset": 0.0, "stance_foot": 0.0}
_SCALES |= {"mass_offset": OFFSET_SCALE, "stance_foot": 1.0}


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
        centres = _CENTRES | {feature.name: feature.centre for feature in made.features}
        scales = _SCALES | {feature.name: feature.scale for feature in made.features}
        return cls(
            names,
            tuple(centres[name] for name in names),
            tuple(scales[name] for name in names),
        )

    def require(self, observation: ArrayLike) -> NDArray[np.float32]:
        """The observation as an array of shape (..., features), or ``ValueError``."""
        array = np.asarray(observation, dtype=np.float32)
        if array.ndim == 0 or array.shape[-1] != len(self.names):
            raise ValueError(
                f"observation must have shape (..., {len(self.names)}) of {', '.join(self.names)}, got {array.shape}"
            )
        return array

    def quantity(self, observation: NDArray[np.float32], name: str) -> NDArray[np.float64]:
        """A quantity of observations (..., features) in its own unit, shape (...)."""
        column = self.names.index(name)
        return self.centres[column] + self.scales[column] * observation[..., column].astype(float)

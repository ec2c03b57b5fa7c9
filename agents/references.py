"""The scores that normalised scores are measured by: 0 is the fixed controller's, 1 the reference, the best that a search has found.

``references.json`` holds them by task; ``python -m agents reference`` writes it. References are found on validation episodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from lean_yaw_env.files import read_json, require_path
from lean_yaw_env.registration import ALL_TASKS
from lean_yaw_env.validation import require_choice, require_finite, require_shape, require_text

FILE = Path(__file__).with_name("references.json")


@dataclass(frozen=True)
class Reference:
    """A task's reference, and how it was found.

    Attributes
    ----------
    metric : the task's headline, which all values are of
    fixed : the fixed controller's mean; normalised scores call it 0
    value : the reference; normalised scores call it 1
    standard_error : of ``value``; 0 where it is not known
    found_by : the search, in words
    base : the agent that the search began with
    base_value : that agent's mean
    episodes, first_seed : the validation episodes of the search, from this environment seed on
    mean_episodes : of ``fixed`` and ``base_value``, from the same seed on
    horizon : of these episodes, where it is not the task's
    searches : settings of the planner, one for each search; the best result of each episode counts
    seconds : of one core
    command : that finds it again
    """

    metric: str
    fixed: float
    value: float
    standard_error: float
    found_by: str
    base: str
    base_value: float
    episodes: int
    first_seed: int
    mean_episodes: int
    horizon: float | None
    searches: tuple[Mapping[str, Any], ...]
    seconds: float
    command: str

    def __post_init__(self) -> None:
        for name in ("metric", "found_by", "base"):
            require_text(name, getattr(self, name))
        for name in ("fixed", "value", "standard_error", "base_value", "seconds"):
            require_finite(name, getattr(self, name))


def normalised(task: str, value: float) -> float | None:
    """A value of the task's headline as a share of the way from the fixed controller to the reference; None for a task without a reference.

    Raises
    ------
    ValueError
        If there is no such task, or the value is no number.
    """
    found = references().get(require_choice("task", task, ALL_TASKS))
    require_shape("value", value, ())
    return None if found is None else (value - found.fixed) / (found.value - found.fixed)


@lru_cache(maxsize=1)
def references() -> dict[str, Reference]:
    """The references that come with the package, by task."""
    return read_references(FILE)


def read_references(file: Path) -> dict[str, Reference]:
    """The references of a file, by task; none if there is no file, and ``ValueError`` if it holds something else."""
    found: Any = read_json(file) if require_path(file, "file").exists() else {}
    try:
        return {task: Reference(**values) for task, values in found.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{str(file)!r} holds no references: {error}") from error

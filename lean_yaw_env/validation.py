"""Checks of arguments, used at every public edge: each returns the value in its plain type or raises ``ValueError``.

A message names the argument, what is allowed and the value given: "slope must be a number in [-0.5, 0.5], got 'steep'".
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Choice = TypeVar("Choice", bound=str)
Instance = TypeVar("Instance")

LARGEST_SEED = 2**128 - 1
_NUMBERS = (int, float, np.integer, np.floating)


def require_number(name: str, value: Any, low: float, high: float, bounds: str = "[]") -> float:
    """Return a real number of an interval as float; ``bounds`` are its brackets, "[" and "]" where the end belongs to it."""
    if isinstance(value, bool) or not isinstance(value, _NUMBERS):
        raise ValueError(f"{name} must be {_number_in(low, high, bounds)}, got {value!r}")
    number = float(value)
    if not _is_inside(number, low, high, bounds):
        allowed = _number_in(low, high, bounds).removeprefix("a number ")
        raise ValueError(f"{name} must be {allowed}, got {value!r}")
    return number


def require_finite(name: str, value: Any) -> float:
    """Return a finite number as float."""
    return require_number(name, value, -math.inf, math.inf, "()")


def require_count(name: str, value: Any, low: int = 1, high: int = 10_000_000) -> int:
    """Return a whole number from ``low`` to ``high`` as int; 2.0 is none."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{name} must be a whole number from {low} to {high}, got {value!r}")
    if not low <= value <= high:
        raise ValueError(f"{name} must be from {low} to {high}, got {value!r}")
    return int(value)


def require_flag(name: str, value: Any) -> bool:
    """Return True or False as bool."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def require_instance(name: str, value: Any, kind: type[Instance]) -> Instance:
    """Return an object of a class."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} must be {kind.__name__}, got {value!r}")
    return value


def require_mapping(name: str, value: Any) -> Mapping[Any, Any]:
    """Return a mapping, such as a dictionary."""
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} must be a mapping, got {value!r}")
    return value


def require_pair(name: str, value: Any, contents: str) -> tuple[Any, Any]:
    """Return a pair; ``contents`` says for the message of what."""
    if not isinstance(value, (tuple, list, np.ndarray)) or len(value) != 2:
        raise ValueError(f"{name} must be a pair ({contents}), got {value!r}")
    first, second = value
    return first, second


def require_text(name: str, value: Any) -> str:
    """Return a text that is not empty."""
    if not isinstance(value, str) or not value:
        raise ValueError(f"{name} must be a text, got {value!r}")
    return value


def require_seed(name: str, value: Any) -> int | None:
    """Return the seed of a random number generator, or None, which stands for a new one."""
    return None if value is None else require_count(name, value, 0, LARGEST_SEED)


def require_choice(name: str, value: Any, choices: Collection[Choice]) -> Choice:
    """Return one of some names; the message suggests the name that a misspelt one is closest to."""
    for choice in choices:
        if isinstance(value, str) and value == choice:
            return choice
    raise ValueError(
        f"{name} must be one of {', '.join(choices)}, got {value!r}{suggestion(value, choices)}"
    )


def suggestion(value: Any, choices: Collection[str]) -> str:
    """ "; did you mean X?" for a misspelt name, else nothing."""
    close = difflib.get_close_matches(value, choices, 1) if isinstance(value, str) else []
    return f"; did you mean {close[0]!r}?" if close else ""


def require_array(
    name: str,
    value: ArrayLike,
    shape: tuple[int | None, ...],
    low: float = -math.inf,
    high: float = math.inf,
    bounds: str = "()",
) -> NDArray[np.float64]:
    """Return numbers of an interval, by default all finite ones, as a new float array of ``shape``; None there stands for any length."""
    array = np.array(require_shape(name, value, shape))
    inside = _is_inside(array, low, high, bounds)
    if not np.all(inside):
        allowed = _number_in(low, high, bounds).removeprefix("a ").replace("number", "numbers")
        raise ValueError(f"{name} must hold {allowed}, got {array[~inside].flat[0]}")
    return array


def require_vector(
    name: str, value: ArrayLike, low: float = -math.inf, high: float = math.inf, bounds: str = "()"
) -> NDArray[np.float64]:
    """Return a number, or a sequence of one or more, as a new float array of shape (n,)."""
    given: Any = [value] if isinstance(value, _NUMBERS) else value
    vector = require_array(name, given, (None,), low, high, bounds)
    if not vector.size:
        raise ValueError(f"{name} must hold one number or more, got none")
    return vector


def require_shape(
    name: str, value: ArrayLike, shape: tuple[int | None, ...]
) -> NDArray[np.float64]:
    """Return real numbers, NaN included, as a float array of ``shape``, the given one where it fits; None there stands for any length."""
    kind = f"hold numbers in shape {_written(shape)}" if shape else "be a number"
    given = _numeric(name, value, kind)
    fits = (wanted in (None, length) for wanted, length in zip(shape, given.shape, strict=False))
    if len(shape) != given.ndim or not all(fits):
        found = given.shape or repr(value)
        raise ValueError(f"{name} must have shape {_written(shape)}, got {found}")
    return np.asarray(given, dtype=np.float64, order="C")


def require_numbers(name: str, value: ArrayLike, last: int | None = None) -> NDArray[np.float64]:
    """Return finite numbers, one or more, in the shape that they have as a float array; ``last`` is the length of the last axis."""
    kind = "hold finite numbers" if last is None else f"hold finite numbers in shape (..., {last})"
    given = _numeric(name, value, kind)
    fits = given.size and (last is None or given.shape[-1:] == (last,))
    if not fits or not np.isfinite(given).all():
        raise ValueError(f"{name} must {kind}, got {value!r}")
    return given.astype(np.float64, copy=False)


def require_one_or_each(name: str, value: ArrayLike, n: int) -> NDArray[np.float64]:
    """Return one real number, or one for each of ``n``, NaN included, as a float array (n,) that may be read only."""
    if np.isscalar(value) or value is None or getattr(value, "shape", None) == ():
        return np.broadcast_to(require_shape(name, value, ()), (n,))
    given = require_shape(name, value, (None,))
    if len(given) != n:
        raise ValueError(f"{name} must be one number or {n} of them, got {len(given)}")
    return given


def _numeric(name: str, value: ArrayLike, kind: str) -> NDArray[Any]:
    """A value as an array of integers or floats; ``kind`` says for the message what it must do."""
    try:
        given = np.asarray(value)
    except ValueError:  # lists of different lengths
        given = np.empty((), dtype=object)
    if given.dtype.kind not in "iuf":
        raise ValueError(f"{name} must {kind}, got {value!r}")
    return given


def _written(shape: tuple[int | None, ...]) -> str:
    """A shape as NumPy writes it, with n for any length."""
    return str(shape).replace("None", "n")


def _number_in(low: float, high: float, bounds: str) -> str:
    if (low, high, bounds) == (-math.inf, math.inf, "()"):
        return "a finite number"
    return f"a number in {bounds[0]}{low:g}, {high:g}{bounds[1]}"


def _is_inside(number: Any, low: float, high: float, bounds: str) -> Any:
    """Whether a number, or each of an array, is in an interval; NaN is in none."""
    above = number >= low if bounds[0] == "[" else number > low
    return above & (number <= high if bounds[1] == "]" else number < high)

"""Ranges on the command line: ``low:high:count``, and ``name=low:high:count`` for an axis."""

from __future__ import annotations

import math

import numpy as np

from lean_yaw_env.parameters import Vector

MOST_POINTS = 100_000


def parse_range(text: str, name: str = "range") -> Vector:
    """Values of ``low:high:count``, evenly spaced, ends included; or of a single number.

    Raises
    ------
    ValueError
        If it is neither, low is not below high, or the count is not in [2, 100000].
    """
    fields = text.split(":")
    form = f"{name} must be a number or low:high:count, such as 0.1:0.8:15, got {text!r}"
    try:
        numbers = [float(field) for field in fields[:2]]
        count = int(fields[2]) if len(fields) == 3 else 1
    except ValueError as error:
        raise ValueError(form) from error
    if len(fields) not in (1, 3) or not all(math.isfinite(number) for number in numbers):
        raise ValueError(form)
    if len(fields) == 1:
        return np.array(numbers)
    if not numbers[0] < numbers[1]:
        raise ValueError(f"{name} must rise from low to high, got {text!r}")
    if not 2 <= count <= MOST_POINTS:
        raise ValueError(f"{name}: the count must be in [2, {MOST_POINTS}], got {count}")
    return np.linspace(numbers[0], numbers[1], count)


def parse_axis(text: str) -> tuple[str, Vector]:
    """Name and values of ``name=low:high:count``; dashes in the name count as underscores.

    Raises
    ------
    ValueError
        If it has another form.
    """
    name, sign, values = text.partition("=")
    if not sign or not name:
        raise ValueError(
            f"axis must be name=low:high:count, such as slope=0.005:0.05:10, got {text!r}"
        )
    return name.strip().replace("-", "_"), parse_range(values, f"axis {name.strip()}")


def parse_axes(texts: list[str]) -> dict[str, Vector]:
    """Axes by name.

    Raises
    ------
    ValueError
        If one has another form, or a name comes twice.
    """
    axes: dict[str, Vector] = {}
    for text in texts:
        name, values = parse_axis(text)
        if name in axes:
            raise ValueError(f"axis {name} is given twice")
        axes[name] = values
    return axes

"""Check rows of numbers against a column's range each, at a small part of what a step costs."""

from __future__ import annotations

from lean_yaw_env.kernel.compilation import entry_point


@entry_point()
def count_outside(numbers, low, high):
    """How many of the flat ``numbers`` are not between ``low`` and ``high``, which repeat along them; NaN never is."""
    outside = 0
    for first in range(0, numbers.size, low.size):
        part = numbers[first : first + low.size]
        for j in range(part.size):
            outside += not ((part[j] >= low[j]) & (part[j] <= high[j]))
    return outside

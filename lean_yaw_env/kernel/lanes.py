"""Records in flat arrays of numbers: the functions that read and write them, generated from the records' fields.

A loop over walkers that LLVM vectorises keeps a row for each quantity and a lane in it for each walker, at places that are known at compile time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lean_yaw_env.kernel.compilation import generated, inlined

LANES = 128
_VECTOR = 8  # doubles in the widest vector registers
# Rows are a vector longer than their lanes: at a distance of a power of two they would compete for the same places in the cache
ROW = LANES + _VECTOR


@inlined
def padded(n):
    """The next multiple of the vector length: no lane is left to a loop of single ones."""
    return (n + _VECTOR - 1) // _VECTOR * _VECTOR


def lane_reader(
    record: type[Any], place: int, carried: Sequence[str] = (), derivatives: int = 0
) -> Any:
    """``read(work, i)``: the record in lane ``i`` of the rows from ``place`` on, a row for each field.

    Fields in ``carried`` are complex; the rows of their imaginary parts, in this order, begin at ``derivatives``.
    """
    values = (
        f"complex(work[{real} + i], work[{imaginary} + i])" if imaginary else f"work[{real} + i]"
        for _, real, imaginary in _places(record, place, carried, derivatives)
    )
    return _function(
        f"def read(work, i):\n    return {record.__name__}({', '.join(values)})", record
    )


def lane_writer(
    record: type[Any], place: int, carried: Sequence[str] = (), derivatives: int = 0
) -> Any:
    """``write(work, i, value)``: put a record where ``lane_reader`` with the same arguments finds it."""
    lines = ["def write(work, i, value):"]
    for name, real, imaginary in _places(record, place, carried, derivatives):
        lines.append(f"    work[{real} + i] = value.{name}.real")
        if imaginary:
            lines.append(f"    work[{imaginary} + i] = value.{name}.imag")
    return _function("\n".join(lines), record)


def row_reader(record: type[Any]) -> Any:
    """``read(row)``: a record from a row of numbers."""
    values = ", ".join(f"row[{k}]" for k in range(len(record._fields)))
    return _function(f"def read(row):\n    return {record.__name__}({values})", record)


def row_writer(record: type[Any]) -> Any:
    """``write(value, row)``: put a record into a row of numbers."""
    lines = (f"    row[{k}] = value.{name}" for k, name in enumerate(record._fields))
    return _function("\n".join(("def write(value, row):", *lines)), record)


def replacer(record: type[Any], *names: str) -> Any:
    """``replace(value, name, ...)``: the record with new numbers in these fields."""
    fields = (name if name in names else f"value.{name}" for name in record._fields)
    return _function(
        f"def replace(value, {', '.join(names)}):\n    return {record.__name__}({', '.join(fields)})",
        record,
    )


def chooser(record: type[Any], other: type[Any]) -> Any:
    """``choose(condition, new, value)``: the record, with all fields that ``new`` of type ``other`` has too if the condition holds."""
    fields = (
        f"new.{name} if condition else value.{name}" if name in other._fields else f"value.{name}"
        for name in record._fields
    )
    return _function(
        f"def choose(condition, new, value):\n    return {record.__name__}({', '.join(fields)})",
        record,
    )


def _places(
    record: type[Any], place: int, carried: Sequence[str], derivatives: int
) -> list[tuple[str, int, int]]:
    """Each field's name, where its row begins, and where that of its imaginary part does, 0 for none."""
    return [
        (name, place + k * ROW, derivatives + carried.index(name) * ROW if name in carried else 0)
        for k, name in enumerate(record._fields)
    ]


def _function(source: str, record: type[Any]) -> Any:
    return inlined(generated(source, **{record.__name__: record}))

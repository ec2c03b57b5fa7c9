"""Functions generated from records: what is written is read back, and machine code depends on what is generated."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit

from lean_yaw_env.kernel import compilation
from lean_yaw_env.kernel.compilation import generated, inlined
from lean_yaw_env.kernel.lanes import LANES, ROW, lane_reader, lane_writer, row_reader, row_writer


class Pair(NamedTuple):
    """A record to read and write."""

    first: Any
    second: Any


def test_a_record_in_a_lane_is_read_as_it_was_written() -> None:
    derivatives = 3 * ROW
    write = lane_writer(Pair, ROW, ("second",), derivatives)
    read = lane_reader(Pair, ROW, ("second",), derivatives)

    @njit
    def both(work, i):
        write(work, i, Pair(2.0, 3.0 + 4.0j))
        return read(work, i)

    work = np.zeros(4 * ROW)
    assert both(work, 5) == Pair(2.0, 3.0 + 4.0j)
    assert np.flatnonzero(work).tolist() == [ROW + 5, 2 * ROW + 5, derivatives + 5]
    assert LANES <= ROW


def test_a_record_in_a_row_is_read_as_it_was_written() -> None:
    write, read = row_writer(Pair), row_reader(Pair)

    @njit
    def both(row):
        write(Pair(2.0, 3.0), row)
        return read(row)

    row = np.zeros(2)
    assert both(row) == Pair(2.0, 3.0)
    assert row.tolist() == [2.0, 3.0]


def test_a_generated_function_may_name_what_it_is_given_and_shows_in_a_traceback() -> None:
    divide = generated("def divide(x):\n    return one / x", one=1.0)
    assert divide(4.0) == 0.25
    with pytest.raises(ZeroDivisionError) as caught:
        divide(0)
    assert "return one / x" in str(caught.traceback[-1].statement)


def test_machine_code_depends_on_formulas_generated_or_held_by_a_function_around() -> None:
    def entry_around(formula: Any, size: int) -> Any:
        inner = inlined(formula)

        def entry(x):
            return inner(x) + size

        return entry

    def digest(factor: float, size: int) -> str:
        formula = generated(f"def formula(x):\n    return {factor!r} * x")
        return compilation._digest(entry_around(formula, size), ())

    assert digest(2.0, 1) == digest(2.0, 1)
    assert digest(2.0, 1) != digest(3.0, 1)
    assert digest(2.0, 1) != digest(2.0, 2)

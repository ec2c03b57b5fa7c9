"""Results as plain records, printed as JSON or as tables for people."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from lean_yaw_env.analysis import LimitCycle, find_passive_gaits, modes
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.vehicles import (
    EigenvalueBranches,
    LinearBicycle,
    Skateboard,
    critical_speed,
    stable_speed_range,
)

if TYPE_CHECKING:
    import xarray

    from lean_yaw_env.paper import Reproduction
    from lean_yaw_env.parameters import Vector

Record = dict[str, Any]
_MAP_NUMBERS = ["speed", "step_length", "spectral_radius", "greatest_friction"]
_MOST_ROWS = 12
_PART = 2**20
"""Points of a grid that are read at once."""


def plain(value: Any) -> Any:
    """The same for JSON: arrays as lists, complex numbers as pairs, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, (np.ndarray, list, tuple)):
        return [plain(each) for each in value]
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, complex):
        return {"real": plain(value.real), "imag": plain(value.imag)}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_json(record: Any) -> str:
    """Indented JSON that any reader accepts."""
    return json.dumps(plain(record), indent=2, ensure_ascii=False, allow_nan=False)


def gait_record(cycle: LimitCycle) -> Record:
    """A limit cycle with its modes; of a passive walker with all its gaits, of which it is the first."""
    record: Record = {
        "state": dict(zip(cycle.section_map.names, cycle.state.tolist(), strict=True)),
        "is_stable": cycle.is_stable,
        "speed": cycle.speed,
        "step_length": cycle.step_length,
        "stride_period": cycle.stride_period,
        "turn_per_stride": cycle.turn,
        "turning_radius": cycle.turning_radius,
        "gravity_work_per_distance": cycle.gravity_work,
        "shift_work_per_distance": cycle.shift_work,
        "least_normal_force": cycle.least_normal_force,
        "greatest_friction": cycle.greatest_friction,
        "residual": cycle.residual,
        "modes": [
            {
                "eigenvalue": mode.eigenvalue,
                "magnitude": abs(mode.eigenvalue),
                "kind": mode.name,
                "why_zero": mode.explanation,
            }
            for mode in modes(cycle)
        ],
    }
    walker = cycle.section_map.walker
    if isinstance(walker, PassiveWalker):
        record["gaits"] = [
            {
                "stride_period": gait.stride_period,
                "speed": gait.speed,
                "greatest_multiplier": gait.spectral_radius,
                "is_stable": gait.is_stable,
                "described": bool(np.abs(gait.state - cycle.state).max() < 1e-9),
            }
            for gait in find_passive_gaits(walker)
        ]
    return record


def grid_summary(data: xarray.Dataset, key: str, numbers: Sequence[str]) -> Record:
    """``counts`` of points by gait or by ending, whichever is the key, and the ``ranges`` of some numbers; read a part at a time."""
    counts, ranges = Counter[str](), dict[str, tuple[float, float]]()
    for part in _parts(data):
        counts.update(_KINDS[key](part).tolist())
        for name in numbers:
            values = part[name].to_numpy()
            values = values[np.isfinite(values)]
            if values.size:
                least, most = ranges.get(name, (math.inf, -math.inf))
                ranges[name] = min(least, float(values.min())), max(most, float(values.max()))
    return {"counts": dict(counts.most_common()), "ranges": ranges}


def _parts(data: xarray.Dataset) -> Iterator[xarray.Dataset]:
    """A dataset by parts of its first axis, each of a million points or so."""
    sizes = list(next(iter(data.data_vars.values())).sizes.items())
    name, size = str(sizes[0][0]), sizes[0][1]
    step = max(1, _PART // math.prod(each for _, each in sizes[1:]))
    for first in range(0, size, step):
        yield data.isel({name: slice(first, first + step)})


def _gaits(part: xarray.Dataset) -> NDArray[np.str_]:
    radius = part["spectral_radius"].to_numpy().ravel()
    return np.where(np.isnan(radius), "none found", np.where(radius < 1.0, "stable", "unstable"))


def _endings(part: xarray.Dataset) -> NDArray[np.str_]:
    meanings = json.loads(part["ending"].attrs["meanings"])
    kinds, which = np.unique(part["ending"].to_numpy().ravel(), return_inverse=True)
    return np.array([meanings[str(int(kind))] for kind in kinds])[which]


_KINDS = {"gait": _gaits, "ending": _endings}


def map_records(data: xarray.Dataset) -> list[Record]:
    """One record for each point of a stability map."""
    table = data[_MAP_NUMBERS].to_dataframe().reset_index()
    return table.assign(gait=_gaits(data)).to_dict("records")  # pyright: ignore[reportReturnType]


def basin_records(data: xarray.Dataset) -> list[Record]:
    """One record for each start of a basin of attraction."""
    table = data[["steps", "ending"]].to_dataframe().reset_index()
    table["steps"], table["ending"] = table["steps"].astype(int), _endings(data)
    return table.to_dict("records")  # pyright: ignore[reportReturnType]


def bicycle_record(bicycle: LinearBicycle, branches: EigenvalueBranches) -> Record:
    """A bicycle's speeds that matter, and its named eigenvalues."""
    limits = stable_speed_range(bicycle)
    return {
        "double_root_speed": bicycle.double_root_speed(),
        "weave_speed": bicycle.weave_speed(),
        "capsize_speed": bicycle.capsize_speed(),
        "stable_speeds": None if limits is None else list(limits),
        "eigenvalues": _by_speed(branches.speeds, branches.names, branches.eigenvalues),
    }


def skateboard_record(board: Skateboard, speeds: Vector) -> Record:
    """A skateboard's critical speed and its eigenvalues."""
    values = _by_speed(speeds, ("first", "second"), board.eigenvalues(speeds))
    return {"critical_speed": critical_speed(board), "eigenvalues": values}


def _by_speed(speeds: Vector, names: Sequence[str], values: Any) -> list[Record]:
    return [
        {"speed": speed, **dict(zip(names, row, strict=True))}
        for speed, row in zip(speeds, values, strict=True)
    ]


def text_of(value: Any) -> str:
    """A number with six digits, a complex one by its parts."""
    value = value.item() if isinstance(value, np.generic) else value
    if value is None or value != value:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, complex):
        if value.imag == 0.0:
            return text_of(value.real)
        sign = "+" if value.imag > 0.0 else "-"
        return f"{value.real:.6g} {sign} {abs(value.imag):.6g}i"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return " to ".join(text_of(each) for each in value)
    return str(value)


def show_pairs(title: str, record: Record) -> None:
    """Names and values, a line each; what is a list or a mapping of its own is left out."""
    table = Table(title=title, title_justify="left", min_width=60, show_header=False, box=None)
    for name, value in record.items():
        first = value[0] if isinstance(value, list) and value else value
        if not isinstance(first, dict):
            table.add_row(name.replace("_", " "), text_of(value))
    Console().print(table)


def show_records(title: str, records: Sequence[Record], more: str = "--json") -> None:
    """A table of records that have the same keys: all, or the first ones and what shows the others."""
    if not records:
        return
    table = Table(title=title, title_justify="left")
    for name in records[0]:
        table.add_column(name.replace("_", " "))
    for record in records[:_MOST_ROWS]:
        table.add_row(*(text_of(value) for value in record.values()))
    console = Console()
    console.print(table)
    if len(records) > _MOST_ROWS:
        console.print(f"... and {len(records) - _MOST_ROWS} more: ask for {more}")


def show_gait(record: Record) -> None:
    """A gait's record: state, numbers, multipliers, why some of them are zero, and which of several gaits it is."""
    show_pairs("section state just after heel strike, left foot", record["state"])
    show_pairs("gait", record)
    gait_modes = record["modes"]
    shown = [{key: mode[key] for key in ("eigenvalue", "magnitude", "kind")} for mode in gait_modes]
    show_records("multipliers of the stride", shown)
    for reason in sorted({mode["why_zero"] for mode in gait_modes} - {""}):
        Console().print(f"zero: {reason}")
    gaits = record.get("gaits", [])
    if len(gaits) > 1:
        show_records(f"this walker has {len(gaits)} gaits; the one described is the slowest", gaits)


def show_grid(title: str, key: str, summary: Record, records: Sequence[Record]) -> None:
    """Points of a grid: how many have each value of a key, the ranges of some numbers, and the first of the records."""
    show_pairs(f"{sum(summary['counts'].values())} {title} by {key}", summary["counts"])
    show_pairs("from least to greatest", summary["ranges"])
    show_records(title, records, "--json, --out or --plot")


def show_reproduction(reproduction: Reproduction) -> None:
    """How many checks came to which verdict, and those that disagree."""
    show_pairs("checks", dict(reproduction.counts()))
    table = Table(title="where they disagree", title_justify="left")
    for name in ("what", "paper", "ours", "verdict"):
        table.add_column(name)
    for check in reproduction.checks:
        if not check.agrees:
            table.add_row(check.name, check.paper, check.ours, check.verdict)
    if table.row_count:
        Console().print(table)

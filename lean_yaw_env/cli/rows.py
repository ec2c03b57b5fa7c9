"""Results as plain records, for tables on a screen and for JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.analysis import LimitCycle, modes
from lean_yaw_env.vehicles import (
    LinearBicycle,
    Skateboard,
    critical_speed,
    follow_eigenvalues,
    stable_speed_range,
)

if TYPE_CHECKING:
    import xarray

    from lean_yaw_env.parameters import Vector

Record = dict[str, Any]
_MAP_NUMBERS = ("speed", "step_length", "spectral_radius", "greatest_friction")


def plain(value: Any) -> Any:
    """The same for JSON: arrays as lists, complex numbers as pairs, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray):
        return [plain(each) for each in value]
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (complex, np.complexfloating)):
        return {"real": plain(float(value.real)), "imag": plain(float(value.imag))}
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value


def as_json(record: Any) -> str:
    """Indented JSON that any reader accepts."""
    return json.dumps(plain(record), indent=2, ensure_ascii=False, allow_nan=False)


def gait_record(cycle: LimitCycle) -> Record:
    """A limit cycle with its modes."""
    return {
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


def map_records(data: xarray.Dataset, axes: Mapping[str, Vector]) -> list[Record]:
    """One record for each point of a stability map."""
    grids = np.meshgrid(*axes.values(), indexing="ij")
    columns = {name: grid.ravel() for name, grid in zip(axes, grids, strict=True)}
    columns |= {name: data[name].to_numpy().ravel() for name in _MAP_NUMBERS}
    records = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    for record in records:
        radius = record["spectral_radius"]
        record["gait"] = (
            "none found" if math.isnan(radius) else "stable" if radius < 1.0 else "unstable"
        )
    return records


def basin_records(data: xarray.Dataset, axes: Mapping[str, Vector]) -> list[Record]:
    """One record for each start of a basin of attraction."""
    meanings = json.loads(data["ending"].attrs["meanings"])
    grids = np.meshgrid(*axes.values(), indexing="ij")
    columns: Record = {name: grid.ravel() for name, grid in zip(axes, grids, strict=True)}
    columns["steps"] = data["steps"].to_numpy().ravel().astype(int)
    columns["ending"] = [meanings[str(int(ending))] for ending in data["ending"].to_numpy().ravel()]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def count_by(records: Sequence[Record], key: str) -> dict[str, int]:
    """How many records have each value of a key, the most frequent first."""
    values = [record[key] for record in records]
    return {
        value: values.count(value) for value in sorted(set(values), key=lambda v: -values.count(v))
    }


def bicycle_record(bicycle: LinearBicycle, speeds: Vector) -> Record:
    """A bicycle's speeds that matter, and its named eigenvalues."""
    branches = follow_eigenvalues(bicycle, speeds)
    limits = stable_speed_range(bicycle)
    return {
        "double_root_speed": bicycle.double_root_speed(),
        "weave_speed": bicycle.weave_speed(),
        "capsize_speed": bicycle.capsize_speed(),
        "stable_speeds": None if limits is None else list(limits),
        "eigenvalues": [
            {"speed": speed, **dict(zip(branches.names, row, strict=True))}
            for speed, row in zip(branches.speeds, branches.eigenvalues, strict=True)
        ],
    }


def skateboard_record(board: Skateboard, speeds: Vector) -> Record:
    """A skateboard's critical speed and its eigenvalues."""
    return {
        "critical_speed": critical_speed(board),
        "eigenvalues": [
            {"speed": speed, "first": row[0], "second": row[1]}
            for speed, row in zip(speeds, board.eigenvalues(speeds), strict=True)
        ],
    }

"""The atlas: a thinned one with pictures and a sample for pages, and how long questions about a whole one take."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray

from benchmarks.measure import machine
from lean_yaw_env import Walker
from lean_yaw_env.analysis import DESIGNS, Atlas, stability_map
from lean_yaw_env.files import write_json
from lean_yaw_env.plots import map_figure

_ROUNDS = 5
_COLUMNS = ("speed", "spectral_radius")
"""Columns of the sample."""


def thinned(every: int) -> tuple[xarray.Dataset, dict[str, float]]:
    """Gaits of each so-many-th value of the atlas's axes, and what that took."""
    axes = {name: axis[::every] for name, axis in DESIGNS.items()}
    stability_map(Walker(), {"hip_width": [0.1, 0.2]})  # loads the compiled code
    began = time.process_time()
    gaits = stability_map(Walker(), axes)
    seconds = time.process_time() - began
    designs = gaits.status.size
    return gaits, {
        "designs": designs,
        "gaits_found": int((gaits.status == 1).sum()),
        "stable": int((gaits.spectral_radius < 1.0).sum()),
        "processor_seconds": seconds,
        "designs_per_second": designs / seconds,
    }


def write_sample(gaits: xarray.Dataset, folder: Path) -> None:
    """``atlas.json`` with the axes, and ``atlas.bin`` with each column as 32-bit little-endian numbers in row-major order; nan where there is no gait."""
    axes = {str(name): gaits[name].round(6).values.tolist() for name in gaits.status.dims}
    (folder / "atlas.bin").write_bytes(
        b"".join(gaits[name].to_numpy().astype("<f4").tobytes() for name in _COLUMNS)
    )
    write_json(folder / "atlas.json", {"axes": axes, "columns": list(_COLUMNS), "type": "<f4"})


def question_times(gaits: xarray.Dataset) -> dict[str, float]:
    """Median seconds of questions about a map."""
    began = time.perf_counter()
    atlas = Atlas(gaits)
    questions: dict[str, Callable[[], object]] = {
        "nearest_stable": lambda: atlas.nearest_stable(hip_width=0.35, slope=0.01),
        "fastest_stable": atlas.fastest_stable,
        "fastest_stable_within_limits": lambda: atlas.fastest_stable(foot_radius=(0.0, 0.5)),
    }
    times = {"opening": time.perf_counter() - began}
    for name, ask in questions.items():
        seconds = []
        for _ in range(_ROUNDS):
            began = time.perf_counter()
            ask()
            seconds.append(time.perf_counter() - began)
        times[name] = float(np.median(seconds))
    return times


def main() -> None:
    """Write ``benchmarks/results/atlas.json``, the sample and, from a store, the times of questions and the picture of a slice."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.atlas", description=__doc__)
    options.add_argument("--every", type=int, default=3)
    options.add_argument(
        "--store", type=Path, help="gaits.zarr of `lean-yaw atlas`, whole or under way"
    )
    given = options.parse_args()
    root = Path(__file__).parents[1]
    gaits, result = thinned(given.every)
    write_sample(gaits, root / "docs/static")
    kept: dict[str, object] = {"thinned": result, "machine": machine()}
    write_json(root / "benchmarks/results/atlas.json", kept)
    if given.store is not None:
        whole = xarray.open_zarr(given.store, chunks=None, consolidated=False)
        status = whole.status.to_numpy()
        kept["whole"] = {"designs": status.size, "computed": int((status != 0).sum())}
        kept["question_seconds"] = question_times(whole)
        write_json(root / "benchmarks/results/atlas.json", kept)
        plane = whole.isel(slope=1, foot_radius=12, inter_leg_angle=[4, 9, 14, 19])
        map_figure(plane.load()).savefig(root / "docs/images/atlas.png", dpi=80)
    print(json.dumps(kept, indent=2))


if __name__ == "__main__":
    main()

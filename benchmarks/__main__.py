"""The full run: every benchmark, printed and kept in ``benchmarks/results`` with machine and versions."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from benchmarks import environments, kernel, startup, training
from benchmarks.compare import as_text as comparison_text
from benchmarks.compare import compare, save_plot
from benchmarks.measure import as_json, as_text, machine
from lean_yaw_env.files import write_json

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Measure all, print it, and keep it."""
    argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__).parse_args()
    measurements = []
    for benchmark in (kernel, environments, startup, training):
        measured = benchmark.run(smallest=False)
        print(as_text(measured), end="\n\n", flush=True)
        measurements += measured
    speeds = compare(smallest=False)
    print(comparison_text(speeds))
    kept = as_json(measurements) | {"comparison": [asdict(speed) for speed in speeds]}
    RESULTS.mkdir(exist_ok=True)
    write_json(RESULTS / "full.json", kept)
    save_plot(speeds, machine(), RESULTS / "comparison.png")


if __name__ == "__main__":
    main()

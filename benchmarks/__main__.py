"""The full run: every benchmark, printed and kept in ``benchmarks/results`` with machine and versions."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from benchmarks import environments, infos, kernel, startup, training
from benchmarks.compare import as_text as comparison_text
from benchmarks.compare import compare, save_plot
from benchmarks.measure import as_json, as_text, machine
from lean_yaw_env.files import write_json

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Measure all, print it, and keep it."""
    argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__).parse_args()
    RESULTS.mkdir(exist_ok=True)
    for benchmark in (kernel, environments, infos, startup, training):
        measured = benchmark.run(smallest=False)
        print(as_text(measured), end="\n\n", flush=True)
        name = benchmark.__name__.rpartition(".")[2]
        write_json(RESULTS / f"{name}.json", as_json(measured))
    speeds = compare(smallest=False)
    print(comparison_text(speeds))
    kept = {"comparison": [asdict(speed) for speed in speeds], "machine": machine()}
    write_json(RESULTS / "comparison.json", kept)
    save_plot(speeds, machine(), RESULTS / "comparison.png")


if __name__ == "__main__":
    main()

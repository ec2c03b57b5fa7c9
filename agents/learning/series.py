"""One training repeated with several seeds: a run for each, then their learning curves and what differs between them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.table import Table

from agents.files import read_json, write_json
from agents.learning.curves import save_seeds_curves
from agents.learning.processes import run_side_by_side
from agents.learning.training import (
    EVALUATION_FILE,
    RUN_FILE,
    Training,
    is_finished,
    make_run,
    read_log,
    read_run,
    resumed_run,
    run,
    unfinished_runs,
)
from agents.policies.storage import task_of
from agents.registry import env_id_of
from agents.seeds import TRAINING_SEEDS
from lean_yaw_env.files import written_whole

SERIES_FILE = "series.json"
CURVES_FILE = "learning_curves.png"
SPREAD_FILE = "seeds.csv"
_MOST_COLUMNS = 5  # seeds shown one by one: more do not fit a terminal


@dataclass(frozen=True)
class Spread:
    """A metric's mean over episodes, of each seed's policy.

    Attributes
    ----------
    metric : its name
    seeds, means : as many; NaN where every episode left the metric undefined
    """

    metric: str
    seeds: tuple[int, ...]
    means: tuple[float, ...]

    @property
    def median(self) -> float:
        return float(np.median(self.means))


@dataclass(frozen=True)
class SeriesResult:
    """What a series left behind: its folder, the spread of each metric, and the other agents' means by metric and agent."""

    folder: Path
    spreads: list[Spread]
    others: dict[str, dict[str, float]]


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from ``0-4`` (from, to), ``0,3,7`` or both; a single number is how many, from 0 on.

    Raises
    ------
    ValueError
        If the text says nothing of the kind, or a seed twice.
    """
    parts = [re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", part.strip()) for part in text.split(",")]
    if len(parts) == 1 and parts[0] and parts[0][2] is None:
        parts = [re.fullmatch(r"(\d+)-(\d+)", f"0-{int(parts[0][1]) - 1}")]
    ranges = [range(int(p[1]), int(p[2] or p[1]) + 1) if p else range(0) for p in parts]
    seeds = tuple(seed for part in ranges for seed in part[: TRAINING_SEEDS + 1])
    if not all(ranges) or len(set(seeds)) < len(seeds) or max(seeds) >= TRAINING_SEEDS:
        raise ValueError(
            f"seeds must be as 5 (0 to 4), 0-4 or 0,3,7, different and below {TRAINING_SEEDS}, not {text!r}"
        )
    return seeds


def new_series(task: str, seeds: Sequence[int], out: Path, choices: Mapping[str, Any]) -> Path:
    """Make the folder of a series with one run for each seed, and note what is in it.

    Parameters
    ----------
    task, seeds : what to train
    out : where to make the folder
    choices : other arguments of ``Training.of_task``

    Raises
    ------
    ValueError
        If a choice is bad; nothing is written then.
    """
    trainings = {seed: Training.of_task(task, **{**choices, "seed": seed}) for seed in seeds}
    first = next(iter(trainings.values()))
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    name = f"{task}-{first.algorithm}-{stamp}-seeds"
    folder, number = out / name, 1
    while folder.exists():
        number += 1
        folder = out / f"{name}-{number}"
    for seed, training in trainings.items():
        make_run(training, folder / f"seed{seed}")
    record = {"env_id": first.env_id, "algorithm": first.algorithm, "seeds": list(trainings)}
    write_json(folder / SERIES_FILE, record)
    return folder


def is_series(folder: Path) -> bool:
    """Whether a folder is a series', rather than a run's."""
    return (folder / SERIES_FILE).exists()


def resumed(
    task: str, out: Path, folder: Path | None = None, choices: Mapping[str, Any] | None = None
) -> Path:
    """The folder of a run or a series to go on with: the one given, or the newest unfinished one.

    Raises
    ------
    ValueError
        If there is none, it is finished, or there are choices: what is resumed keeps its own.
    """
    if folder is not None and is_series(folder) and not choices:
        if _is_finished(folder):
            raise ValueError(f"the series in {str(folder)!r} is finished")
        return folder
    env_id = env_id_of(task)
    records = [
        path
        for path in out.glob(f"*/{SERIES_FILE}")
        if read_json(path).get("env_id") == env_id and not _is_finished(path.parent)
    ]
    if folder is not None or choices or not records:
        return resumed_run(task, out, folder, choices)
    records += [place / RUN_FILE for place in unfinished_runs(task, out)]
    return max(records, key=lambda path: path.stat().st_mtime).parent


def run_series(folder: Path, *, jobs: int = 1, progress: bool = True) -> SeriesResult:
    """Train whatever is unfinished of a series, one after the other or in processes, and leave curves and table.

    Parameters
    ----------
    folder : that ``new_series`` made
    jobs : processes, 1 or more
    progress : show bars

    Raises
    ------
    ValueError
        If a number is out of its range or a file is damaged.
    RunError
        If a process fails.
    """
    if jobs < 1:
        raise ValueError(f"jobs must be 1 or more, not {jobs}")
    runs = runs_of(folder)
    unfinished = [place for place in runs.values() if not is_finished(place)]
    if jobs > 1 and len(unfinished) > 1:
        run_side_by_side(unfinished, jobs, progress=progress)
    else:
        for place in unfinished:
            run(place, progress=progress)
    result = _gathered(folder, runs)
    _draw(folder, runs, result)
    _write_spreads(folder / SPREAD_FILE, result)  # last: it marks the series as finished
    return result


def spread_table(result: SeriesResult) -> Table:
    """A table of one series: a metric to a row, with the median and the range over its seeds."""
    seeds = result.spreads[0].seeds
    table = Table(
        title=f"means over episodes of {len(seeds)} seeds' policies",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    table.add_column("metric", min_width=16)
    one_by_one = seeds if len(seeds) <= _MOST_COLUMNS else ()
    for name in ("median", "lowest", "highest", *(f"seed {seed}" for seed in one_by_one)):
        table.add_column(name, justify="right", no_wrap=True)
    for spread in result.spreads:
        values = [spread.median, min(spread.means), max(spread.means)]
        values += spread.means if one_by_one else ()
        table.add_row(spread.metric.replace("_", " "), *(f"{value:.4g}" for value in values))
    return table


def _is_finished(folder: Path) -> bool:
    return (folder / SPREAD_FILE).exists()


def runs_of(folder: Path) -> dict[int, Path]:
    """The runs of a series by seed, or ``ValueError`` if the folder is not one's."""
    record = read_json(folder / SERIES_FILE)
    if not isinstance(record, dict) or not isinstance(record.get("seeds"), list):
        raise ValueError(f"{str(folder / SERIES_FILE)!r} is not a series'")
    return {int(seed): folder / f"seed{seed}" for seed in record["seeds"]}


def _gathered(folder: Path, runs: Mapping[int, Path]) -> SeriesResult:
    """What the runs' evaluations say, side by side."""
    algorithm = read_json(folder / SERIES_FILE)["algorithm"]
    means: dict[str, dict[str, list[float]]] = {}
    for place in runs.values():
        for row in read_json(place / EVALUATION_FILE):
            mean = float("nan") if row["mean"] is None else float(row["mean"])
            means.setdefault(row["agent"], {}).setdefault(row["metric"], []).append(mean)
    own = means.pop(algorithm)
    return SeriesResult(
        folder,
        [Spread(metric, tuple(runs), tuple(values)) for metric, values in own.items()],
        {
            metric: {agent: float(np.mean(found[metric])) for agent, found in means.items()}
            for metric in own
        },
    )


def _draw(folder: Path, runs: Mapping[int, Path], result: SeriesResult) -> None:
    training = read_run(next(iter(runs.values())))
    name = training.algorithm.upper()
    own = next(spread for spread in result.spreads if spread.metric == "return")
    levels = {f"{a}, evaluated: {v:.1f}": v for a, v in result.others["return"].items()}
    words = f"{name}, evaluated: {own.median:.1f}\n({min(own.means):.1f} to {max(own.means):.1f})"
    save_seeds_curves(
        [read_log(place) for place in runs.values()],
        (words, own.median),
        levels,
        f"{name} on {task_of(training.env_id)}, {len(runs)} seeds",
        training.settings.steps,
        folder / CURVES_FILE,
    )


def _write_spreads(path: Path, result: SeriesResult) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    seeds = result.spreads[0].seeds
    writer.writerow(("metric", "median", "lowest", "highest", *(f"seed{seed}" for seed in seeds)))
    for s in result.spreads:
        writer.writerow((s.metric, s.median, min(s.means), max(s.means), *s.means))
    with written_whole(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")

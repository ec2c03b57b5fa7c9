"""One training repeated with several seeds: a run for each, side by side if wanted, then their learning curves and what differs between them."""

from __future__ import annotations

import csv
import io
import multiprocessing
import re
import signal
import sys
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.table import Table
from tqdm import tqdm

from lean_yaw_env.files import read_json, write_json, write_text
from lean_yaw_env.validation import require_count

from ..registry import env_id_of
from ..seeds import TRAINING_SEEDS
from .curves import save_seeds_curves
from .runs import (
    EVALUATION_FILE,
    RUN_FILE,
    Training,
    is_finished,
    make_run,
    new_folder,
    read_log,
    read_run,
    run,
)

SERIES_FILE = "series.json"
CURVES_FILE = "learning_curves.png"
SEEDS_FILE = "seeds.csv"
_MOST_COLUMNS = 5  # seeds shown one by one: more do not fit a terminal


class RunError(RuntimeError):
    """A run whose process did not end well; what it wrote stays and can be gone on with."""


@dataclass(frozen=True)
class SeedMeans:
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
    """What a series left behind: its folder, the seeds' means of each metric, and the other agents' means by metric and agent."""

    folder: Path
    by_seed: list[SeedMeans]
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
            f"seeds must be as 5 (0 to 4), 0-4 or 0,3,7, different and below {TRAINING_SEEDS}, got {text!r}"
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
    folder = new_folder(out, first, "seeds")
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
    """The folder of a run or a series to go on with: the one given, or the newest unfinished one of the task under ``out``.

    Raises
    ------
    ValueError
        If there is none, it is finished, or there are choices: what is resumed keeps its own.
    """
    if choices:
        names = ", ".join(choices)
        raise ValueError(f"a resumed run keeps its own settings; leave out {names}")
    if folder is not None:
        kind = "series" if is_series(folder) else "run"
        if kind == "run":
            read_run(folder)
        if _is_done(folder):
            raise ValueError(f"the {kind} in {str(folder)!r} is finished")
        return folder
    env_id = env_id_of(task)
    records = [
        path
        for name in (SERIES_FILE, RUN_FILE)
        for path in out.glob(f"*/{name}")
        if read_json(path).get("env_id") == env_id and not _is_done(path.parent)
    ]
    if not records:
        raise ValueError(
            f"there is no unfinished training of {task} under {str(out)!r}; start one without --resume"
        )
    return max(records, key=lambda path: path.stat().st_mtime).parent


def _is_done(folder: Path) -> bool:
    """Whether a run or a series is finished."""
    return (folder / SEEDS_FILE).exists() if is_series(folder) else is_finished(folder)


def runs_of(folder: Path) -> dict[int, Path]:
    """The runs of a series by seed, or ``ValueError`` if the folder is not one's."""
    record = read_json(folder / SERIES_FILE)
    if not isinstance(record, dict) or not isinstance(record.get("seeds"), list):
        raise ValueError(f"{str(folder / SERIES_FILE)!r} is not a series'")
    return {int(seed): folder / f"seed{seed}" for seed in record["seeds"]}


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
    require_count("jobs", jobs)
    runs = runs_of(folder)
    unfinished = [place for place in runs.values() if not is_finished(place)]
    if jobs > 1 and len(unfinished) > 1:
        run_side_by_side(unfinished, jobs, progress=progress)
    else:
        for place in unfinished:
            run(place, progress=progress)
    result = _gathered(folder, runs)
    _draw(folder, runs, result)
    _write_means(folder / SEEDS_FILE, result)  # last: it marks the series as finished
    return result


def run_side_by_side(folders: Sequence[Path], jobs: int, *, progress: bool = True) -> None:
    """Finish runs, ``jobs`` of them at a time, each in a process of its own, under one bar; an interruption ends the processes.

    Their checkpoints stay.

    Raises
    ------
    RunError
        If a process fails: the others are ended too.
    """
    steps = {folder: read_run(folder).settings.steps for folder in folders}
    waiting = deque(folders)
    active: dict[Connection, tuple[Path, SpawnProcess]] = {}
    done = dict.fromkeys(folders, 0)
    bar = tqdm(total=sum(steps.values()), unit="step", unit_scale=True, disable=not progress)
    try:
        while waiting or active:
            while waiting and len(active) < jobs:
                folder = waiting.popleft()
                connection, process = _started(folder)
                active[connection] = (folder, process)
            ended = len(folders) - len(active) - len(waiting)
            bar.set_description(f"trainings done: {ended} of {len(folders)}", refresh=False)
            for ready in wait(list(active)):
                assert isinstance(ready, Connection)
                folder, process = active[ready]
                try:
                    done[folder] = ready.recv()
                except EOFError:
                    del active[ready]
                    _require_success(folder, process)
                    done[folder] = steps[folder]
            bar.update(sum(done.values()) - bar.n)
    finally:
        bar.close()
        for _, process in active.values():
            process.terminate()
        for _, process in active.values():
            process.join()


def _started(folder: Path) -> tuple[Connection, SpawnProcess]:
    # a fresh interpreter: torch and compiled threads do not survive a fork
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run_and_tell, args=(folder, sender), daemon=True)
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    return receiver, process


def _require_success(folder: Path, process: SpawnProcess) -> None:
    process.join()
    if process.exitcode != 0:
        raise RunError(
            f"the training in {str(folder)!r} ended with status {process.exitcode}; its own message is above, "
            "and --resume goes on with it"
        )


def _run_and_tell(folder: Path, sender: Connection) -> None:
    """The whole life of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's to decide
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that half-written files are removed
    run(folder, progress=False, report=lambda steps, _: sender.send(steps))


def seeds_table(result: SeriesResult) -> Table:
    """A table of one series: a metric to a row, with the median and the range over its seeds."""
    seeds = result.by_seed[0].seeds
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
    for each in result.by_seed:
        values = [each.median, min(each.means), max(each.means)]
        values += each.means if one_by_one else ()
        table.add_row(each.metric.replace("_", " "), *(f"{value:.4g}" for value in values))
    return table


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
        [SeedMeans(metric, tuple(runs), tuple(values)) for metric, values in own.items()],
        {
            metric: {agent: float(np.mean(found[metric])) for agent, found in means.items()}
            for metric in own
        },
    )


def _draw(folder: Path, runs: Mapping[int, Path], result: SeriesResult) -> None:
    training = read_run(next(iter(runs.values())))
    own = next(each for each in result.by_seed if each.metric == "return")
    words = f"{training.algorithm}, evaluated: {own.median:.1f}\n({min(own.means):.1f} to {max(own.means):.1f})"
    save_seeds_curves(
        [read_log(place) for place in runs.values()],
        training.algorithm,
        (words, own.median),
        result.others["return"],
        f"{training.algorithm.upper()} on {training.task}, {len(runs)} seeds",
        training.settings.steps,
        folder / CURVES_FILE,
    )


def _write_means(path: Path, result: SeriesResult) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    seeds = result.by_seed[0].seeds
    writer.writerow(("metric", "median", "lowest", "highest", *(f"seed{seed}" for seed in seeds)))
    for each in result.by_seed:
        row = (each.metric, each.median, min(each.means), max(each.means), *each.means)
        writer.writerow(row)
    write_text(path, text.getvalue())

"""One training repeated with several seeds: a run for each, in parallel if wanted, then their learning curves and a table of their results."""

from __future__ import annotations

import contextlib
import multiprocessing
import re
import signal
import sys
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.table import Table
from tqdm import tqdm

from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.files import locked, read_json, write_json, write_text
from lean_yaw_env.registration import ALL_ENV_IDS
from lean_yaw_env.reporting import uninterrupted, unraisable_hook
from lean_yaw_env.tables import csv_table
from lean_yaw_env.validation import require_choice, require_count

from ..evaluation.episodes import RETURN
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


class RunError(LeanYawError):
    """A run whose process failed; what it wrote stays and can be resumed."""


@dataclass(frozen=True)
class SeriesResult:
    """The results of a series.

    Attributes
    ----------
    seeds : of the trainings
    means : by metric, its mean over episodes for each seed's policy, in the order of ``seeds``; NaN where every episode left it undefined
    others : by metric and agent, the means of the other agents
    """

    seeds: tuple[int, ...]
    means: dict[str, list[float]]
    others: dict[str, dict[str, float]]

    def rows(self) -> list[tuple[Any, ...]]:
        """For each metric its name, the median, lowest and highest mean over the seeds, and each seed's mean."""
        return [
            (name, float(np.median(each)), min(each), max(each), *each)
            for name, each in self.means.items()
        ]


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from ``0-4`` (from, to), ``0,3,7`` or both; a single number is how many, from 0 on. ``ValueError`` for other texts and repeated seeds."""
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


def trainings_of(task: str, seeds: Sequence[int], choices: Mapping[str, Any]) -> list[Training]:
    """A training for each seed; ``choices`` are other arguments of ``Training.of_task``. The first alone evaluates the baselines too.

    Raises
    ------
    ValueError
        If a choice is bad.
    """
    return [
        Training.of_task(task, **{**choices, "seed": seed, "is_compared": seed == seeds[0]})
        for seed in seeds
    ]


def new_series(task: str, seeds: Sequence[int], out: Path, choices: Mapping[str, Any]) -> Path:
    """Make a folder under ``out`` with one run for each of ``trainings_of``."""
    trainings = trainings_of(task, seeds, choices)
    folder = new_folder(out, trainings[0], "seeds")
    make_series(trainings, folder)
    return folder


def make_series(trainings: Sequence[Training], folder: Path) -> None:
    """Make the folder of a series of trainings of different seeds, which must not exist."""
    for training in trainings:
        make_run(training, folder / f"seed{training.seed}")
    first, seeds = trainings[0], [training.seed for training in trainings]
    write_json(
        folder / SERIES_FILE, {"env_id": first.env_id, "algorithm": first.algorithm, "seeds": seeds}
    )


def is_series(folder: Path) -> bool:
    """Whether a folder is a series', rather than a run's."""
    return (folder / SERIES_FILE).exists()


def resumed(
    task: str, out: Path, folder: Path | None = None, choices: Mapping[str, Any] | None = None
) -> Path:
    """The folder of a run or a series to resume: the one given, or the newest unfinished one of the task under ``out``.

    Raises
    ------
    ValueError
        If there is none, it is finished, or there are ``choices``: a resumed run keeps its own settings.
    """
    if choices:
        names = ", ".join(choices)
        raise ValueError(f"a resumed run keeps its own settings; leave out {names}")
    if folder is not None:
        _env_id(folder)
        if _is_done(folder):
            raise ValueError(f"the training in {str(folder)!r} is finished")
        return folder
    env_id, records = env_id_of(task), list[Path]()
    for path in (*out.glob(f"*/{SERIES_FILE}"), *out.glob(f"*/{RUN_FILE}")):
        try:
            if _env_id(path.parent) == env_id and not _is_done(path.parent):
                records.append(path)
        except ValueError as error:
            print(f"left out: {error}", file=sys.stderr)
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
    return _read_series(folder)[1]


def _read_series(folder: Path) -> tuple[str, dict[int, Path]]:
    """The environment's id and the runs of a series."""
    record = read_json(folder / SERIES_FILE)
    try:
        env_id = require_choice("env_id", record["env_id"], ALL_ENV_IDS)
        seeds = [require_count("seed", each, 0, TRAINING_SEEDS - 1) for each in record["seeds"]]
        if not seeds or len(set(seeds)) < len(seeds):
            raise ValueError(f"seeds must be different, and one or more, got {seeds}")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{str(folder / SERIES_FILE)!r} is not a series': {error}") from error
    return env_id, {seed: folder / f"seed{seed}" for seed in seeds}


def _env_id(folder: Path) -> str:
    """The environment's id of a run or a series, or ``ValueError``."""
    return _read_series(folder)[0] if is_series(folder) else read_run(folder).env_id


def run_series(folder: Path, *, jobs: int = 1, progress: bool = True) -> SeriesResult:
    """Finish the unfinished runs of a series, one after the other or in ``jobs`` processes, and write curves and table.

    A run that fails does not stop the others.

    Raises
    ------
    ValueError
        If ``jobs`` is out of its range or a file is damaged.
    RunError
        If a run fails.
    BusyError
        If another process is at work in the folder.
    """
    require_count("jobs", jobs)
    runs = runs_of(folder)
    with locked(folder):
        unfinished = [place for place in runs.values() if not is_finished(place)]
        if jobs > 1 and len(unfinished) > 1:
            deque(run_side_by_side(unfinished, jobs, progress=progress), maxlen=0)
        else:
            _run_each(unfinished, progress)
        return finish_series(folder)


def _run_each(folders: Sequence[Path], progress: bool) -> None:
    failed: list[str] = []
    for folder in folders:
        try:
            run(folder, progress=progress)
        except (ValueError, LeanYawError) as error:
            failed.append(f"the training in {str(folder)!r} failed: {error}")
    if failed:
        raise RunError("; ".join(failed))


def finish_series(folder: Path) -> SeriesResult:
    """Draw and write what the finished runs of a series come to."""
    runs = runs_of(folder)
    result = _result(runs)
    training = read_run(next(iter(runs.values())))
    median, lowest, highest = next(row[1:4] for row in result.rows() if row[0] == RETURN)
    label = f"{training.algorithm}, evaluated: {median:.1f}\n({lowest:.1f} to {highest:.1f})"
    save_seeds_curves(
        [read_log(place) for place in runs.values()],
        training.algorithm,
        (label, median),
        result.others[RETURN],
        f"{training.algorithm.upper()} on {training.task}, {len(runs)} seeds",
        training.settings.steps,
        folder / CURVES_FILE,
    )
    titles = ("metric", "median", "lowest", "highest", *(f"seed{seed}" for seed in runs))
    # last: it marks the series as finished
    write_text(folder / SEEDS_FILE, csv_table(titles, result.rows()))
    return result


def run_side_by_side(
    folders: Sequence[Path], jobs: int, *, progress: bool = True
) -> Iterator[Path]:
    """Finish runs in ``jobs`` processes under one bar; yield the folder of each that is finished.

    A run that fails does not stop the others; an interruption ends all processes, and their checkpoints stay.

    Raises
    ------
    ValueError
        If ``jobs`` is out of its range.
    RunError
        If a run fails, after the others.
    """
    # fresh interpreters: torch and compiled threads do not survive a fork
    context = multiprocessing.get_context("spawn")
    done = context.Array("q", len(folders))
    earlier = multiprocessing.active_children()
    pool = ProcessPoolExecutor(require_count("jobs", jobs), context, _begin_process, (done,))
    bar = tqdm(total=sum(map(_steps, folders)), unit="step", unit_scale=True, disable=not progress)
    failed: list[str] = []
    try:
        with uninterrupted():
            waiting = {pool.submit(_run_in_process, *each): each[1] for each in enumerate(folders)}
        while waiting:
            bar.set_description(f"trainings done: {len(folders) - len(waiting)} of {len(folders)}", refresh=False)  # fmt: skip
            ended, _ = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
            bar.update(sum(done[:]) - bar.n)
            for future in ended:
                folder, error = waiting.pop(future), future.exception()
                if words := future.result() if error is None else repr(error):
                    failed.append(f"the training in {str(folder)!r} failed: {words}")
                else:
                    yield folder
        pool.shutdown()  # a process that is terminated while it ends prints a traceback
        if failed:
            raise RunError("; ".join(failed))
    finally:
        bar.close()
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            if process not in earlier:
                process.terminate()
                process.join()


def _steps(folder: Path) -> int:
    """Steps of a run; 0 of a damaged one, which its own process reports."""
    with contextlib.suppress(ValueError):
        return read_run(folder).settings.steps
    return 0


_done: Any = None
"""In a process of ``run_side_by_side``: the steps done of each run, shared with the others."""


def _begin_process(done: Any) -> None:
    global _done
    _done = done
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that half-written files are removed
    sys.unraisablehook = unraisable_hook(SystemExit)


def _run_in_process(index: int, folder: Path) -> str:
    """Finish a run; return what went wrong, or nothing."""

    def report(steps: int, recent: float) -> None:
        _done[index] = steps

    try:
        run(folder, progress=False, report=report)
    except (ValueError, OSError, LeanYawError) as error:
        return str(error)
    return ""


def seeds_table(result: SeriesResult) -> Table:
    """A table of one series: a metric to a row, with the median and the range over its seeds."""
    title = f"means over episodes of {len(result.seeds)} seeds' policies"
    table = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("metric", min_width=16)
    one_by_one = result.seeds if len(result.seeds) <= _MOST_COLUMNS else ()
    for name in ("median", "lowest", "highest", *(f"seed {seed}" for seed in one_by_one)):
        table.add_column(name, justify="right", no_wrap=True)
    for metric, *values in result.rows():
        shown = values[: 3 + len(one_by_one)]
        table.add_row(metric.replace("_", " "), *(f"{value:.4g}" for value in shown))
    return table


def _result(runs: Mapping[int, Path]) -> SeriesResult:
    """What the runs' evaluations say, side by side."""
    means: dict[str, dict[str, list[float]]] = {}
    for place in runs.values():
        try:
            for row in read_json(place / EVALUATION_FILE):
                mean = float("nan") if row["mean"] is None else float(row["mean"])
                means.setdefault(row["agent"], {}).setdefault(row["metric"], []).append(mean)
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"the evaluation in {str(place)!r} is damaged: {error}") from error
    own = means.pop(read_run(next(iter(runs.values()))).algorithm, {})
    if RETURN not in own or any(len(each) != len(runs) for each in own.values()):
        raise ValueError(
            f"the evaluations in {', '.join(map(str, runs.values()))} do not fit together"
        )
    others = {
        metric: {agent: float(np.mean(found[metric])) for agent, found in means.items()}
        for metric in own
    }
    return SeriesResult(tuple(runs), own, others)

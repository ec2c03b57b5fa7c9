"""How much of what can be saved each agent saves, and where it loses states that could be saved; ``python -m agents capture``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from lean_yaw_env.analysis import Choices, capture
from lean_yaw_env.analysis.attraction import require_plane, states_in
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.files import write_text
from lean_yaw_env.parameters import INTER_LEG_ANGLE, STATE_SIZE, Vector
from lean_yaw_env.rendering.figures import panels, save_figure
from lean_yaw_env.tables import csv_table
from lean_yaw_env.validation import require_count
from lean_yaw_env.walker import Walker

from ..agent import Agent
from .closed_loop_interface import closed_loop
from .closed_loop_report import axes_around_start, box_starts
from .row_tables import IMAGES

MOST_STEPS, SETTLE_STEPS = 2, 60
"""Chosen steps of the exhaustive search, and steps that the paper's controller then walks; an agent walks as many in all."""
PLANE = ("ankle_angle", "ankle_rate")
"""Of the picture."""
COLUMNS = (
    "task", "agent", "friction_limit", "starts", "n_steps", "can_be_saved", "saved_of_these", "saved_of_all", "saved_beyond"
)  # fmt: skip


@dataclass(frozen=True)
class CaptureReport:
    """What an agent saves of ``n`` starts in a box around the gait, and of ``points`` to a side in a plane through it.

    Attributes
    ----------
    task, agent : names
    friction_limit : float
    least_steps, plane_least_steps : shapes (n,) and (points, points)
        How few chosen steps save each start before the paper's controller walks on, ``MOST_STEPS`` + 1 where none do.
    is_saved, plane_is_saved : bool, the same shapes
        Whether the agent walks on from it.
    plane : (points,) values of each coordinate of the plane
    """

    task: str
    agent: str
    friction_limit: float
    least_steps: NDArray[np.int64]
    is_saved: NDArray[np.bool_]
    plane_least_steps: NDArray[np.int64]
    plane_is_saved: NDArray[np.bool_]
    plane: tuple[Vector, Vector]

    def can_be_saved(self, n_steps: int) -> float:
        """The share of the starts that so many chosen steps save, or fewer."""
        return float((self.least_steps <= n_steps).mean())

    def share(self, n_steps: int = MOST_STEPS) -> float:
        """The share of those that the agent saves; nan if there are none."""
        saved = self.is_saved[self.least_steps <= n_steps]
        return float(saved.mean()) if saved.size else float("nan")

    @property
    def saved_beyond(self) -> float:
        """The share of all starts that the agent saves though no ``MOST_STEPS`` chosen steps do."""
        return float((self.is_saved & (self.least_steps > MOST_STEPS)).mean())

    def rows(self) -> list[dict[str, str | float]]:
        """A row of ``COLUMNS`` for each number of chosen steps."""
        common = {"task": self.task, "agent": self.agent, "friction_limit": self.friction_limit, "starts": self.least_steps.size}  # fmt: skip
        of_all = {"saved_of_all": float(self.is_saved.mean()), "saved_beyond": self.saved_beyond}
        return [
            {**common, "n_steps": n, "can_be_saved": self.can_be_saved(n), "saved_of_these": self.share(n), **of_all}
            for n in range(MOST_STEPS + 1)
        ]  # fmt: skip


def examine_capture(
    name: str,
    agent: Agent,
    task: str,
    *,
    friction_limit: float | None = None,
    starts: int = 1024,
    points: int = 61,
) -> CaptureReport:
    """Hold an agent against the exhaustive search, from the same starts for every agent of a task.

    Without a friction limit the floor is the task's own. Commands are as many as the environment lets an agent choose from: its ranges, and the largest change of the offset in a step.

    Raises
    ------
    ValueError
        If the agent remembers or draws, or a number is out of its range.
    SolverError
        If the integrator fails.
    """
    require_count("starts", starts, 1, 1_000_000)
    require_count("points", points, 2, 2000)
    loop = closed_loop(agent, task, EnvOptions(friction_limit=friction_limit))
    axes = require_plane(loop, axes_around_start(loop, PLANE, points))
    plane = states_in(loop, axes, (slice(None), slice(None)), loop.start)
    everything = np.concatenate([box_starts(loop, starts), plane])
    walks = walk_many(loop, everything, MOST_STEPS + SETTLE_STEPS).require_solved()
    bare = np.ascontiguousarray(everything[:, :STATE_SIZE])
    least = _least_steps(loop.walker, task, bare.tobytes())
    shape = (points, points)
    return CaptureReport(
        task, name, loop.walker.parameters.friction_limit, least[:starts], walks.survived[:starts],
        least[starts:].reshape(shape), walks.survived[starts:].reshape(shape), (axes[PLANE[0]], axes[PLANE[1]]),
    )  # fmt: skip


@lru_cache(maxsize=16)
def _least_steps(walker: Walker, task: str, states: bytes) -> NDArray[np.int64]:
    """Of states (n, 5): the same for every agent of a task. Where only pumping drives the walker, the paper's controller pumps."""
    options, pumping = EnvOptions(), task_named(task).pumping
    angle, offset = options.inter_leg_angle_range, options.mass_offset_range
    choices = Choices(
        INTER_LEG_ANGLE + np.linspace(-angle, angle, 7),
        np.linspace(-offset, offset, 5),
        options.for_task(task_named(task)).max_offset_change,
    )
    starts = np.frombuffer(states).reshape(-1, STATE_SIZE)
    found = capture(
        walker, starts, choices, most_steps=MOST_STEPS, settle_steps=SETTLE_STEPS, mass_offset=(pumping, -pumping)
    )  # fmt: skip
    return found.least_steps


def write_captures(reports: Sequence[CaptureReport], out: Path) -> list[Path]:
    """Write capture.csv and a picture for each task and friction limit into a folder; return the paths."""
    (out / IMAGES).mkdir(parents=True, exist_ok=True)
    rows = ([row[name] for name in COLUMNS] for report in reports for row in report.rows())
    write_text(out / "capture.csv", csv_table(COLUMNS, rows))
    return [out / "capture.csv", *save_captures(reports, out / IMAGES)]


def save_captures(reports: Sequence[CaptureReport], images: Path) -> list[Path]:
    """Write a picture for each task and friction limit; return the paths."""
    paths: list[Path] = []
    for task, limit in dict.fromkeys((report.task, report.friction_limit) for report in reports):
        paths.append(images / picture_name(task, limit))
        these = [each for each in reports if (each.task, each.friction_limit) == (task, limit)]
        save_capture(these, paths[-1])
    return paths


def picture_name(task: str, limit: float | None = None) -> str:
    """The file of a task's picture for a friction limit, the task's own if none is given; ``capture_<task>.png`` without any."""
    if limit is None:
        limit = EnvOptions().walker_parameters(task_named(task)).friction_limit
    floor = "" if limit == float("inf") else f"_friction_{limit:g}"
    return f"capture_{task.lower()}{floor}.png"


def show(reports: Sequence[CaptureReport], notes: dict[str, str]) -> None:
    """Print what can be saved and how much of that each agent saves, and what is left out."""
    console = Console()
    table = Table(title="share saved by the agent of the starts that N chosen steps can save")
    for heading in ("task", "friction", "agent", *(f"N = {n}" for n in range(MOST_STEPS + 1)), "beyond", "of all"):  # fmt: skip
        table.add_column(
            heading, justify="left" if heading in ("task", "friction", "agent") else "right"
        )
    for report in reports:
        shares = [f"{report.share(n):.3f} of {report.can_be_saved(n):.3f}" for n in range(MOST_STEPS + 1)]  # fmt: skip
        table.add_row(
            report.task, f"{report.friction_limit:g}", report.agent, *shares, f"{report.saved_beyond:.3f}", f"{report.is_saved.mean():.3f}"
        )  # fmt: skip
    console.print(table)
    for what, why in notes.items():
        console.print(f"left out: {what}: {why}", markup=False, highlight=False, soft_wrap=True)


_KINDS = (
    ("falls; no two chosen steps save it", "#f2f2f2"),
    ("saved, as the paper's controller saves it", "#cfe3d4"),
    ("saved, as one or two chosen steps can", "#4c9a6a"),
    ("saved, though no two chosen steps can", "#2f6fb0"),
    ("lost, though the paper's controller saves it", "#7a1f1f"),
    ("lost, though one chosen step can save it", "#d9482b"),
    ("lost, though two chosen steps can save it", "#f4b183"),
)
"""What a point of the picture is, with its colour."""


def _kind(report: CaptureReport) -> NDArray[np.int64]:
    """The index in ``_KINDS`` of every point of the plane."""
    least, beyond = report.plane_least_steps, report.plane_least_steps > MOST_STEPS
    saved = np.where(beyond, 3, np.where(least == 0, 1, 2))
    return np.where(report.plane_is_saved, saved, np.where(beyond, 0, 4 + least))


def save_capture(reports: Sequence[CaptureReport], path: Path) -> None:
    """Draw where each agent of a task saves states of the plane and where it loses some that could be saved."""
    figure, places = panels(len(reports), 5, (2.7, 2.8), (0.8, 1.4), sharex=True, sharey=True)
    colours = ListedColormap([colour for _, colour in _KINDS])
    norm = BoundaryNorm(np.arange(len(_KINDS) + 1) - 0.5, len(_KINDS))
    for place, report in zip(places, reports, strict=True):
        x, y = report.plane
        place.pcolormesh(x, y, _kind(report).T, cmap=colours, norm=norm)
        place.plot(x.mean(), y.mean(), marker="+", color="black", markersize=9)
        can = report.plane_least_steps <= MOST_STEPS
        place.set_title(f"{report.agent}: {report.plane_is_saved[can].mean():.0%}")
        place.set(xlabel="ankle angle (rad)", ylabel="ankle rate (rad / time unit)")
        place.label_outer()
    limit = reports[0].friction_limit
    floor = "" if limit == float("inf") else f", friction limit {limit:g}"
    figure.suptitle(
        f"{reports[0].task}{floor}: share saved of what two chosen steps can save (+ the gait)"
    )
    handles = [Patch(facecolor=colour, edgecolor="0.4", label=text) for text, colour in _KINDS]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    save_figure(figure, path, dpi=110)

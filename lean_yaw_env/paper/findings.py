"""What this software finds beyond the paper: walking on the level, what chosen steps can save, stability over body, slope and step.

``lean-yaw findings`` computes it, and writes the page with its numbers and pictures.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lean_yaw_env.analysis import (
    Choices,
    capture_map,
    find_limit_cycle,
    refine_capture,
    section_map_of,
    stability_map,
)
from lean_yaw_env.analysis.attraction import require_plane, states_in
from lean_yaw_env.files import require_writable, write_text
from lean_yaw_env.paper.drawing import FAINT, STABLE_FACE, name_axes, picture_of
from lean_yaw_env.paper.report import write_columns
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.rendering.figures import new_figure
from lean_yaw_env.tables import markdown_table, read_csv
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    import xarray

FRICTION = 0.6
"""Ratio of tangential to normal force that a floor is taken to hold."""
CLIMBER = Walker(WalkerParameters(slope_turns=True))
"""On a slope that turns with the walker, so that balance is seen apart from the heading, which a controller must hold on a climb."""
SAVED = Walker(WalkerParameters(slope_turns=True, friction_limit=FRICTION))
STABILITY = {
    "slope": (0.003, 0.01, 0.03, 0.06),
    "foot_radius": (0.1, 0.3, 0.5, 0.7),
    "inter_leg_angle": (0.2, 0.3, 0.4, 0.5),
}
"""By parameter, its values at which stability is mapped over ankle tilt and hip width; the others are Table 1's."""
_SYMBOLS = {
    "slope": "slope",
    "foot_radius": "foot radius r =",
    "inter_leg_angle": "inter-leg angle",
}
CHOSEN_STEPS = 3
REACHES = {"stance_pitch": 0.1, "ankle_angle": 0.3, "stance_pitch_rate": 0.3, "ankle_rate": 0.8}
"""How far from the gait the states of the box lie, by coordinate; heading aside."""
PLANE = ("ankle_angle", "ankle_rate")
"""Coordinates of the slice."""
_SAVED_COLOURS = ("#2c7a4b", "#7dbb8b", "#d9b25f", "#d9743a", "#f2f2f2")
_BODY_COLOURS = ("#cccccc", "#ffffff", STABLE_FACE)
_RED = "#ff5a36"
_AGENTS = "## What learned policies save"
"""Where the section of the page begins whose numbers are the agents'."""


@dataclass(frozen=True)
class Findings:
    """All that is computed.

    Attributes
    ----------
    pumping : over inter-leg angle, slope and alternating offset; slopes below zero are climbs
    stability : by parameter, over that parameter, ankle tilt and hip width
    slice : least chosen steps over ankle angle and ankle rate
    box : least chosen steps over all four coordinates beside the heading
    resolution : number of commands, and the shares saved by 0, 1 and 2 chosen steps, at ever finer ones
    """

    pumping: xarray.Dataset
    stability: dict[str, xarray.Dataset]
    slice: xarray.Dataset
    box: xarray.Dataset
    resolution: tuple[tuple[int, tuple[float, ...]], ...]


def compute(*, size: float = 1.0, progress: bool = False) -> Findings:
    """Compute everything; with a smaller ``size`` on coarser grids."""

    def points(n: int) -> int:
        return max(3, round(size * n))

    section_map = section_map_of(SAVED)
    gait = find_limit_cycle(section_map).state

    def around(names: Iterable[str], n: int) -> dict[str, Vector]:
        return {
            name: gait[section_map.names.index(name)]
            + np.linspace(-REACHES[name], REACHES[name], n)
            for name in names
        }

    plane = require_plane(section_map, around(PLANE, points(15)))
    sample = states_in(section_map, plane, (slice(None), slice(None)), gait)
    coarse = Choices(np.linspace(0.15, 0.45, 3), np.linspace(-0.05, 0.05, 3))
    levels = refine_capture(SAVED, sample, coarse, most_levels=3, tolerance=0.0)
    pumping = {
        "inter_leg_angle": np.linspace(0.1, 0.6, points(11)),
        "slope": np.linspace(-0.06, 0.01, points(71)),
        "alternating_offset": np.linspace(0.002, 0.08, points(53)),
    }
    body = {
        "ankle_tilt": np.linspace(0.05, 1.3, points(64)),
        "hip_width": np.linspace(0.0, 0.6, points(61)),
    }
    return Findings(
        stability_map(CLIMBER, pumping, progress=progress),
        {
            name: stability_map(Walker(), {name: np.array(values), **body}, progress=progress)
            for name, values in STABILITY.items()
        },
        capture_map(SAVED, around(PLANE, points(41)), most_steps=CHOSEN_STEPS, progress=progress),
        capture_map(SAVED, around(REACHES, points(7)), most_steps=2, progress=progress),
        tuple((len(choices.commands), tuple(found.share(n) for n in range(3))) for choices, found in levels),
    )  # fmt: skip


def climbs(pumping: xarray.Dataset) -> dict[str, Vector]:
    """The steepest climb at each inter-leg angle, rad; nan where there is none: of any gait, of a stable one, and of one that a floor holds."""
    has_gait = pumping.status == 1
    stable = is_stable(pumping)
    on_floor = stable & (pumping.greatest_friction <= FRICTION)
    found = {"gait": has_gait, "stable": stable, "friction": on_floor}
    return {
        name: (-pumping.slope.where(where).min(("slope", "alternating_offset"))).to_numpy()
        for name, where in found.items()
    }


def is_stable(data: xarray.Dataset) -> xarray.DataArray:
    """Where a map has a stable gait."""
    return (data.status == 1) & (data.spectral_radius < 1.0)


def share_saved(least: Any, n_steps: int) -> float:
    """The share of a slice or box that so many chosen steps save, or fewer."""
    return float((least <= n_steps).mean())


def numbers(found: Findings) -> dict[str, tuple[float, str]]:
    """Every number of the page by name, with its meaning."""
    pumping, stability = found.pumping, found.stability
    angles = pumping.inter_leg_angle.to_numpy()
    rows: dict[str, tuple[float, str]] = {}

    def note(name: str, value: Any, meaning: str) -> None:
        rows[name] = float(value), meaning

    words = {
        "gait": "with a gait", "stable": "with a gait that balances itself",
        "friction": f"with a gait that balances itself at friction {FRICTION}",
    }  # fmt: skip
    for name, climb in climbs(pumping).items():
        best = int(np.nanargmax(climb))
        note(f"climb_{name}", climb[best], f"steepest climb {words[name]}, rad")
        note(f"climb_{name}_angle", angles[best], "inter-leg angle there, rad")
    level = pumping.sel(slope=0.0, method="nearest")
    held = is_stable(level)
    on_floor = held & (level.greatest_friction <= FRICTION)
    for name, where in (("stable", held), ("friction", on_floor)):
        speed = level.speed.where(where)
        note(f"level_speed_{name}", speed.max(), f"greatest speed on the level, {name}")
    force = level.least_normal_force.where(held).min()
    note("level_least_force", force, "least normal force of these gaits on the level, weights")
    usual = level.sel(inter_leg_angle=0.3, method="nearest")
    offsets = usual.alternating_offset.where(usual.status == 1)
    meaning = "least alternating offset with a gait on the level at inter-leg angle 0.3"
    note("level_least_offset", offsets.min(), meaning)
    note("level_greatest_offset", offsets.max(), "greatest one")
    shares = "share of tilts and widths that are stable at"
    for name in ("foot_radius", "inter_leg_angle"):
        for k, value in enumerate(STABILITY[name]):
            share = is_stable(stability[name].isel({name: k})).mean()
            note(f"stable_share_{name}_{value:g}", share, f"{shares} {name} {value:g}")
    for k, slope in enumerate(STABILITY["slope"]):
        here = stability["slope"].isel(slope=k)
        stable, at = is_stable(here), f"slope {slope:g}"
        note(f"stable_share_{slope:g}", stable.mean(), f"{shares} {at}")
        width, tilt = here.hip_width.where(stable).max(), here.ankle_tilt.where(stable).min()
        note(f"stable_width_{slope:g}", width, f"widest stable hip at {at}")
        note(f"stable_tilt_{slope:g}", tilt, f"least stable ankle tilt at {at}, rad")
    for part, steps, data in (("slice", CHOSEN_STEPS, found.slice), ("box", 2, found.box)):
        for n in range(steps + 1):
            saved = share_saved(data.least_steps, n)
            note(f"{part}_{n}", saved, f"share of the {part} that {n} chosen steps save")
    for commands, saves in found.resolution:
        for n, saved in enumerate(saves):
            meaning = f"share that {n} chosen of {commands} commands save"
            note(f"resolution_{commands}_{n}", saved, meaning)
    return rows


def draw_pumping(pumping: xarray.Dataset) -> Any:
    """Speed over climb and offset at one inter-leg angle, and the steepest climbs over all angles."""
    figure = new_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    here = pumping.sel(inter_leg_angle=0.3, method="nearest")
    climb, offset = -here.slope.to_numpy(), here.alternating_offset.to_numpy()
    mesh = left.pcolormesh(offset, climb, here.speed, cmap="viridis", shading="nearest")
    figure.colorbar(mesh, ax=left, label="speed")
    unstable = (here.spectral_radius >= 1.0).to_numpy()
    row, column = np.nonzero(unstable)
    left.plot(offset[column], climb[row], "w.", markersize=3)
    left.plot([], [], "w.", label="does not balance itself")
    left.contour(
        offset, climb, here.greatest_friction, levels=[FRICTION], colors=[_RED], linewidths=1.8
    )
    left.plot(
        [], [], color=_RED, linewidth=1.8, label=f"friction demand {FRICTION}: less to the left"
    )
    left.axhline(0.0, color="k", linewidth=0.8, linestyle=":")
    left.text(0.069, 0.0005, "level", ha="right", va="bottom", fontsize=9)
    left.text(0.003, 0.022, "too slow for the\nswing foot to come down", fontsize=9)
    left.text(0.069, 0.02, "the foot lifts off", ha="right", fontsize=9)
    left.set_xlim(0.0, 0.07)
    left.legend(loc="upper left", fontsize=8.5, facecolor="0.75")
    name_axes(left, "offset away from the stance foot", "climb (rad)", title="inter-leg angle 0.3")
    angles = pumping.inter_leg_angle.to_numpy()
    styles = {
        "gait": (FAINT, "--", "any gait"), "stable": ("k", "-", "that balances itself"),
        "friction": (_RED, "-", f"at a friction demand below {FRICTION} as well"),
    }  # fmt: skip
    for name, steepest in climbs(pumping).items():
        colour, style, label = styles[name]
        right.plot(angles, steepest, color=colour, linestyle=style, marker=".", label=label)
    right.axhline(0.0, color="k", linewidth=0.8, linestyle=":")
    right.legend(fontsize=9, frameon=False, loc="upper right")
    right.set_ylim(top=0.065)
    name_axes(right, "inter-leg angle (rad)", "steepest climb (rad)", title="over all offsets")
    return figure


def draw_stability(stability: dict[str, xarray.Dataset]) -> Any:
    """Where the walker is stable over ankle tilt and hip width: a line of pictures for each further parameter."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    figure = new_figure(11.0, 8.4)
    grid = figure.subplots(len(STABILITY), 4, sharex=True, sharey=True)
    for line, (name, data) in zip(grid, stability.items(), strict=True):
        tilt, width = data.ankle_tilt.to_numpy(), data.hip_width.to_numpy()
        for k, (axes, value) in enumerate(zip(line, STABILITY[name], strict=True)):
            here = data.isel({name: k})
            kind = np.where(here.status == 1, np.where(is_stable(here), 2.0, 1.0), 0.0)
            colours = ListedColormap(_BODY_COLOURS)
            axes.pcolormesh(tilt, width, kind.T, cmap=colours, vmin=0.0, vmax=2.0)
            axes.plot(0.55, 0.3, "k*", markersize=8)
            below = "ankle tilt α (rad)" if name == list(STABILITY)[-1] else ""
            title = f"{_SYMBOLS[name]} {value:g}"
            name_axes(axes, below, "hip width d" if k == 0 else "", title=title)
    words = ("no gait", "a gait that is not stable", "a stable gait")
    handles: list[Any] = [Patch(facecolor=c, edgecolor="0.5", label=t) for c, t in zip(_BODY_COLOURS, words, strict=True)]  # fmt: skip
    handles += grid[0, 0].plot([], [], "k*", markersize=8, label="Table 1's tilt and width")
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def draw_capture(found: Findings) -> Any:
    """How few chosen steps save each state of the slice, and how the sets grow with the number of commands."""
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    figure = new_figure(11.0, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    data = found.slice
    x, y = (data[str(name)].to_numpy() for name in data.least_steps.dims)
    words = ("none", "one", "two", "three", "more, or lost")
    norm = BoundaryNorm(np.arange(len(words) + 1) - 0.5, len(words))
    left.pcolormesh(
        x, y, data.least_steps.T, cmap=ListedColormap(_SAVED_COLOURS), norm=norm, shading="nearest"
    )
    left.plot(x.mean(), y.mean(), "k+", markersize=10)
    handles = [
        Patch(facecolor=colour, edgecolor="0.5", label=text)
        for colour, text in zip(_SAVED_COLOURS, words, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
    title = "chosen steps needed (+ the gait)"
    name_axes(left, "ankle angle (rad)", "ankle rate (rad / time unit)", title=title)
    commands = [each for each, _ in found.resolution]
    for n, colour in enumerate(_SAVED_COLOURS[:3]):
        shares = [each[n] for _, each in found.resolution]
        right.plot(commands, shares, color=colour, marker="o", linewidth=2.0)
        right.annotate(f"{words[n]}", (commands[-1], shares[-1]), (6, 0), textcoords="offset points", va="center")  # fmt: skip
    right.set_xscale("log")
    right.set_xticks(commands, [str(each) for each in commands])
    right.minorticks_off()
    right.set_xlim(commands[0] * 0.9, commands[-1] * 1.6)
    right.set_ylim(0.0, 1.0)
    name_axes(right, "commands to choose from at each step", "share saved", title="growth with the resolution")  # fmt: skip
    return figure


PICTURES = {
    "pumping": lambda found: draw_pumping(found.pumping),
    "stability": lambda found: draw_stability(found.stability),
    "capture": draw_capture,
}
"""By the end of the file's name: what draws it."""


def write_findings(folder: Path, *, size: float = 1.0, progress: bool = False) -> Path:
    """Compute everything and write findings.md, findings.csv and images/findings_*.png; return the page's path.

    The section about agents takes its numbers from capture.csv in the folder, which ``python -m agents capture`` writes.
    """
    require_writable(folder / "images")
    found = compute(size=size, progress=progress)
    rows = numbers(found)
    values, meanings = zip(*rows.values(), strict=True)
    write_columns(
        folder / "findings.csv", {"name": list(rows), "value": values, "meaning": meanings}
    )
    for name, draw in PICTURES.items():
        picture_of(draw(found))(folder / "images" / f"findings_{name}.png")
    write_text(folder / "findings.md", page(folder))
    return folder / "findings.md"


def page(folder: Path) -> str:
    """The page, every number of it from findings.csv and, where there is one, capture.csv in a folder."""
    values = {row["name"]: float(row["value"]) for row in read_csv(folder / "findings.csv")}
    text = Path(__file__).with_name("findings.txt").read_text(encoding="utf-8")
    own, agents = text.split(_AGENTS)
    # names with points cannot stand in a format string as they are
    filled = own.format(**{name.replace(".", "_"): value for name, value in values.items()})
    if not (folder / "capture.csv").exists():
        return filled.rstrip() + "\n"
    rows = read_csv(folder / "capture.csv")
    shares = {
        "_".join((row["task"], row["agent"], row["friction_limit"].replace(".", "_"), key)): float(row[key])
        for row in rows
        for key in ("can_be_saved", "saved_of_these", "saved_of_all", "saved_beyond")
        if row["n_steps"] == "2"
    }  # fmt: skip
    return filled + _AGENTS + agents.format(agents=_agents(rows), **shares)


def _agents(rows: list[dict[str, str]]) -> str:
    """A table in Markdown of what agents save of what can be saved."""
    titles = ("task", "friction limit", "agent", "needs no step", "one step", "two steps", "beyond two", "of all starts")  # fmt: skip
    lines = []
    for first, *others in zip(rows[::3], rows[1::3], rows[2::3], strict=True):
        of_these = ((float(row["saved_of_these"]), float(row["can_be_saved"])) for row in (first, *others))  # fmt: skip
        shares = [f"{saved:.1%} of {can:.1%}" for saved, can in of_these]
        limit = first["friction_limit"].replace("inf", "none")
        rest = [f"{float(first[key]):.1%}" for key in ("saved_beyond", "saved_of_all")]
        lines.append([first["task"], limit, first["agent"], *shares, *rest])
    return markdown_table(titles, lines)

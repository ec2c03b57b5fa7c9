"""The subcommands of ``lean-yaw``."""

from __future__ import annotations

import math
import sys
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from lean_yaw_env import plots
from lean_yaw_env.cli import records
from lean_yaw_env.cli.commands import Output, add_command, parse_axes, parse_range
from lean_yaw_env.engine import Engine
from lean_yaw_env.parameters import Vector
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.reporting import NOTHING, keep
from lean_yaw_env.validation import require_count, require_text
from lean_yaw_env.walker import Walker

app = typer.Typer(
    name="lean-yaw",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Walkers, bicycles and skateboards that balance by coupling lean to yaw; after Wisse and "
    "Schwab (2005). Walkers are dimensionless (leg length, gravity, mass one), vehicles in SI units; "
    "angles are in radians.",
)
command = partial(add_command, app)

InterLegAngle = Annotated[
    float, typer.Option(help="Angle at which the swing leg is held in front, (0, pi/2).")
]
MassOffset = Annotated[
    float, typer.Option(help="Both masses moved along the axle, to the right, [-1, 1].")
]
Out = Annotated[
    str | None,
    typer.Option(
        help="Keep the whole result here and resume from it: a netCDF file (.nc), or a Zarr store's folder or URL, which may be larger than the memory."
    ),
]
Threads = Annotated[int, typer.Option(help="Of this process.")]
Workers = Annotated[
    int | None, typer.Option(help="So many processes of this machine, by Dask, instead of threads.")
]
Scheduler = Annotated[
    str | None,
    typer.Option(help="Address of a Dask scheduler, whose workers do the work: tcp://host:8786."),
]
_MANY_POINTS = 10_000
"""A map of more points says beforehand what it costs, and prints counts and ranges only."""


def _shows_progress(engine: Engine) -> bool:
    return sys.stderr.isatty() or not engine.is_local


Speeds = Annotated[str, typer.Option(help="Speeds in m/s: a number or low:high:count.")]


@command(draws=True)
def gait(
    walker: Walker | PassiveWalker,
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    alternating_offset: Annotated[
        float,
        typer.Option(
            help="Added while the left foot stands, taken away on the right one: pumping."
        ),
    ] = 0.0,
) -> Output:
    """Find a walker's limit cycle and print it with its multipliers; the defaults are Table 1's."""
    from lean_yaw_env.analysis import find_limit_cycle

    offsets = mass_offset + alternating_offset, mass_offset - alternating_offset
    cycle = find_limit_cycle(walker, inter_leg_angle=inter_leg_angle, mass_offset=offsets)
    record = records.gait_record(cycle)
    return Output(record, lambda: records.show_gait(record), lambda: plots.gait_figure(cycle))


@command("map", draws=True)
def stability(
    walker: Walker | PassiveWalker,
    axis: Annotated[
        list[str],
        typer.Argument(
            help="One to six axes name=low:high:count: hip_width, foot_radius, ankle_tilt, "
            "slope, ankle_stiffness, ankle_damping, inter_leg_angle, mass_offset, "
            "alternating_offset."
        ),
    ],
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    threads: Threads = 1,
    workers: Workers = None,
    scheduler: Scheduler = None,
    out: Out = None,
) -> Output:
    """Find the gait and its stability at every point of a grid of parameters."""
    from lean_yaw_env.analysis import map_cost, stability_map

    axes, engine = parse_axes(axis), Engine(threads, workers, scheduler)
    points = math.prod(values.size for values in axes.values())
    command = {"inter_leg_angle": inter_leg_angle, "mass_offset": mass_offset}
    if points > _MANY_POINTS:
        size, seconds = map_cost(walker, axes, **command)
        typer.echo(
            f"{points:,} points: about {size / 1e9:.2g} GB and {seconds / 60.0:.2g} minutes of one core",
            err=True,
        )
    data = stability_map(
        walker, axes, path=out, engine=engine, progress=_shows_progress(engine), **command
    )
    summary = records.grid_summary(data, "gait", ("speed", "spectral_radius"))
    rows = records.map_records(data) if points <= _MANY_POINTS else []
    return Output(
        {**summary, "points": rows},
        lambda: records.show_grid("points", "gait", summary, rows),
        lambda: plots.map_figure(data),
    )


@command()
def atlas(
    out: Annotated[str, typer.Option(help="Zarr store's folder or URL; resumes from it.")],
    axis: Annotated[
        list[str] | None,
        typer.Argument(help="Other values of an axis than the atlas's: name=low:high:count."),
    ] = None,
    every: Annotated[
        int, typer.Option(help="Basins at each so-many-th value of an axis only.")
    ] = 3,
    threads: Threads = 1,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> Output:
    """Find the gaits of ten million designs, and basins on a coarser grid: slope, inter-leg angle, foot radius, hip width, ankle tilt."""
    from lean_yaw_env.analysis import DESIGNS, Atlas, basin_sizes, stability_map

    require_text("out", out)
    require_count("every", every)
    axes, engine = {**DESIGNS, **parse_axes(axis or [])}, Engine(threads, workers, scheduler)
    shown = _shows_progress(engine)
    gaits = stability_map(Walker(), axes, path=f"{out}/gaits.zarr", engine=engine, progress=shown)
    basins = basin_sizes(
        gaits, every=every, path=f"{out}/basins.zarr", engine=engine, progress=shown
    )
    summary = records.grid_summary(gaits, "gait", ("speed", "greatest_friction"))
    fastest = Atlas(gaits, basins).fastest_stable()

    def show() -> None:
        records.show_grid("designs", "gait", summary, [])
        records.show_pairs("the fastest stable design", fastest)

    return Output({**summary, "fastest_stable": fastest}, show)


@command(draws=True)
def basin(
    walker: Walker | PassiveWalker,
    x: Annotated[str, typer.Argument(help="Coordinate of the section as name=low:high:count.")],
    y: Annotated[str, typer.Argument(help="Another one.")],
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    steps: Annotated[int, typer.Option(help="A walk of so many steps counts as survived.")] = 60,
    threads: Threads = 1,
    workers: Workers = None,
    scheduler: Scheduler = None,
    out: Out = None,
) -> Output:
    """Walk from every point of a plane of the section through the gait: what it survives."""
    from lean_yaw_env.analysis import basin as basin_of

    engine = Engine(threads, workers, scheduler)
    first, second = parse_axes([x, y]).items()
    data = basin_of(
        walker,
        first,
        second,
        n_steps=steps,
        inter_leg_angle=inter_leg_angle,
        mass_offset=mass_offset,
        path=out,
        engine=engine,
        progress=_shows_progress(engine),
    )
    summary = records.grid_summary(data, "ending", ("steps",))
    rows = records.basin_records(data) if data["ending"].size <= _MANY_POINTS else []
    return Output(
        {**summary, "starts": rows},
        lambda: records.show_grid("starts", "ending", summary, rows),
        lambda: plots.basin_figure(data),
    )


@command(draws=True)
def bicycle(
    speeds: Speeds = "0:10:11",
    benchmark: Annotated[
        bool, typer.Option("--benchmark", help="The 2007 benchmark bicycle instead of the paper's.")
    ] = False,
    parameters: Annotated[
        Path | None,
        typer.Option(
            help="JSON file of your bicycle's parameters, by the names of BicycleParameters; those it "
            "does not give are the benchmark's."
        ),
    ] = None,
) -> Output:
    """Eigenvalues of the uncontrolled bicycle by mode, and the speeds that matter."""
    from lean_yaw_env.files import read_json
    from lean_yaw_env.vehicles import (
        BENCHMARK_2007,
        benchmark_bicycle,
        follow_eigenvalues,
        paper_bicycle,
    )

    if benchmark and parameters is not None:
        raise ValueError("give --benchmark or --parameters, not both")
    given = read_json(parameters) if parameters is not None else {}
    vehicle = benchmark_bicycle(changed(BENCHMARK_2007, given, str(parameters)))
    if not benchmark and parameters is None:
        vehicle = paper_bicycle()
    grid = parse_range(speeds, "speeds")
    record = records.bicycle_record(vehicle, follow_eigenvalues(vehicle, grid))

    def figure() -> Any:
        fine = follow_eigenvalues(vehicle, finer(grid))
        stable = record["stable_speeds"]
        return plots.eigenvalue_figure(fine.speeds, fine.names, fine.eigenvalues, stable)

    return _vehicle(record, figure)


def changed(value: Any, changes: Any, place: str) -> Any:
    """A dataclass with some fields changed, those that are dataclasses themselves in the same way; ``place`` is where the changes are from.

    Raises
    ------
    ValueError
        If ``changes`` is no mapping or has a name that is no field; from the dataclass, if a value is outside its range.
    """
    if not isinstance(changes, dict):
        raise ValueError(f"{place} must be an object of names and values, got {changes!r}")
    names = [field.name for field in fields(value)]
    new = {}
    for name, change in changes.items():
        if name not in names:
            raise ValueError(f"{place} has the name {name!r}, which is none of {', '.join(names)}")
        old = getattr(value, name)
        new[name] = changed(old, change, f"{name} of {place}") if is_dataclass(old) else change
    return replace(value, **new)


@command(draws=True)
def skateboard(
    mass: Annotated[float, typer.Option(help="Of the rider, kg.")] = 70.0,
    rider_height: Annotated[float, typer.Option(help="Of the rider's centre of mass, m.")] = 1.0,
    wheelbase: Annotated[float, typer.Option(help="Between front and rear wheels, m.")] = 0.4,
    steering_tilt: Annotated[
        float, typer.Option(help="Of the steering axes from the vertical, rad, (0, pi/2).")
    ] = math.pi / 4,
    spring_stiffness: Annotated[float, typer.Option(help="Of each axis, N m / rad.")] = 150.0,
    damping: Annotated[float, typer.Option(help="Of each axis, N m s / rad.")] = 0.0,
    gravity: Annotated[float, typer.Option(help="m / s^2.")] = 9.81,
    speeds: Speeds = "0:4:9",
) -> Output:
    """Critical speed and eigenvalues of the skateboard with a stiff rider."""
    from lean_yaw_env.vehicles import Skateboard, stable_speed_range

    board = Skateboard(
        mass, rider_height, wheelbase, steering_tilt, spring_stiffness, gravity, damping
    )
    grid = parse_range(speeds, "speeds")
    values, stable = board.eigenvalues(finer(grid)), stable_speed_range(board)
    return _vehicle(
        records.skateboard_record(board, grid),
        lambda: plots.eigenvalue_figure(finer(grid), ("first", "second"), values, stable),
    )


def finer(speeds: Vector) -> Vector:
    """Speeds over the same range, close enough for a picture."""
    return np.union1d(speeds, np.linspace(speeds[0], speeds[-1], 501))


def _vehicle(record: records.Record, figure: Any) -> Output:
    """A vehicle's special speeds and its eigenvalues."""

    def show() -> None:
        records.show_pairs("speeds, m/s", record)
        records.show_records("eigenvalues, 1/s", record["eigenvalues"])

    return Output(record, show, figure)


@command()
def play(
    env_id: Annotated[str, typer.Argument(help="An environment, such as LeanYaw/Heading-v1.")],
    speed: Annotated[float, typer.Option(help="Times real time for legs of a metre.")] = 0.5,
    seed: Annotated[int | None, typer.Option(help="Of the first episode.")] = None,
) -> Output:
    """Steer the walker in a window: a and d move the masses left and right, w and s walk faster and slower."""
    import gymnasium as gym
    from gymnasium.utils.play import play as play_env

    from lean_yaw_env.envs import RealTime

    try:
        env = gym.make(env_id, render_mode="rgb_array", mirror=False)
    except (gym.error.Error, TypeError) as error:
        raise ValueError(f"env_id must be an environment of lean_yaw_env: {error}") from error
    window = RealTime(env, speed=speed)
    still = np.zeros(env.action_space.shape or (), dtype=np.float32)
    return Output({"env_id": env_id}, lambda: play_env(window, seed=seed, noop=still))


@command()
def view(
    walk: Annotated[Path | None, typer.Option(help="Show this walk, saved with Walk.save.")] = None,
    task: Annotated[str | None, typer.Option(help="Show this task, such as Slalom.")] = None,
    agent: Annotated[
        list[str] | None,
        typer.Option(
            help="Who walks it: ppo or another trained agent, fixed, or you. Several race when it is given several times."
        ),
    ] = None,
    agent_path: Annotated[
        Path | None,
        typer.Option(help="Folder with a policy of your own training, which walks its task."),
    ] = None,
    port: Annotated[int, typer.Option(help="Of this machine; 0 takes a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> Output:
    """Show the walkers in the browser, computed there by the package's own kernel; served to this machine only."""
    from lean_yaw_env.viewer import view as view_page

    server = view_page(
        walk, task=task, agents=agent or (), policy=agent_path, port=port, open_browser=browser
    )

    def serve() -> None:
        typer.echo(f"the page is at {server.address} until Ctrl-C")
        try:
            server.wait()
        finally:
            server.close()

    return Output({"address": server.address}, serve)


@command()
def findings(
    out: Annotated[Path, typer.Option(help="Folder for findings.md, findings.csv and images.")],
) -> Output:
    """Compute what this software finds beyond the paper: walking on the level, stability over bodies, what chosen steps can save."""
    from lean_yaw_env.paper.findings import write_findings

    keep(NOTHING)  # before all of it is there
    page = write_findings(out, progress=sys.stderr.isatty())
    return Output({"page": str(page)}, lambda: typer.echo(f"written: {page}"))


@command()
def reproduce(
    names: Annotated[
        list[str],
        typer.Argument(
            help="'all' of the paper, 'classics' of other publications, or pieces: table1 to table3, "
            "figure3, figure4, figure7 to figure15, walker, skateboard, claims-passive, claims-active, "
            "claims-steering; simplest-walker, rolling-wheels, uneven-ground, bicycle-benchmark, "
            "steering-robots."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for report, pictures and numbers.")],
) -> Output:
    """Compute published tables, figures and claims anew and set them beside the printed ones."""
    from lean_yaw_env.paper import reproduce as reproduce_pieces
    from lean_yaw_env.paper import write_report

    reproduction = reproduce_pieces(names, out, progress=True)
    markdown, page = write_report(reproduction, out)

    def show() -> None:
        records.show_reproduction(reproduction)
        typer.echo(f"written: {markdown} and {page}")

    return Output({"counts": reproduction.counts(), "checks": reproduction.rows()}, show)

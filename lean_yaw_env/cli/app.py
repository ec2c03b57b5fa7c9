"""The subcommands of ``lean-yaw``."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from lean_yaw_env.cli import rows, screen
from lean_yaw_env.cli.axes import parse_axes, parse_range
from lean_yaw_env.cli.walkers import walker_of
from lean_yaw_env.errors import LeanYawError

app = typer.Typer(
    name="lean-yaw",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Walkers, bicycles and skateboards that balance by coupling lean to yaw; after Wisse and "
    "Schwab (2005). Walkers are dimensionless (leg length, gravity, mass one), vehicles in SI units; "
    "angles are in radians.",
)

Result = TypeVar("Result")
WRONG_INPUT, NO_RESULT = 2, 1

HipWidth = Annotated[float, typer.Option(help="Distance between the hips, [0, 2].")]
FootRadius = Annotated[float, typer.Option(help="Radius of the cylinder feet, [0, 1).")]
AnkleTilt = Annotated[float, typer.Option(help="Angle of the ankle axis from the leg, (0, pi/2].")]
Slope = Annotated[float, typer.Option(help="Slope angle, [-0.5, 0.5].")]
InterLegAngle = Annotated[
    float, typer.Option(help="Angle at which the swing leg is held in front, (0, pi/2).")
]
MassOffset = Annotated[
    float, typer.Option(help="Both masses moved along the axle, to the right, [-1, 1].")
]
AlternatingOffset = Annotated[
    float,
    typer.Option(help="Added while the left foot stands, taken away on the right one: pumping."),
]
Passive = Annotated[bool, typer.Option("--passive", help="Let the swing leg swing freely.")]
Planar = Annotated[
    bool, typer.Option("--planar", help="Passive walker in the plane: no heading, no ankle.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")]
Out = Annotated[
    Path | None, typer.Option(help="Keep the whole result in this netCDF file; resumes from it.")
]
Speeds = Annotated[str, typer.Option(help="Speeds in m/s: a number or low:high:count.")]


def reporting_errors(command: Callable[..., Result]) -> Callable[..., Result]:
    """Print an error in a line instead of a traceback.

    Exits with 2 where a value is wrong and with 1 where there is no result, such as no gait.
    """

    @wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Result:
        try:
            return command(*args, **kwargs)
        except (ValueError, OverflowError, OSError) as error:
            typer.echo(f"lean-yaw: {error}", err=True)
            raise typer.Exit(WRONG_INPUT) from error
        except (LeanYawError, ImportError) as error:
            typer.echo(f"lean-yaw: {error}", err=True)
            raise typer.Exit(NO_RESULT) from error

    return wrapped


@app.command()
@reporting_errors
def gait(
    hip_width: HipWidth = 0.3,
    foot_radius: FootRadius = 0.5,
    ankle_tilt: AnkleTilt = 0.55,
    slope: Slope = 0.01,
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    alternating_offset: AlternatingOffset = 0.0,
    passive: Passive = False,
    planar: Planar = False,
    as_json: AsJson = False,
) -> None:
    """Find a walker's limit cycle and print it with its multipliers; the defaults are Table 1's."""
    from lean_yaw_env.analysis import find_limit_cycle, section_map_of

    walker = walker_of(hip_width, foot_radius, ankle_tilt, slope, passive=passive, planar=planar)
    command: dict[str, Any] = {
        "inter_leg_angle": inter_leg_angle,
        "mass_offset": (mass_offset + alternating_offset, mass_offset - alternating_offset),
    }
    cycle = find_limit_cycle(walker, **command)
    record = rows.gait_record(cycle, section_map_of(walker, **command).names)
    if as_json:
        typer.echo(rows.as_json(record))
        return
    screen.show_gait(record)


@app.command("map")
@reporting_errors
def stability(
    axis: Annotated[
        list[str],
        typer.Argument(
            help="One to three axes name=low:high:count: hip_width, foot_radius, ankle_tilt, "
            "slope, ankle_stiffness, ankle_damping, inter_leg_angle, mass_offset, "
            "alternating_offset."
        ),
    ],
    hip_width: HipWidth = 0.3,
    foot_radius: FootRadius = 0.5,
    ankle_tilt: AnkleTilt = 0.55,
    slope: Slope = 0.01,
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    passive: Passive = False,
    planar: Planar = False,
    threads: Annotated[int, typer.Option(help="Of the compiled code.")] = 1,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Find the gait and its stability at every point of a grid of parameters."""
    from lean_yaw_env.analysis import stability_map

    axes = parse_axes(axis)
    data = stability_map(
        walker_of(hip_width, foot_radius, ankle_tilt, slope, passive=passive, planar=planar),
        axes,
        inter_leg_angle=inter_leg_angle,
        mass_offset=mass_offset,
        path=out,
        threads=threads,
        progress=sys.stderr.isatty(),
    )
    records = rows.map_records(data, axes)
    if as_json:
        typer.echo(rows.as_json({"counts": rows.count_by(records, "gait"), "points": records}))
        return
    screen.show_pairs("gaits", rows.count_by(records, "gait"))
    screen.show_records("points", records)


@app.command()
@reporting_errors
def basin(
    x: Annotated[str, typer.Argument(help="Coordinate of the section as name=low:high:count.")],
    y: Annotated[str, typer.Argument(help="Another one.")],
    hip_width: HipWidth = 0.3,
    foot_radius: FootRadius = 0.5,
    ankle_tilt: AnkleTilt = 0.55,
    slope: Slope = 0.01,
    inter_leg_angle: InterLegAngle = 0.3,
    mass_offset: MassOffset = 0.0,
    passive: Passive = False,
    planar: Planar = False,
    steps: Annotated[int, typer.Option(help="A walk of so many steps counts as survived.")] = 60,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Walk from every point of a plane of the section through the gait: what it survives."""
    from lean_yaw_env.analysis import basin as basin_of

    axes = parse_axes([x, y])
    first, second = axes.items()
    data = basin_of(
        walker_of(hip_width, foot_radius, ankle_tilt, slope, passive=passive, planar=planar),
        first,
        second,
        n_steps=steps,
        inter_leg_angle=inter_leg_angle,
        mass_offset=mass_offset,
        path=out,
        progress=sys.stderr.isatty(),
    )
    records = rows.basin_records(data, axes)
    if as_json:
        typer.echo(rows.as_json({"counts": rows.count_by(records, "ending"), "starts": records}))
        return
    screen.show_pairs("endings", rows.count_by(records, "ending"))
    screen.show_records("starts", records)


@app.command()
@reporting_errors
def bicycle(
    speeds: Speeds = "0:10:11",
    benchmark: Annotated[
        bool,
        typer.Option("--benchmark", help="The 2007 benchmark bicycle instead of the paper's."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Eigenvalues of the uncontrolled bicycle by mode, and the speeds that matter."""
    from lean_yaw_env.vehicles import benchmark_bicycle, paper_bicycle

    vehicle = benchmark_bicycle() if benchmark else paper_bicycle()
    record = rows.bicycle_record(vehicle, parse_range(speeds, "speeds"))
    if as_json:
        typer.echo(rows.as_json(record))
        return
    screen.show_pairs("speeds, m/s", record)
    screen.show_records("eigenvalues, 1/s", record["eigenvalues"])


@app.command()
@reporting_errors
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
    as_json: AsJson = False,
) -> None:
    """Critical speed and eigenvalues of the skateboard with a stiff rider."""
    from lean_yaw_env.vehicles import Skateboard

    board = Skateboard(
        mass, rider_height, wheelbase, steering_tilt, spring_stiffness, gravity, damping
    )
    record = rows.skateboard_record(board, parse_range(speeds, "speeds"))
    if as_json:
        typer.echo(rows.as_json(record))
        return
    screen.show_pairs("speed, m/s", record)
    screen.show_records("eigenvalues, 1/s", record["eigenvalues"])


@app.command()
@reporting_errors
def view(
    walk: Annotated[Path | None, typer.Option(help="Show this walk, saved with Walk.save.")] = None,
    port: Annotated[int, typer.Option(help="Of this machine; 0 takes a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Show the walkers in the browser, computed there by the package's own kernel; served to this machine only."""
    from lean_yaw_env.viewer import view as view_page

    server = view_page(walk, port=port, open_browser=browser)
    typer.echo(f"the page is at {server.address} until Ctrl-C")
    try:
        server.wait()
    except KeyboardInterrupt:
        server.close()


@app.command()
@reporting_errors
def reproduce(
    names: Annotated[
        list[str],
        typer.Argument(
            help="'all', or pieces: table1 to table3, figure4, figure7 to figure15, "
            "walker, skateboard, claims-passive, claims-active, claims-steering."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for report, pictures and numbers.")],
    as_json: AsJson = False,
) -> None:
    """Compute the paper's tables, figures and claims anew and set them beside the printed ones."""
    from tqdm.auto import tqdm

    from lean_yaw_env.paper import Piece, pieces_named, write_report
    from lean_yaw_env.paper import reproduce as reproduce_pieces

    with tqdm(total=len(pieces_named(names)), unit="piece", file=sys.stderr) as bar:
        shown: list[str] = []

        def before_each(piece: Piece) -> None:
            bar.update(1 if shown else 0)
            shown.append(piece.name)
            bar.set_description(piece.name)

        reproduction = reproduce_pieces(names, out, before_each=before_each)
        bar.update(1)
        bar.set_description("report")
        markdown, page = write_report(reproduction, out)
    if as_json:
        typer.echo(rows.as_json({"counts": reproduction.counts(), "checks": reproduction.rows()}))
        return
    screen.show_reproduction(reproduction)
    typer.echo(f"written: {markdown} and {page}")

"""How a function becomes a subcommand: a walker and axes from its options, errors in a line, tables, JSON or a picture."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import typer

from lean_yaw_env.cli.records import as_json
from lean_yaw_env.files import require_ending
from lean_yaw_env.parameters import Vector, WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.rendering.figures import ENDINGS, save_figure
from lean_yaw_env.reporting import keep, reporting
from lean_yaw_env.validation import require_count
from lean_yaw_env.walker import Walker

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Output(NamedTuple):
    """What a command found: a record for JSON, what prints it as tables, and what draws it."""

    record: Any
    show: Callable[[], None]
    figure: Callable[[], Figure] | None = None


def _option(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, keyword, default=default, annotation=annotation)


_AS_JSON = _option(
    "as_json", Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")], False
)
_PLOT = _option(
    "plot",
    Annotated[Path | None, typer.Option(help=f"Draw into this file: {', '.join(ENDINGS)}.")],
    None,
)


def add_command(
    app: typer.Typer, name: str | None = None, *, draws: bool = False
) -> Callable[..., Any]:
    """Make a function that returns an ``Output`` a subcommand, by its own name or another one.

    The command has the function's parameters as options, the option ``--json``, with ``draws`` the option ``--plot``, and in place of a parameter
    ``walker`` the options of ``walker_of``. It prints an error in a line, and exits with 2 where a value is wrong and with 1 where there is no
    result, such as no gait.
    """

    def add(function: Callable[..., Output]) -> Callable[..., Output]:
        own = dict(inspect.signature(function, eval_str=True).parameters)
        needs_walker = own.pop("walker", None) is not None
        described = inspect.signature(walker_of, eval_str=True).parameters if needs_walker else {}

        @wraps(function)
        def command(as_json: bool, plot: Path | None = None, **options: Any) -> None:
            description = {key: options.pop(key) for key in described}
            with reporting("lean-yaw"):
                if options.get("out") is not None:
                    keep(
                        f"what is finished is in {options['out']}; run the same command again to continue"
                    )
                if plot is not None:
                    require_ending(plot, ENDINGS)
                if needs_walker:
                    options["walker"] = walker_of(**description)
                output = function(**options)
                if plot is not None and output.figure is not None:
                    save_figure(output.figure(), plot)
                _print(output, as_json)

        options = [*own.values(), *described.values(), *([_PLOT] if draws else []), _AS_JSON]
        command.__signature__ = inspect.Signature(options)  # pyright: ignore[reportAttributeAccessIssue]
        command.__annotations__ = {option.name: option.annotation for option in options}
        app.command(name)(command)
        return function

    return add


def _print(output: Output, json: bool) -> None:
    typer.echo(as_json(output.record)) if json else output.show()


def walker_of(
    hip_width: Annotated[float, typer.Option(help="Distance between the hips, [0, 2].")] = 0.3,
    foot_radius: Annotated[float, typer.Option(help="Of the cylinder feet, [0, 1).")] = 0.5,
    ankle_tilt: Annotated[
        float, typer.Option(help="Angle of the ankle axis from the leg, (0, pi/2].")
    ] = 0.55,
    slope: Annotated[float, typer.Option(help="Slope angle, [-0.5, 0.5].")] = 0.01,
    ankle_stiffness: Annotated[float, typer.Option(help="Of the ankle's spring.")] = 0.0,
    ankle_damping: Annotated[float, typer.Option(help="Of the ankle's damper.")] = 0.0,
    passive: Annotated[
        bool, typer.Option("--passive", help="Let the swing leg swing freely.")
    ] = False,
    planar: Annotated[
        bool, typer.Option("--planar", help="Passive walker in the plane: no heading, no ankle.")
    ] = False,
) -> Walker | PassiveWalker:
    """An active walker, or a passive one in space or in the plane.

    Raises
    ------
    ValueError
        If a parameter is outside its range, or an active walker is to be planar.
    """
    parameters = WalkerParameters(
        hip_width, foot_radius, ankle_tilt, slope, ankle_stiffness, ankle_damping
    )
    if passive:
        return PassiveWalker(parameters, planar=planar)
    if planar:
        raise ValueError("--planar needs --passive: the active walker walks in space")
    return Walker(parameters)


def parse_range(text: str, name: str = "range") -> Vector:
    """Values of ``low:high:count``, evenly spaced, ends included; or of a single number.

    Raises
    ------
    ValueError
        If it is neither, low is not below high, or the count is not in [2, 100000].
    """
    form = f"{name} must be a number or low:high:count, such as 0.1:0.8:15, got {text!r}"
    fields = text.split(":")
    try:
        numbers = np.array(fields[:2], dtype=float)
        count = int(fields[2]) if len(fields) > 2 else 1
    except ValueError as error:
        raise ValueError(form) from error
    if len(fields) not in (1, 3) or not np.isfinite(numbers).all():
        raise ValueError(form)
    if len(fields) == 1:
        return numbers
    if not numbers[0] < numbers[1]:
        raise ValueError(f"{name} must rise from low to high, got {text!r}")
    require_count(f"{name}: the count", count, 2, 100_000)
    return np.linspace(numbers[0], numbers[1], count)


def parse_axes(texts: Iterable[str]) -> dict[str, Vector]:
    """Axes ``name=low:high:count`` by their names, in which dashes count as underscores.

    Raises
    ------
    ValueError
        If one has another form, or a name comes twice.
    """
    axes: dict[str, Vector] = {}
    for text in texts:
        given, sign, values = text.partition("=")
        name = given.strip().replace("-", "_")
        if not sign or not name:
            raise ValueError(
                f"axis must be name=low:high:count, such as slope=0.005:0.05:10, got {text!r}"
            )
        if name in axes:
            raise ValueError(f"axis {name} is given twice")
        axes[name] = parse_range(values, f"axis {name}")
    return axes

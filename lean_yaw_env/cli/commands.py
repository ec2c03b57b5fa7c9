"""How a function becomes a subcommand: errors in a line, tables or JSON, and a walker from its options."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, NamedTuple

import typer

from lean_yaw_env.cli import rows
from lean_yaw_env.cli.walkers import walker_of
from lean_yaw_env.errors import LeanYawError

WRONG_INPUT, NO_RESULT = 2, 1
_AS_JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")],
)


class Output(NamedTuple):
    """What a command found: a record for JSON, and what prints it as tables."""

    record: Any
    show: Callable[[], None]


def add_command(app: typer.Typer, name: str | None = None) -> Callable[..., Any]:
    """Make a function that returns an ``Output`` a subcommand, by its own name or another one.

    The command has the function's parameters as options, the option ``--json``, and in place of a parameter ``walker`` the options of
    ``walker_of``. It prints an error in a line, and exits with 2 where a value is wrong and with 1 where there is no result, such as no gait.
    """

    def add(function: Callable[..., Output]) -> Callable[..., Output]:
        own = dict(inspect.signature(function, eval_str=True).parameters)
        needs_walker = own.pop("walker", None) is not None
        described = inspect.signature(walker_of, eval_str=True).parameters if needs_walker else {}

        @wraps(function)
        def command(as_json: bool, **options: Any) -> None:
            description = {key: options.pop(key) for key in described}
            try:
                if needs_walker:
                    options["walker"] = walker_of(**description)
                output = function(**options)
            except (ValueError, OverflowError, OSError) as error:
                _give_up(error, WRONG_INPUT)
            except (LeanYawError, ImportError) as error:
                _give_up(error, NO_RESULT)
            else:
                typer.echo(rows.as_json(output.record)) if as_json else output.show()

        options = [*own.values(), *described.values(), _AS_JSON]
        command.__signature__ = inspect.Signature(options)  # pyright: ignore[reportAttributeAccessIssue]
        command.__annotations__ = {option.name: option.annotation for option in options}
        app.command(name)(command)
        return function

    return add


def _give_up(error: Exception, code: int) -> None:
    typer.echo(f"lean-yaw: {error}", err=True)
    raise typer.Exit(code) from error

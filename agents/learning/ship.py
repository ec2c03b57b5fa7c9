"""Keep finished runs' policies with the package: ``python -m agents.learning.ship --help``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from agents.files import read_json, write_json
from agents.learning.series import is_series, runs_of
from agents.learning.training import EVALUATION_FILE
from agents.policies.policy import Policy
from agents.policies.storage import load, save, shipping_folder
from lean_yaw_env.envs.options import EnvOptions

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def ship(run: Path, *, replace: bool = False) -> Path:
    """Copy a finished run's policy, and how it was judged, to where ``agents.load`` finds the package's agents.

    Parameters
    ----------
    run : folder that ``train.py`` left
    replace : whether an agent of that environment, algorithm and seed may be there already

    Raises
    ------
    ValueError
        If the run is not finished, it trained for other than the environment's own options, or there is an agent already and
        ``replace`` is not set; nothing has changed then.
    """
    policy = load(run)
    rows = _rows(run / EVALUATION_FILE, policy)
    card = policy.card
    if card.options != EnvOptions():
        raise ValueError(
            f"options of {str(run)!r} must be the environment's own, not {card.options}"
        )
    folder = shipping_folder(card.env_id, card.algorithm, card.seed)
    if folder.exists() and not replace:
        raise ValueError(f"there is an agent in {str(folder)!r} already; replace it by --replace")
    save(policy, folder)
    write_json(folder / EVALUATION_FILE, rows)
    return folder


def _rows(path: Path, policy: Policy) -> list[dict[str, Any]]:
    """The policy's own rows of a run's evaluation."""
    if not path.exists():
        raise ValueError(f"the run in {str(path.parent)!r} is not finished")
    rows = read_json(path)
    return [row for row in rows if row["agent"] == policy.card.algorithm]


@app.command()
def main(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Folders of finished runs, or of series of them."),
    ],
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace agents that are there already.")
    ] = False,
) -> None:
    """Copy the policies of finished runs into the package, as agents.load finds them by task, algorithm and seed."""
    try:
        for folder in runs:
            for run in runs_of(folder).values() if is_series(folder) else (folder,):
                typer.echo(f"{run} -> {ship(run, replace=replace)}")
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


if __name__ == "__main__":
    app()

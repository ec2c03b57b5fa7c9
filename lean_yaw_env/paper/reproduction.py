"""Reproduce pieces of the paper into a folder: pictures, numbers and a report."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import write_text
from lean_yaw_env.paper.checks import VERDICTS, Check
from lean_yaw_env.paper.registry import pieces_named
from lean_yaw_env.paper.results import Columns, Piece, Result

CHECK_COLUMNS = (
    "piece",
    "name",
    "where",
    "statement",
    "paper",
    "ours",
    "difference",
    "allowed",
    "verdict",
    "remark",
)


@dataclass(frozen=True)
class Reproduced:
    """A piece with what came of it.

    Attributes
    ----------
    piece : Piece
    result : Result
    picture : Path or None
        The PNG file.
    """

    piece: Piece
    result: Result
    picture: Path | None


@dataclass(frozen=True)
class Reproduction:
    """All pieces asked for.

    Attributes
    ----------
    pieces : tuple of Reproduced
        In the paper's order.
    """

    pieces: tuple[Reproduced, ...]

    @property
    def checks(self) -> tuple[Check, ...]:
        return tuple(check for each in self.pieces for check in each.result.checks)

    def counts(self) -> dict[str, int]:
        """How many checks came to each verdict."""
        return {v: sum(check.verdict == v for check in self.checks) for v in VERDICTS}

    def rows(self) -> list[dict[str, str | float | None]]:
        """One dictionary for each check, by ``CHECK_COLUMNS``."""
        return [
            {
                "piece": each.piece.name,
                **{name: getattr(check, name) for name in CHECK_COLUMNS[1:]},
            }
            for each in self.pieces
            for check in each.result.checks
        ]


def reproduce(names: Sequence[str], folder: Path, *, progress: bool = False) -> Reproduction:
    """Compute pieces of the paper and write their pictures (PNG) and numbers (CSV).

    Each file is written whole or not at all as soon as it is known, so that an interruption costs
    only the piece in work.

    Parameters
    ----------
    names : names of pieces, or "all"
    folder : Path
        Created if it does not exist.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ValueError
        If a name is unknown, or the folder is a file.
    LeanYawError
        If a piece cannot be computed; names it.
    """
    with needs_extra("analysis"):
        from tqdm.auto import tqdm
    pieces = pieces_named(list(names))
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"the output folder {str(folder)!r} is a file")
    folder.mkdir(parents=True, exist_ok=True)
    done = []
    bar = tqdm(pieces, unit="piece", disable=not progress)
    for piece in bar:
        bar.set_description(piece.name)
        try:
            result = piece.make()
        except LeanYawError as error:
            raise LeanYawError(f"{piece.name}: {error}") from error
        for stem, columns in result.tables.items():
            write_columns(folder / f"{stem}.csv", columns)
        picture = None
        if result.picture is not None:
            picture = folder / f"{piece.name}.png"
            result.picture(picture)
        done.append(Reproduced(piece, result, picture))
    return Reproduction(tuple(done))


def write_columns(path: Path, columns: Columns) -> None:
    """Write equally long columns as CSV, whole or not at all.

    Raises
    ------
    ValueError
        If the columns have different lengths.
    """
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    write_text(path, text.getvalue())

"""The paper's tables, figures and claims, computed anew and set beside the printed ones."""

from lean_yaw_env.paper.checks import VERDICTS, Check, Verdict, compare, judge
from lean_yaw_env.paper.numbers import PaperNumber, Statement
from lean_yaw_env.paper.registry import ALL, NAMES, PIECES, pieces_named
from lean_yaw_env.paper.report import as_html, as_markdown, write_report
from lean_yaw_env.paper.reproduction import Reproduced, Reproduction, reproduce
from lean_yaw_env.paper.results import CLASSICS, PAPER, Columns, Piece, Result, Section

__all__ = [
    "ALL",
    "CLASSICS",
    "NAMES",
    "PAPER",
    "PIECES",
    "VERDICTS",
    "Check",
    "Columns",
    "PaperNumber",
    "Piece",
    "Reproduced",
    "Reproduction",
    "Result",
    "Section",
    "Statement",
    "Verdict",
    "as_html",
    "as_markdown",
    "compare",
    "judge",
    "pieces_named",
    "reproduce",
    "write_report",
]

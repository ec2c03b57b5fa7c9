"""What pages of the site take from the code: a line ``<!-- from code: NAME ARGUMENT -->`` becomes the text that a function here makes."""

from __future__ import annotations

import csv
import importlib
import inspect
import re
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MARK = re.compile(r"^<!-- from code: (\w+) (\S+) -->$", re.MULTILINE)
PACKAGES = (
    "lean_yaw_env", "lean_yaw_env.passive", "lean_yaw_env.analysis", "lean_yaw_env.envs", "lean_yaw_env.envs.tasks", "lean_yaw_env.envs.sb3",
    "lean_yaw_env.plots", "lean_yaw_env.rendering",
    "lean_yaw_env.viewer", "lean_yaw_env.vehicles", "lean_yaw_env.multibody", "lean_yaw_env.paper", "lean_yaw_env.cli",
    "agents",
)  # fmt: skip
"""All packages and modules of the reference. A name of several is described with the first."""

PROGRAMS = {
    "walker": ("lean_yaw_env.cli.app", "lean-yaw"),
    "agents": ("agents.command_line", "python -m agents"),
}
"""Command lines: the module of each one's ``app``, and how it is called."""


def filled(page: str) -> str:
    """A page with its marks replaced."""
    return MARK.sub(lambda mark: MAKERS[mark[1]](mark[2]), page)


def public_names(package: str) -> list[str]:
    """``__all__``, or what a module without it defines for others."""
    module = importlib.import_module(package)
    if hasattr(module, "__all__"):
        return list(module.__all__)
    own = [
        name
        for name, value in vars(module).items()
        if getattr(value, "__module__", None) == package
    ]
    return [name for name in own if not name.startswith("_")]


def described_at(package: str, name: str) -> str:
    """Where the reference describes a name: in the first package that has the same object."""
    value = getattr(importlib.import_module(package), name)
    for other in PACKAGES:
        if name in public_names(other) and getattr(sys.modules[other], name) is value:
            return f"{other}.{name}"
    raise LookupError(f"{package} is none of PACKAGES")


def data_comment(package: str, name: str) -> str:
    """The string below the assignment of a constant, wherever in the package that is."""
    from sphinx.errors import PycodeError
    from sphinx.pycode import ModuleAnalyzer

    root = package.split(".")[0]
    for module in sorted(m for m in sys.modules if m.split(".")[0] == root):
        try:
            comments = ModuleAnalyzer.for_module(module).find_attr_docs()
        except PycodeError:
            continue
        if ("", name) in comments:
            return " ".join(comments["", name])
    raise LookupError(f"{package}.{name} has no docstring")


def reference(package: str) -> str:
    """A table of a package's public names, and the description of each."""
    rows, descriptions = [], []
    for name in public_names(package):
        value, place = getattr(sys.modules[package], name), described_at(package, name)
        is_code = inspect.isclass(value) or inspect.isroutine(value)
        text = inspect.getdoc(value) if is_code else data_comment(package, name)
        first = re.split(r"(?<=[.!?])\s|\n\n", text or "", maxsplit=1)[0].replace("\n", " ")
        rows.append(f"   * - :py:obj:`{name} <{place}>`\n     - {first}")
        if place != f"{package}.{name}":
            continue
        if is_code:
            kind = "class" if inspect.isclass(value) else "function"
            descriptions.append(f".. auto{kind}:: {place}\n")
        else:
            descriptions.append(f".. py:data:: {place}\n\n   {text}\n")
    table = ".. list-table::\n   :widths: 30 70\n   :class: names\n\n" + "\n".join(rows)
    return f"```{{eval-rst}}\n{table}\n\n{chr(10).join(descriptions)}\n```"


def without_markdown(lines: list[str]) -> list[str]:
    """A docstring whose Markdown headings and tables are reStructuredText."""
    result: list[str] = []
    for line in lines:
        if line.startswith("## "):
            result += [f"**{line[3:]}**", ""]
        elif line.startswith("|---"):
            continue
        elif line.startswith("| "):
            if not result or not result[-1].startswith("     - "):
                result += [".. list-table::", "   :header-rows: 1", ""]
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            result += [f"   {'* ' if k == 0 else '  '}- {cell}" for k, cell in enumerate(cells)]
        else:
            result.append(line)
    return result


def commands(program: str) -> str:
    """The help of a command line and of all its commands."""
    import typer
    from typer.cli import get_docs_for_click

    module, name = PROGRAMS[program]
    command = typer.main.get_command(importlib.import_module(module).app)
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name=name, indent=1)
    return text.split("\n", 1)[1].replace("```console\n$ ", "```\n")


def gallery(results: str) -> str:
    """A section for each task: what it asks, its film, how to make it, and the scores of the agents in a file of results."""
    from lean_yaw_env.envs.tasks import TASKS
    from lean_yaw_env.registration import ALL_ENV_IDS, ALL_TASKS

    with (ROOT / results).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    sections = []
    for name, env_id in zip(ALL_TASKS, ALL_ENV_IDS, strict=True):
        task = TASKS[name]
        scored = [row for row in rows if (row["task"], row["metric"]) == (name, task.headline)]
        scored.sort(key=lambda row: -float(row["mean"]))
        scores = [
            f"| {row['agent']} | {float(row['mean']):.4g} | {float(row['low']):.4g} to {float(row['high']):.4g} |"
            for row in scored
        ]
        table = [
            f"| agent | mean {task.headline.replace('_', ' ')} | 95 % |",
            "|---|---:|---|",
            *scores,
        ]
        film = f'<video src="films/{name.lower()}.mp4" controls loop muted playsinline preload="metadata"></video>'
        code = f'import gymnasium as gym\n\nenv = gym.make("lean_yaw_env:{env_id}")'
        parts = [
            f"## {name}",
            task.summary,
            f"```{{raw}} html\n{film}\n```",
            f"```python\n{code}\n```",
        ]
        sections += [*parts, "\n".join(table) if scores else "No scores yet."]
    return "\n\n".join(sections)


MAKERS: dict[str, Callable[[str], str]] = {
    "reference": reference,
    "commands": commands,
    "gallery": gallery,
}

"""The trained agents that the page offers: the files of the package's own, and an index of them."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import Any

from lean_yaw_env.files import read_json

_PACKAGE = Path(__file__).parents[1]
_HOMES = (_PACKAGE / "agents", _PACKAGE.parent / "agents")
"""Of the package ``agents``: in an installation, and in a clone."""

CARD, WEIGHTS = "policy.json", "policy.safetensors"


def trained_folder() -> Path | None:
    """Where the trained agents are, as ``<Task>-v<version>/<algorithm>/seed<k>/``; None if they are not installed."""
    return next((home / "trained" for home in _HOMES if (home / "trained").is_dir()), None)


def agent_index() -> dict[str, Any]:
    """What the page reads before it reads an agent.

    ``agents``: by task (with its version) and algorithm, the seeds, the observation's names and the mean scores. ``laws``: by task, the matrix of the
    linear law, row by row. ``references``: by task, the fixed controller's mean and the best that a search has found.
    """
    folder = trained_folder()
    if folder is None:
        return {"agents": {}, "laws": {}, "references": {}}
    agents = {
        task.name: {place.name: _described(place) for place in _folders(task)}
        for task in _folders(folder)
    }
    laws, found = (_read(folder.parent / name) for name in ("settings.json", "references.json"))
    linear = {task: values["weights"] for task, values in laws.get("linear", {}).items()}
    kept = ("metric", "fixed", "value")
    references = {task: {key: each[key] for key in kept} for task, each in found.items()}
    return {"agents": agents, "laws": linear, "references": references}


def _described(place: Path) -> dict[str, Any]:
    """An algorithm's agents at a task; the scores are means over all seeds."""
    seeds = sorted(int(folder.name.removeprefix("seed")) for folder in _folders(place))
    scores: dict[str, list[float]] = {}
    for seed in seeds:
        file = place / f"seed{seed}" / "evaluation.json"
        for row in read_json(file) if file.exists() else []:
            if row["mean"] is not None:
                scores.setdefault(row["metric"], []).append(row["mean"])
    card = read_json(place / f"seed{seeds[0]}" / CARD) if seeds else {"observation": {"names": []}}
    return {
        "seeds": seeds,
        "observation": card["observation"]["names"],
        "means": {metric: fmean(each) for metric, each in scores.items()},
    }


def _read(file: Path) -> Any:
    return read_json(file) if file.exists() else {}


def _folders(place: Path) -> list[Path]:
    return sorted(each for each in place.iterdir() if each.is_dir())

"""Evaluations of agents by their names, shown as a table or as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from tqdm import tqdm

from agents.evaluation.scoring import Row, evaluate
from agents.evaluation.tables import results_table, rows_to_json
from agents.registry import AgentRequest, env_id_of, make_agent, make_all
from lean_yaw_env.envs.options import EnvOptions


def evaluate_named(
    task: str,
    names: Sequence[str],
    *,
    episodes: int,
    seed: int = 0,
    path: Path | None = None,
    runs: Path = Path("runs"),
    options: EnvOptions | None = None,
    progress: bool = True,
) -> list[Row]:
    """Evaluate agents of the registry; all that there are for the task if none is named.

    Raises
    ------
    ValueError
        If a name or number is bad, or a trained agent is not found.
    """
    chosen = EnvOptions() if options is None else options
    request = AgentRequest(env_id_of(task), chosen, seed=seed, path=path, runs=runs)
    agents = {name: make_agent(name, request) for name in names} or make_all(request)
    with progress_bar(episodes * len(agents), progress) as bar:
        return evaluate(
            task, agents, episodes=episodes, seed=seed, options=chosen, progress=bar.update
        )


def progress_bar(episodes: int, shown: bool) -> tqdm:
    """The bar of an evaluation."""
    return tqdm(total=episodes, desc="evaluating", unit="episode", disable=not shown)


def show(rows: Sequence[Row], console: Console, *, as_json: bool = False) -> None:
    """Print rows."""
    if as_json:
        console.print(rows_to_json(rows), soft_wrap=True, highlight=False, markup=False)
    else:
        console.print(results_table(rows))

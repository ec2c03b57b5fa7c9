"""How soon the gradient agent and PPO come to the same score: steps, and processor seconds of one core.

``python -m benchmarks.gradient --task Heading`` trains both with their own settings for the task, several seeds each, and now and then
judges the policies without exploration on held-out episodes, off the clock. Each finished training is kept in ``benchmarks/results``, and
not done again by the next call; the picture is drawn from all that are there.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.ticker import EngFormatter
from tqdm import tqdm

from agents.evaluation.scoring import run_episodes
from agents.learning.algorithms import settings_for, train
from agents.learning.recorder import State, read_checkpoint
from agents.observations import ObservationLayout
from agents.policies.policy import Policy, PolicyCard
from agents.policies.policy_files import save, task_of
from agents.registry import env_id_of
from benchmarks.measure import machine
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.files import read_json, write_json
from lean_yaw_env.rendering.figures import new_figure, save_figure
from lean_yaw_env.rendering.palette import AGENT_COLOURS, unit_colour

RESULTS = Path(__file__).parent / "results"
NAMES = {"apg": "gradient agent", "ppo": "PPO"}
EPISODES = 100  # of a look at a policy while it is trained
LOOKS = 12  # at most, in a training


@dataclass(frozen=True)
class Curve:
    """A training as it was looked at: after so many steps and seconds, the mean return of held-out episodes."""

    algorithm: str
    seed: int
    settings: dict[str, Any]
    steps: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    returns: list[float] = field(default_factory=list)

    def reaches(self, level: float) -> tuple[float, float]:
        """Steps and seconds at the first look at which the return was at least ``level``; infinite if at none."""
        for steps, seconds, value in zip(self.steps, self.seconds, self.returns, strict=True):
            if value >= level:
                return float(steps), seconds
        return float("inf"), float("inf")


class Watch:
    """Looks at a training through its checkpoints, between updates, and keeps the clock without that."""

    def __init__(self, env_id: str, algorithm: str, curve: Curve, file: Path, every: int) -> None:
        self._env_id = env_id
        self._algorithm = algorithm
        self._curve = curve
        self._file = file
        self._every = every
        self._paused = 0.0
        self._clock: dict[int, float] = {0: 0.0}
        self._began = time.process_time()

    def __call__(self, steps: int, recent_return: float) -> None:
        """Look at the checkpoint, which may be of now or of the time before; the return while exploring is not what is compared."""
        now = time.process_time()
        self._clock[steps] = now - self._began - self._paused
        if self._file.exists():
            state = read_checkpoint(self._file)
            done = int(state["steps"])
            last = self._curve.steps[-1] if self._curve.steps else 0
            if done in self._clock and done >= last + self._every:
                self.note(done, self._clock[done], policy_in(self._env_id, self._algorithm, state))
        self._paused += time.process_time() - now

    def finish(self, steps: int, policy: Policy) -> None:
        """Look at the policy that came of it."""
        self.note(steps, time.process_time() - self._began - self._paused, policy)

    def note(self, steps: int, seconds: float, policy: Policy) -> None:
        """Evaluate a policy, and write down its return."""
        episodes = run_episodes(policy, task_of(self._env_id), episodes=EPISODES)
        self._curve.steps.append(steps)
        self._curve.seconds.append(round(seconds, 2))
        self._curve.returns.append(round(float(episodes.metrics["return"].mean()), 3))


def policy_in(env_id: str, algorithm: str, state: State) -> Policy:
    """The policy within a training's checkpoint."""
    layout = ObservationLayout.of(task_of(env_id), EnvOptions())
    if algorithm == "ppo":
        names = ["mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net"]
        mean, variance = state["observations"]["mean"], state["observations"]["var"]
    else:
        names = ["0", "2", "4"]
        mean, variance = np.zeros(len(layout.names)), np.ones(len(layout.names))
    weights = {
        f"layers.{k}.{part}": state["policy"][f"{name}.{part}"]
        for k, name in enumerate(names)
        for part in ("weight", "bias")
    }
    weights["observation_mean"] = mean.astype(np.float32)
    weights["observation_variance"] = variance.astype(np.float32)
    weights["log_std"] = np.zeros(2, dtype=np.float32)
    return Policy(PolicyCard(env_id, EnvOptions(), layout, algorithm), weights)


def learn(
    env_id: str, algorithm: str, seed: int, steps: int | None, progress: bool = True
) -> tuple[Curve, Policy]:
    """Train once, looking at the policy now and then."""
    settings = settings_for(algorithm, task_of(env_id))
    if steps is not None:
        settings = replace(settings, steps=steps)
    curve = Curve(algorithm, seed, json.loads(json.dumps(asdict(settings))))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "checkpoint.safetensors"
        watch = Watch(env_id, algorithm, curve, file, settings.steps // LOOKS)
        trained = train(
            algorithm, env_id, settings, seed=seed, checkpoint=file, checkpoint_seconds=0.0, report=watch,
            progress=progress,
        )  # fmt: skip
    watch.finish(int(trained.policy.card.training["steps"]), trained.policy)
    return curve, trained.policy


def compare(
    env_id: str,
    counts: dict[str, int],
    file: Path,
    steps: dict[str, int | None],
    kept: Callable[[str, int, Policy], object],
) -> list[Curve]:
    """Every algorithm's trainings, those already in ``file`` not done again; the policies of new ones are handed to ``kept``."""
    curves = [Curve(**values) for values in read_json(file)["curves"]] if file.exists() else []
    done = {(curve.algorithm, curve.seed) for curve in curves}
    wanted = [(a, seed) for a, count in counts.items() for seed in range(count)]
    for algorithm, seed in tqdm([pair for pair in wanted if pair not in done], desc="trainings"):
        curve, policy = learn(env_id, algorithm, seed, steps[algorithm])
        kept(algorithm, seed, policy)
        curves.append(curve)
        write_json(
            file, {"env_id": env_id, "episodes": EPISODES, "curves": [asdict(c) for c in curves]} | machine(),
        )  # fmt: skip
    return curves


def table(curves: list[Curve], levels: list[float]) -> str:
    """Medians over seeds of steps and seconds to each level."""
    lines = [f"{'return':>8} {'algorithm':>10} {'seeds':>6} {'steps':>12} {'seconds':>9}"]
    for level in levels:
        for algorithm in NAMES:
            reached = [c.reaches(level) for c in curves if c.algorithm == algorithm]
            if reached:
                steps, seconds = np.median(np.array(reached), axis=0)
                lines.append(
                    f"{level:8g} {algorithm:>10} {len(reached):6d} {steps:12,.0f} {seconds:9.1f}"
                )
    return "\n".join(lines)


def save_comparison(curves: list[Curve], task: str, machine: Mapping[str, Any], path: Path) -> None:
    """Draw each training thin and the median of each algorithm's thick, on logarithmic axes of cost; the picture is written whole."""
    figure = new_figure(10.0, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, cost in zip(panels, ("steps", "seconds"), strict=True):
        for algorithm, name in NAMES.items():
            colour = unit_colour(AGENT_COLOURS[algorithm])
            own = [curve for curve in curves if curve.algorithm == algorithm]
            for curve in own:
                axes.plot(getattr(curve, cost), curve.returns, color=colour, linewidth=0.7, alpha=0.5)  # fmt: skip
            if own:
                label = f"{name}, median of {len(own)}" if len(own) > 1 else f"{name}, one training"  # fmt: skip
                axes.plot(*_median(own, cost), color=colour, linewidth=2.2, label=label)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))
        axes.grid(color="0.9", which="both")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_xlabel("walking steps trained (k: thousands, M: millions)")
    panels[1].set_xlabel("processor seconds of one core")
    panels[0].set_ylabel("return of a held-out episode")
    panels[0].legend(loc="lower right", frameon=False)
    figure.suptitle(
        f"{task}: score while training, without exploration ({machine['processor']})", fontsize=11
    )
    save_figure(figure, path)


def _median(curves: list[Curve], cost: str) -> tuple[Any, Any]:
    """The median return at costs that every training came to, interpolated between looks."""
    costs = [np.array(getattr(curve, cost), dtype=float) for curve in curves]
    low, high = max(c[0] for c in costs), min(c[-1] for c in costs)
    grid = np.geomspace(low, high, 100)
    values = [np.interp(grid, c, curve.returns) for c, curve in zip(costs, curves, strict=True)]
    return grid, np.median(values, axis=0)


_Steps = Annotated[int | None, typer.Option(help="Steps of each, in place of the task's.")]


def main(
    task: Annotated[str, typer.Option(help="The task's name.")] = "Heading",
    apg: Annotated[int, typer.Option(help="Trainings of the gradient agent.")] = 5,
    ppo: Annotated[int, typer.Option(help="Trainings of PPO.")] = 5,
    apg_steps: _Steps = None,
    ppo_steps: _Steps = None,
    level: Annotated[list[float] | None, typer.Option(help="Returns to compare.")] = None,
    keep: Annotated[Path | None, typer.Option(help="Folder to keep the policies in.")] = None,
) -> None:
    """Train both algorithms on a task and compare how soon they come to the same score."""
    env_id = env_id_of(task)

    def kept(algorithm: str, seed: int, policy: Policy) -> None:
        if keep is not None:
            save(policy, keep / f"{task}-{algorithm}-seed{seed}")

    file = RESULTS / f"gradient_{task}.json"
    RESULTS.mkdir(exist_ok=True)
    curves = compare(
        env_id, {"apg": apg, "ppo": ppo}, file, {"apg": apg_steps, "ppo": ppo_steps}, kept
    )
    best = min(
        float(np.median([c.returns[-1] for c in curves if c.algorithm == a]))
        for a in {c.algorithm for c in curves}
    )
    levels = level or [round(share * best, 1) for share in (0.8, 0.9, 0.95, 0.99)]
    typer.echo(table(curves, levels))
    save_comparison(curves, task, machine(), file.with_suffix(".png"))


if __name__ == "__main__":
    typer.run(main)

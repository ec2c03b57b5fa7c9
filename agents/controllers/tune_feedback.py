"""How the gains of ``HeadingFeedback`` were found: differential evolution on the mean return over episodes kept for tuning.

Run as ``python -m agents.controllers.tune_feedback``; it prints the gains (some minutes).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import differential_evolution
from tqdm import tqdm

from agents.controllers.heading_feedback import HeadingFeedback, HeadingGains
from agents.evaluation.scoring import Episodes, run_seeds
from agents.seeds import TUNING_SEEDS
from lean_yaw_env.parameters import Vector

BOUNDS = {
    "proportional": (0.0, 0.3),
    "ankle": (-1.0, 1.0),
    "ankle_rate": (-0.5, 0.5),
    "feedforward": (0.0, 2.0),
    "inter_leg_angle": (0.0, 0.15),
}
"""Where each gain is sought; all found lie well inside."""
EPISODES = 256
GENERATIONS = 30
FALL_COST = 500.0
"""What a share of episodes that ended in a fall costs, in return: gains that ever fall are no gains."""


def cost(gains: Vector) -> float:
    """Minus the mean return, and a charge for falls."""
    results = _episodes(gains)
    return FALL_COST * (1.0 - float(results.survived.mean())) - float(
        results.metrics["return"].mean()
    )


def tune(generations: int = GENERATIONS) -> HeadingGains:
    """Search the gains; the same every time."""
    with tqdm(total=generations, desc="tuning", unit="generation") as bar:
        found = differential_evolution(
            cost,
            list(BOUNDS.values()),
            maxiter=generations,
            popsize=6,
            polish=False,
            tol=0.0,
            rng=np.random.default_rng(0),
            callback=lambda intermediate_result: _show(bar, intermediate_result.fun),
        )
    return HeadingGains(*found.x)


def _show(bar: tqdm, best: float) -> None:
    bar.set_postfix({"return": f"{-best:.2f}"}, refresh=False)
    bar.update(1)


def _episodes(gains: Vector) -> Episodes:
    feedback = HeadingFeedback(gains=HeadingGains(*gains))
    return run_seeds(feedback, "Heading", range(TUNING_SEEDS, TUNING_SEEDS + EPISODES))


if __name__ == "__main__":
    print(tune())

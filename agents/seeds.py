"""Which environment seeds are whose, so that no agent is judged on an episode it was trained or tuned on.

| environment seeds | for |
|---|---|
| 0 to 2^31 - 2^20 - 1 | training: walker i of seed s has 2^12 s + i, so that no two seeds share a walker |
| 2^31 - 2^20 to 2^31 - 1 | tuning of controllers |
| from 2^31 | evaluation: episode i of seed s has 2^31 + 2^20 s + i |
"""

from __future__ import annotations

from lean_yaw_env.validation import require_count

MOST_WALKERS = 2**12
"""Walkers of one training at most."""
TRAINING_SEEDS = 2**19 - 2**8
"""Seeds of trainings are below."""
TUNING_SEEDS = 2**31 - 2**20
MOST_EPISODES = 2**20
"""Episodes of one evaluation, or of all tuning, at most."""
EVALUATION_SEEDS = 2**31
MOST_EVALUATIONS = 2**31


def training_seed(seed: int) -> int:
    """The environment seed of the first walker of a training, or ``ValueError``."""
    return MOST_WALKERS * require_count("seed", seed, 0, TRAINING_SEEDS - 1)


def evaluation_seed(seed: int) -> int:
    """The environment seed of the first episode of an evaluation, or ``ValueError``."""
    number = require_count("seed", seed, 0, MOST_EVALUATIONS - 1)
    return EVALUATION_SEEDS + MOST_EPISODES * number

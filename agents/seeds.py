"""Three sets of episodes, apart by construction: for training, for validation and for the test.

| environment seeds | set | read by |
|---|---|---|
| 0 to 2^31 - 1 | training: walker i of seed s has 2^12 s + i, so that no two seeds share a walker | learners |
| 2^31 to 2^51 + 2^31 - 1 | test: episode i of seed s has 2^31 + 2^20 s + i | the command that writes the leaderboard, and nothing else |
| from 2^52 | validation: episode i of seed s has 2^52 + 2^20 s + i | evaluations of trainings, learning curves, tuners, films |
"""

from __future__ import annotations

from typing import Literal

from lean_yaw_env.validation import require_choice, require_count

EpisodeSet = Literal["validation", "test"]

MOST_WALKERS = 2**12
"""Walkers of one training at most."""
TRAINING_SEEDS = 2**19
"""Seeds of trainings are below."""
MOST_EPISODES = 2**20
"""Episodes of one evaluation at most."""
MOST_EVALUATIONS = 2**31
_FIRST: dict[EpisodeSet, int] = {"test": 2**31, "validation": 2**52}


def training_seed(seed: int) -> int:
    """The environment seed of the first walker of a training, or ``ValueError``."""
    return MOST_WALKERS * require_count("seed", seed, 0, TRAINING_SEEDS - 1)


def first_seed(episode_set: EpisodeSet, seed: int = 0) -> int:
    """The environment seed of an evaluation's first episode, or ``ValueError``."""
    require_choice("episode_set", episode_set, _FIRST)
    number = require_count("seed", seed, 0, MOST_EVALUATIONS - 1)
    return _FIRST[episode_set] + MOST_EPISODES * number

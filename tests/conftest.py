"""Shared by the tests: how hypothesis draws its examples, and Table 1's walker with its gait."""

from __future__ import annotations

import pytest
from hypothesis import settings

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis.limit_cycle import find_gait
from lean_yaw_env.parameters import Vector

# The same examples in every run, so that a failure belongs to the change under test
settings.register_profile("repeatable", derandomize=True, deadline=None)
# New examples in every run: pytest --hypothesis-profile explore [--hypothesis-seed 7]
settings.register_profile("explore", derandomize=False, deadline=None, print_blob=True)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def walker() -> Walker:
    """The walker of the paper's Table 1."""
    return Walker(WalkerParameters())


@pytest.fixture(scope="session")
def gait(walker: Walker) -> Vector:
    """Its gait, on the left foot."""
    state = find_gait(walker)
    state.flags.writeable = False
    return state

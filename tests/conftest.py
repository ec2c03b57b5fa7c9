"""Shared by the tests of the walker and its environments: Table 1's walker and its gait."""

from __future__ import annotations

import pytest

from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.analysis.limit_cycle import find_gait
from lean_yaw_env.parameters import Vector


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

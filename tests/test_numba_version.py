"""The versions of Numba that the kernels are tested with."""

from __future__ import annotations

from pathlib import Path

import pytest

from lean_yaw_env.kernel import NUMBA_VERSIONS, require_numba

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def test_the_project_asks_for_the_versions_that_the_kernels_take() -> None:
    (low, high) = (f"{major}.{minor}" for major, minor in NUMBA_VERSIONS)
    assert f'"numba>={low},<{high}"' in PROJECT.read_text(encoding="utf-8")


def test_another_version_is_refused_with_what_to_install() -> None:
    low, high = NUMBA_VERSIONS
    require_numba(low)
    require_numba((high[0], high[1] - 1))
    for version in ((low[0], low[1] - 1), high, (1, 0)):
        with pytest.raises(
            ImportError, match=r"tested with numba>=0\.61,<0\.\d+; found .* run `pip"
        ):
            require_numba(version)

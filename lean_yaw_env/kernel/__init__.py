"""The walkers' equations as compiled functions of floats. They rest on Numba's internals, so its tested versions alone will do."""

from typing import Any

import numba

NUMBA_VERSIONS = ((0, 61), (0, 69))
"""The first version that the kernels are tested with, and the first that they are not; pyproject.toml says the same."""


def require_numba(version: tuple[int, int]) -> None:
    """Raise ``ImportError`` if a version of Numba, (major, minor), is not one of those tested."""
    (low, high), found = NUMBA_VERSIONS, ".".join(map(str, version))
    if not low <= version < high:
        wanted = f"numba>={low[0]}.{low[1]},<{high[0]}.{high[1]}"
        raise ImportError(
            f"lean_yaw_env's compiled kernels rest on Numba's internals and are tested with {wanted}; "
            f"found {found}: run `pip install '{wanted}'`"
        )


_numba: Any = numba  # its type hints do not know it
require_numba(_numba.version_info.short)

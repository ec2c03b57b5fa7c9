"""The atlas: what it answers is the best of what the map holds, and basins are walks of the designs themselves."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

from lean_yaw_env import Walker
from lean_yaw_env.analysis import Atlas, basin_sizes, stability_map
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import WalkerParameters

AXES = {"slope": [0.01, 0.02], "hip_width": [0.1, 0.3, 0.5], "ankle_tilt": [0.1, 0.4, 0.6]}


@pytest.fixture(scope="module")
def atlas() -> Atlas:
    gaits = stability_map(Walker(), AXES)
    return Atlas(gaits, basin_sizes(gaits, every=1, n_steps=5))


def stable(atlas: Atlas, name: str) -> xarray.DataArray:
    return atlas.gaits[name].where(atlas.gaits.spectral_radius < 1.0)


def test_the_fastest_stable_design_is_the_fastest_within_limits(atlas: Atlas) -> None:
    speeds = stable(atlas, "speed")
    assert atlas.fastest_stable()["speed"] == float(speeds.max())
    slow = atlas.fastest_stable(slope=(0.0, 0.01))
    assert (slow["slope"], slow["speed"]) == (0.01, float(speeds.sel(slope=0.01).max()))
    with pytest.raises(ValueError, match="limits of slope"):
        atlas.fastest_stable(slope=(0.5, 0.6))
    with pytest.raises(ValueError, match="axis must be one of"):
        atlas.fastest_stable(colour=(0.0, 1.0))


def test_the_nearest_stable_design_is_itself_where_it_is_stable(atlas: Atlas) -> None:
    best = atlas.fastest_stable()
    wanted = {name: best[name] for name in AXES}
    assert atlas.nearest_stable(**wanted) == best
    assert atlas.nearest_stable(slope=0.019, hip_width=0.3)["slope"] == 0.02


def test_the_largest_basin_is_of_a_design_that_is_fast_enough(atlas: Atlas) -> None:
    assert atlas.basins is not None
    speeds = stable(atlas, "speed")
    found = atlas.largest_basin(float(speeds.median()))
    assert found["speed"] >= float(np.float32(speeds.median()))
    assert found["basin"] == float(atlas.basins.basin.where(speeds >= speeds.median()).max())
    with pytest.raises(NoGaitError, match="no design of the atlas"):
        atlas.largest_basin(100.0)


def test_a_basin_is_the_share_of_disturbed_walks_that_do_not_fall(atlas: Atlas, monkeypatch) -> None:  # fmt: skip
    design = {name: atlas.fastest_stable()[name] for name in AXES}
    here = atlas.gaits.sel(design)
    # without a disturbance every walk survives; with it, those that the walker itself survives
    from scipy.stats import qmc

    from lean_yaw_env.analysis.atlas import _REACH, PUSHES

    walker = Walker(WalkerParameters(**design))
    off = _REACH * (2.0 * qmc.Sobol(5, scramble=False).random(PUSHES) - 1.0)
    survived = [walker.walk(5, state=here.state.to_numpy() + each).fall is None for each in off]
    assert atlas.basins is not None
    assert float(atlas.basins.basin.sel(design)) == np.mean(survived)

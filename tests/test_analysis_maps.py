"""Maps, basins and disturbances: agreement with single gaits and walks, storage, bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

from lean_yaw_env.analysis import (
    attraction,
    basin,
    filling,
    find_limit_cycle,
    gait_map,
    largest_disturbance,
    load_dataset,
    map_cost,
    save_dataset,
    section_map_of,
    stability_map,
)
from lean_yaw_env.analysis.many_walks import walk_many
from lean_yaw_env.engine import Engine
from lean_yaw_env.errors import NoGaitError
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.walker import Walker

TABLE_1 = Walker(WalkerParameters())
TILTS, WIDTHS = [0.2, 0.4, 0.55, 0.7], [0.0, 0.2, 0.4]
AXES = {"hip_width": WIDTHS, "ankle_tilt": TILTS}


# --- maps


def test_map_holds_the_gait_of_every_point() -> None:
    result = stability_map(TABLE_1, AXES, engine=Engine(threads=2))
    for width in WIDTHS:
        for tilt in TILTS:
            here = result.sel(hip_width=width, ankle_tilt=tilt)
            walker = Walker(WalkerParameters(hip_width=width, ankle_tilt=tilt))
            if int(here.status) == 2:
                continue
            cycle = find_limit_cycle(walker)
            # two root finders, each stopping at 1e-12, through multipliers near one
            assert here.state.to_numpy() == pytest.approx(cycle.state, abs=1e-9)
            assert float(here.spectral_radius) == pytest.approx(
                np.abs(cycle.eigenvalues).max(), abs=1e-7
            )
            assert float(here.speed) == pytest.approx(cycle.speed, abs=1e-9)
            assert float(here.gravity_work) == pytest.approx(cycle.gravity_work, abs=1e-9)
            values = here.eigenvalue_real.to_numpy() + 1j * here.eigenvalue_imag.to_numpy()
            assert values == pytest.approx(cycle.eigenvalues, abs=1e-7)
    assert float((result.status == 1).mean()) > 0.8
    # no gait at the widest hip with the flattest axis: the branch has folded before
    assert result.state.sel(hip_width=0.0).notnull().all()


def test_stable_region_of_the_map_is_that_of_figure_12s_left_face() -> None:
    result = stability_map(TABLE_1, {"ankle_tilt": [0.14, 0.2, 0.5, 0.6], "hip_width": [0.0]})
    # Figure 10 B: stable between 0.15 and 0.55
    assert (result.spectral_radius < 1.0).to_numpy().ravel().tolist() == [False, True, True, False]


def test_map_of_offsets_stands_across_the_slope() -> None:
    result = stability_map(TABLE_1, {"mass_offset": [-0.004, 0.0, 0.004]})
    expected = np.arcsin(np.array([0.004, 0.0, -0.004]) / np.tan(0.01))
    # the closed form is of a straight walk; the gait sways about it
    assert result.state.sel(coordinate="heading").to_numpy() == pytest.approx(expected, abs=0.01)


def test_map_of_pumping_spreads_from_one_gait_to_where_the_slope_gives_nothing() -> None:
    level = Walker(WalkerParameters(slope=0.0))
    axes = {"slope": [-0.005, 0.0, 0.005], "alternating_offset": [0.02, 0.03]}
    result = stability_map(level, axes, mass_offset=(0.03, -0.03))
    assert (result.status == 1).all()
    cycle = find_limit_cycle(level, mass_offset=(0.03, -0.03))
    here = result.sel(slope=0.0, alternating_offset=0.03)
    assert float(here.speed) == pytest.approx(cycle.speed, abs=1e-9)
    assert np.isnan(float(here.eigenvalue_real[-1]))  # the heading has no multiplier there


def test_map_of_pumping_on_the_level_does_not_need_a_gait_at_its_first_point() -> None:
    result = stability_map(
        Walker(WalkerParameters(slope=0.0)), {"alternating_offset": [0.002, 0.004, 0.02, 0.03]}
    )
    assert result.status.values.tolist() == [2, 2, 1, 1]


def test_map_of_turning_walkers_has_the_speed_of_both_feet() -> None:
    walker = Walker(WalkerParameters(slope_turns=True))
    result = stability_map(walker, {"mass_offset": np.linspace(-0.05, 0.05, 9)})
    cycle = find_limit_cycle(walker, mass_offset=0.05)
    for name in ("speed", "step_length", "gravity_work"):
        ends = result[name].to_numpy()[[0, -1]]
        assert ends == pytest.approx([getattr(cycle, name)] * 2, abs=1e-9)


def test_map_goes_to_the_fold_and_not_round_it() -> None:
    # at an ankle tilt of 0.8 the gait folds at a hip width between 0.38 and 0.42; past the fold it would be slower by a half
    widths = np.linspace(0.3, 0.45, 16)
    result = stability_map(Walker(WalkerParameters(ankle_tilt=0.8)), {"hip_width": widths})
    found = (result.status == 1).to_numpy()
    assert found[0] and not found[-1] and (np.diff(found.astype(int)) <= 0).all()
    speeds = result.speed.to_numpy()[found]
    assert speeds.min() > 0.7 * speeds.max()


def test_map_of_passive_walkers_reproduces_figure_8() -> None:
    walker = PassiveWalker(WalkerParameters(0.0, 0.5, 0.15, 0.00058))
    result = stability_map(walker, {"ankle_tilt": [0.14, 0.15, 0.152, 0.154, 0.16]})
    # stable in a small region around the leg's greatest angle, 0.153
    assert (result.spectral_radius < 1.0).to_numpy().tolist() == [False, True, True, True, False]
    assert np.ptp(result.state.sel(coordinate="stance_pitch").to_numpy()) < 1e-9


@pytest.mark.parametrize("name", ["map.nc", "map.zarr"])
def test_interrupted_map_goes_on_where_it_was(name: str, tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / name
    monkeypatch.setattr(filling, "_FEWEST", 4)
    whole = stability_map(TABLE_1, AXES)
    find, calls = gait_map.gaits_at, []

    def interrupted(section_map, points, guesses, **options):
        calls.append(points)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return find(section_map, points, guesses, **options)

    monkeypatch.setattr(gait_map, "gaits_at", interrupted)
    with pytest.raises(KeyboardInterrupt):
        stability_map(TABLE_1, AXES, path=path)
    assert int((stored(path).status != 0).sum()) == 4
    resumed = stability_map(TABLE_1, AXES, path=path)
    # what was done is not done again: the next region is the second width's
    assert (calls[2]["hip_width"][0], calls[2]["ankle_tilt"][0]) == (WIDTHS[1], TILTS[0])
    assert resumed.identical(stored(path))
    assert resumed.equals(whole)
    assert [p.name for p in tmp_path.iterdir()] == [name]


def stored(path: Path) -> xarray.Dataset:
    """What a file or a store holds."""
    return (
        load_dataset(path) if path.suffix == ".nc" else xarray.open_zarr(path, consolidated=False)
    )


def test_what_is_done_is_kept_when_work_ends_in_an_error(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "basin.nc"
    arguments = (TABLE_1, ("heading", [-0.1, 0.0, 0.1]), ("ankle_rate", [-0.1, 0.0]))
    whole = basin(*arguments, n_steps=5)
    monkeypatch.setattr(filling, "_FEWEST", 4)
    walk, calls = attraction.walk_many, []

    def full_disk(*given):
        calls.append(given)
        if len(calls) == 2:
            raise OSError("no space left on device")
        return walk(*given)

    monkeypatch.setattr(attraction, "walk_many", full_disk)
    with pytest.raises(OSError, match="no space left"):
        basin(*arguments, n_steps=5, path=path)
    assert int((load_dataset(path).ending >= 0.0).sum()) == 4
    assert basin(*arguments, n_steps=5, path=path).identical(whole)
    assert [len(given[1]) for given in calls[1:]] == [2, 2]


def test_map_saves_and_loads_and_another_question_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.nc"
    result = stability_map(TABLE_1, {"slope": [0.01, 0.02]})
    save_dataset(result, path)
    assert load_dataset(path).identical(result)
    with pytest.raises(ValueError, match="another question"):
        stability_map(TABLE_1, {"slope": [0.01, 0.03]}, path=path)
    with pytest.raises(ValueError, match="another question"):
        stability_map(Walker(WalkerParameters(foot_radius=0.4)), {"slope": [0.01, 0.02]}, path=path)
    broken = tmp_path / "broken.nc"
    broken.write_bytes(b"no map")
    with pytest.raises(ValueError, match="must be a netCDF file"):
        load_dataset(broken)
    with pytest.raises(ValueError, match="path must be a file"):
        load_dataset(tmp_path / "none.nc")


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({}, "one to six parameters"),
        ({"slope": [0.02, 0.01]}, "axis slope must be growing numbers"),
        ({"slope": [0.9]}, "slope must be in"),
        ({"colour": [1.0]}, "parameter must be one of"),
    ],
)
def test_bad_axes_are_refused(axes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        stability_map(TABLE_1, axes)


# --- many walks, basins, disturbances


def test_many_walks_go_as_single_ones() -> None:
    gait = find_limit_cycle(TABLE_1).state
    states = gait * (1.0 + 0.5 * np.random.default_rng(3).uniform(-1, 1, (20, 5)))
    walks = walk_many(section_map_of(TABLE_1), states, 10)
    for i, state in enumerate(states):
        walk = TABLE_1.walk(10, state=state)
        assert walks.steps[i] == walk.n_steps
        assert walks.survived[i] == (walk.fall is None)
        if walk.fall is None:
            assert np.array_equal(walks.states[i], walk.states[-1])


def test_basin_of_the_walker_holds_its_gait_and_ends_where_it_falls_backward(tmp_path) -> None:
    path = tmp_path / "basin.nc"
    headings, rates = np.linspace(-0.5, 0.5, 3), np.linspace(-0.6, 0.0, 7)
    arguments = (TABLE_1, ("heading", headings), ("stance_pitch_rate", rates))
    result = basin(*arguments, n_steps=20, path=path)
    middle = result.sel(heading=0.0, method="nearest")
    assert float(middle.ending.sel(stance_pitch_rate=-0.4, method="nearest")) == 0.0
    assert float(middle.ending.sel(stance_pitch_rate=0.0, method="nearest")) != 0.0
    survived = result.ending == 0.0
    assert bool((result.steps.where(survived, 20) == 20).all())
    assert basin(*arguments, n_steps=20, path=path).identical(result)
    with pytest.raises(ValueError, match="another question"):
        basin(*arguments, n_steps=21, path=path)


def test_arc_feet_widen_the_basin_as_in_section_4_1() -> None:
    def least(walker: PassiveWalker) -> float:
        return min(
            abs(largest_disturbance(walker, name, upward=up, n_steps=40, most=0.5).relative)
            for name in ("stance_pitch", "stance_pitch_rate")
            for up in (True, False)
        )

    # the paper: 2 % and 8 %, "a crude analysis"
    points = PassiveWalker(WalkerParameters(0.0, 0.0, 0.5, 0.004), planar=True)
    arcs = PassiveWalker(WalkerParameters(0.0, 0.5, 0.5, 0.00058), planar=True)
    assert least(points) == pytest.approx(0.02, abs=0.005)
    assert least(arcs) == pytest.approx(0.08, abs=0.015)


def test_walker_recovers_from_the_disturbances_of_section_4_4() -> None:
    strike = Walker(WalkerParameters(early_contact="strike"))
    for name in ("heading", "stance_pitch", "ankle_angle", "ankle_rate"):
        assert largest_disturbance(strike, name, most=3.0).relative >= 2.0
        assert largest_disturbance(strike, name, upward=False, most=3.0).relative <= -1.0
    faster = largest_disturbance(TABLE_1, "stance_pitch_rate", most=3.0)
    slower = largest_disturbance(TABLE_1, "stance_pitch_rate", upward=False, most=3.0)
    assert faster.relative >= 2.0
    # "can only be decreased with 50 %"
    assert slower.relative == pytest.approx(-0.5, abs=0.05)


def test_disturbance_found_is_survived_and_a_larger_one_is_not() -> None:
    found = largest_disturbance(TABLE_1, "stance_pitch", relative=False, most=0.5, tolerance=1e-4)
    assert found.is_limited
    assert found.fall == "trip"  # the swing foot, put in front, is in the floor
    gait = find_limit_cycle(TABLE_1).state
    for beyond, survives in ((0.0, True), (2e-4, False)):
        start = gait + np.array([0, found.largest + beyond, 0, 0, 0])
        assert (TABLE_1.walk(60, state=start).fall is None) == survives


def test_bad_disturbances_are_refused() -> None:
    with pytest.raises(ValueError, match="coordinate must be one of heading"):
        largest_disturbance(TABLE_1, "colour")
    with pytest.raises(ValueError, match="ask for an absolute disturbance"):
        largest_disturbance(PassiveWalker(WalkerParameters(0.0, 0.5, 0.15, 0.00058)), "ankle_angle")
    with pytest.raises(ValueError, match="different coordinates"):
        basin(TABLE_1, ("heading", [0.0]), ("heading", [0.0]))
    with pytest.raises(ValueError, match="must be growing numbers"):
        basin(TABLE_1, ("heading", [0.0, 0.0]), ("ankle_angle", [0.0]))
    with pytest.raises(NoGaitError):
        basin(Walker(WalkerParameters(slope=0.0)), ("heading", [0.0]), ("ankle_angle", [0.0]))


def test_gaits_followed_along_hip_width_are_those_followed_from_none() -> None:
    tilts, widths = np.linspace(0.1, 1.2, 12), np.linspace(0.0, 0.6, 25)
    section_map = section_map_of(TABLE_1)
    points = dict(zip(("ankle_tilt", "hip_width"), map(np.ravel, np.meshgrid(tilts, widths, indexing="ij")), strict=True))  # fmt: skip
    rows = gait_map.gaits_at(section_map, points, None, in_row=widths.size)
    alone = gait_map.gaits_at(section_map, points, None)
    assert 0.2 < (alone["status"] == 1).mean() < 0.9
    found = (rows["status"] == 1) & (alone["status"] == 1)
    # a row ends at its first failure, which neighbours in the map may fill; beyond it little is found
    assert np.mean(rows["status"] == alone["status"]) > 0.98
    # two searches, each stopping at 1e-12, through multipliers near one
    assert rows["state"][found] == pytest.approx(alone["state"][found], abs=1e-9)


def test_no_point_without_a_gait_has_a_neighbour_whose_gait_leads_to_one() -> None:
    axes = {
        "inter_leg_angle": np.array([0.25, 0.3]),
        "slope": np.linspace(-0.03, 0.01, 41),
        "alternating_offset": np.linspace(0.002, 0.06, 30),
    }
    section_map = section_map_of(Walker(WalkerParameters(slope_turns=True)))
    data = stability_map(section_map, axes)
    has_gait, states = data.status.to_numpy() == gait_map.FOUND, data.state.to_numpy()
    for axis in range(3):
        for step in (-1, 1):
            there = np.argwhere(has_gait)
            there[:, axis] += step
            inside = (there[:, axis] >= 0) & (there[:, axis] < has_gait.shape[axis])
            points, guesses = there[inside], states[has_gait][inside]
            lacks = ~has_gait[tuple(points.T)]
            points = {name: values[k] for (name, values), k in zip(axes.items(), points[lacks].T, strict=True)}  # fmt: skip
            rows = gait_map.gaits_at(section_map, points, guesses[lacks])
            assert not (rows["status"] == gait_map.FOUND).any()


def test_a_map_beyond_memory_is_refused_before_it_begins() -> None:
    axes = {"hip_width": np.linspace(0.1, 0.5, 100_000), "slope": np.linspace(0.01, 0.05, 100_000)}
    with pytest.raises(ValueError, match=r"10,000,000,000, which take about .* GB"):
        stability_map(Walker(), axes)
    size, seconds = map_cost(Walker(), axes)
    assert size > 1e12 and seconds > 1e5

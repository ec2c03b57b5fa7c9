"""Work on threads, processes and a cluster: the same bits wherever it runs and whatever dies, and one clear error."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from lean_yaw_env import Walker
from lean_yaw_env.analysis import Engine, basin, filling, stability_map
from lean_yaw_env.errors import ClusterError
from lean_yaw_env.parameters import WalkerParameters

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")
zarr = pytest.importorskip("zarr")
fsspec = pytest.importorskip("fsspec")

AXES = {"hip_width": np.linspace(0.1, 0.5, 12), "ankle_tilt": np.linspace(0.3, 0.8, 25)}
WALKER = Walker(WalkerParameters())
PUMPED = Walker(WalkerParameters(slope_turns=True))
PUMPING = {"slope": np.linspace(-0.02, 0.01, 16), "alternating_offset": np.linspace(0.01, 0.05, 8)}


@pytest.fixture(autouse=True)
def small_regions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filling, "_FEWEST", 25)


@pytest.fixture(scope="module")
def cluster():
    with local_cluster() as cluster:
        yield cluster


def local_cluster():
    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, memory_limit=0, dashboard_address=":0"
    )


def fail_on(worker_name: int, error: Exception):
    """Work that only one worker cannot do."""

    def function(shared, k):
        if distributed.get_worker().name == worker_name:
            raise error
        return k

    return function


def test_a_map_has_the_same_bits_on_threads_processes_and_a_cluster(cluster, tmp_path) -> None:
    alone = stability_map(PUMPED, PUMPING)
    assert (alone.status == 1).any() and (alone.status == 2).any()
    for k, engine in enumerate((Engine(threads=2), Engine(scheduler=cluster.scheduler_address))):
        there = stability_map(PUMPED, PUMPING, path=tmp_path / f"{k}.zarr", engine=engine)
        assert there.equals(alone)
    plane = ("heading", np.linspace(-0.2, 0.2, 9)), ("ankle_rate", np.linspace(-0.2, 0.2, 7))
    assert basin(WALKER, *plane, engine=Engine(workers=1)).identical(basin(WALKER, *plane))


def test_every_region_is_one_object_of_every_column(tmp_path: Path) -> None:
    stability_map(WALKER, AXES, path=tmp_path / "map.zarr")
    for name in ("state", "status", filling.PASSES):
        objects = [p for p in (tmp_path / "map.zarr" / name / "c").rglob("*") if p.is_file()]
        assert len(objects) <= 12
    array = zarr.open_group(tmp_path / "map.zarr", mode="r")["state"]
    assert array.shards == (1, 25, 5) and array.chunks == (1, 25, 5)


@pytest.mark.parametrize("shape", [(7,), (100, 3), (3, 1000, 7), (1, 1, 5000), (40, 50, 60, 2)])
def test_regions_cover_a_grid_once_and_are_shards(shape: tuple[int, ...]) -> None:
    axes = {str(k): np.arange(float(size)) for k, size in enumerate(shape)}
    layout = filling.Layout("grid", axes, {"value": np.zeros(1)}, {}, most=700)
    seen = np.concatenate([filling.points_of(region, shape) for region in layout.regions])
    assert np.array_equal(seen, np.arange(layout.n))
    shard, chunk = layout.shard_and_chunk
    assert all(s % c == 0 for s, c in zip(shard, chunk, strict=True))
    assert len(layout.regions) == 1 or shard == layout.region_shape


def test_a_resumed_map_does_only_what_is_missing_though_it_found_nothing(tmp_path, monkeypatch) -> None:  # fmt: skip
    axes = {"slope": [-0.02, -0.01], "hip_width": np.linspace(0.1, 0.3, 25)}
    path = tmp_path / "map.zarr"
    first = stability_map(WALKER, axes, path=path)
    assert (first.status == 2).all()
    monkeypatch.setattr("lean_yaw_env.analysis.gait_map.gaits_at", None)
    assert stability_map(WALKER, axes, path=path).equals(first)


def slowly(seconds: float):
    """A layout and a work whose every region takes some time, leaves a half of it first, and can be checked."""

    class Slow:
        def __call__(self, arrays, region, number):
            row = region[0].start
            arrays["value"][region] = -1.0
            time.sleep(seconds)
            filling.write_box(arrays, region, {"value": row + np.sin(np.arange(20.0))})
            return 1 if number < 2 else 0

    axes = {"row": np.arange(40.0), "column": np.arange(20.0)}
    return filling.Layout("slow", axes, {"value": np.full(1, np.nan)}, {}, most=20), Slow()


KILLS = int(os.environ.get("LEAN_YAW_KILLS", "4"))
"""Of workers; each takes some seconds to come back."""


def test_workers_that_are_killed_lose_nothing_that_was_finished(tmp_path: Path) -> None:
    layout, work = slowly(0.04 * KILLS)
    random, killed = np.random.default_rng(0), []
    patient = {"distributed.scheduler.allowed-failures": 1000}
    with dask.config.set(patient), local_cluster() as cluster:
        done = threading.Event()

        def kill() -> None:
            while not done.wait(float(random.uniform(0.0, 0.2))) and len(killed) < KILLS:
                nanny = cluster.workers[int(random.integers(2))]
                # one that is up: a nanny gives up on a worker that dies before it has begun
                is_up = nanny.worker_address in cluster.scheduler.workers
                if is_up and nanny.pid is not None and nanny.pid not in killed:
                    os.kill(nanny.pid, signal.SIGKILL)
                    killed.append(nanny.pid)

        killer = threading.Thread(target=kill)
        killer.start()
        engine = Engine(scheduler=cluster.scheduler_address)
        data = filling.fill_grid(layout, work, tmp_path / "slow.zarr", engine, False)
        done.set()
        killer.join()
    print(f"{len(killed)} workers were killed")
    assert len(killed) == KILLS
    assert data.equals(filling.fill_grid(layout, slowly(0.0)[1], None, Engine(), False))


def test_a_lost_scheduler_is_one_error_and_the_map_goes_on_elsewhere(tmp_path: Path) -> None:
    layout, work = slowly(0.2)
    path, places = tmp_path / "slow.zarr", tmp_path / "scheduler.json"
    with ExitStack() as stack:
        place = ["--scheduler-file", str(places)]
        scheduler = started(stack, "scheduler", "--port", "0", "--no-dashboard", *place)
        started(stack, "worker", *place, "--nthreads", "1", "--no-dashboard")
        address = json.loads(wait_for(places).read_text())["address"]

        def kill() -> None:
            record = wait_for(path / filling.DONE / "c" / "5")
            assert record.exists()
            scheduler.kill()

        killer = threading.Thread(target=kill)
        killer.start()
        with pytest.raises(ClusterError, match=f"the scheduler {address} was lost"):
            filling.fill_grid(layout, work, path, Engine(scheduler=address), False)
        killer.join()
    done = zarr.open_group(path, mode="r")[filling.DONE][:, 0]
    assert 5 <= (done == 1).sum() < len(layout.regions)
    data = filling.fill_grid(layout, slowly(0.0)[1], path, Engine(), False)
    assert data.equals(filling.fill_grid(layout, slowly(0.0)[1], None, Engine(), False))


def started(stack: ExitStack, *command: str) -> subprocess.Popen[bytes]:
    """``dask`` with a command, until the stack is left."""
    process = subprocess.Popen([sys.executable, "-m", "dask", *command], stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def wait_for(path: Path, seconds: float = 60.0) -> Path:
    """Return a path once it is there."""
    end = time.monotonic() + seconds
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.02)
    return path


def test_errors_of_a_cluster_name_what_failed(cluster, tmp_path, monkeypatch) -> None:
    with pytest.raises(ClusterError, match=r"scheduler tcp://127.0.0.1:9 did not answer"):
        stability_map(WALKER, AXES, path=tmp_path / "a.zarr", engine=Engine(scheduler="tcp://127.0.0.1:9"))  # fmt: skip
    engine = Engine(scheduler=cluster.scheduler_address)
    with pytest.raises(ValueError, match="path must be a Zarr store that all workers reach"):
        stability_map(WALKER, AXES, engine=engine)
    full = fail_on(1, OSError(errno.ENOSPC, "No space left on device", "map.zarr"))
    with engine.started() as run, pytest.raises(ClusterError, match=r"the worker tcp://.* failed: .*No space left"):  # fmt: skip
        list(run(full, None, [(k,) for k in range(20)]))
    monkeypatch.setattr("lean_yaw_env.engine.metadata.version", lambda name: "0.0")
    with engine.started() as run, pytest.raises(ClusterError, match=r"the worker tcp.* has lean-yaw-env .*, and the client 0.0"):  # fmt: skip
        list(run(full, None, [(0,)]))


def test_a_store_of_another_map_or_of_other_things_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.zarr"
    stability_map(WALKER, {"slope": [0.01, 0.02]}, path=path)
    for axes in ({"slope": [0.01, 0.03]}, {"hip_width": [0.1]}):
        with pytest.raises(ValueError, match="another question"):
            stability_map(WALKER, axes, path=path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    for place in ("mine", "mine/letter.txt"):
        with pytest.raises(ValueError, match="or a new folder"):
            stability_map(WALKER, {"slope": [0.01]}, path=tmp_path / place)
    zarr.open_group(tmp_path / "other.zarr", mode="w").create_array("x", shape=3, dtype="f8")
    with pytest.raises(ValueError, match="another question"):
        stability_map(WALKER, {"slope": [0.01]}, path=tmp_path / "other.zarr")
    assert (tmp_path / "mine" / "letter.txt").read_text() == "dear"


def test_a_map_beyond_memory_is_computed_where_it_is_streamed(tmp_path, monkeypatch) -> None:
    axes = {"slope": np.linspace(0.01, 0.02, 30)}
    whole = stability_map(WALKER, axes)
    monkeypatch.setattr("lean_yaw_env.analysis.storage.free_memory", lambda: 1000.0)
    for path in (None, tmp_path / "map.nc"):
        with pytest.raises(ValueError, match=r"fit into memory, got 30, .*\.zarr"):
            stability_map(WALKER, axes, path=path)
    assert stability_map(WALKER, axes, path=tmp_path / "map.zarr").equals(whole)


STREAMED = """
import resource, sys
import numpy as np
from lean_yaw_env.analysis import Engine, filling
from lean_yaw_env.cli.records import grid_summary

COLUMNS = ("speed", "spectral_radius", "step_length", "step_duration")

def work(arrays, region, number):
    n = filling.points_of(region, tuple(s.stop for s in region)).size
    filling.write_box(arrays, region, {name: np.zeros(n) for name in COLUMNS})
    return 0

for n in map(int, sys.argv[2:]):
    axes = {"slope": np.arange(n / 1024), "hip_width": np.arange(1024.0)}
    layout = filling.Layout("map", axes, {name: np.full(1, np.nan) for name in COLUMNS}, {})
    data = filling.fill_grid(layout, work, f"{sys.argv[1]}/{n}.zarr", Engine(), False)
    assert grid_summary(data, "gait", ("speed",))["counts"] == {"stable": n}
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="kilobytes are Linux's unit")
def test_memory_does_not_grow_with_the_points_of_a_streamed_map(tmp_path: Path) -> None:
    sizes = 2**21, 2**23
    command = [sys.executable, "-c", STREAMED, str(tmp_path), *map(str, sizes)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    less, more = (1024 * int(line) for line in said.split())
    assert more - less < 0.1 * 32 * (sizes[1] - sizes[0])  # a tenth of four numbers a point


def test_a_store_may_be_in_an_object_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("s3fs")
    server = pytest.importorskip("moto.server").ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    try:
        host, port = server.get_host_and_port()
        options = {
            "endpoint_url": f"http://{host}:{port}", "key": "key", "secret": "secret",
            "client_kwargs": {"region_name": "eu-west-1"},
        }  # fmt: skip
        monkeypatch.setitem(fsspec.config.conf, "s3", options)
        fsspec.filesystem("s3").mkdir("maps")
        alone = stability_map(WALKER, AXES)
        for _ in range(2):  # the second time all is there
            data = stability_map(WALKER, AXES, path="s3://maps/walker.zarr")
            assert data.equals(alone)
        with pytest.raises(ValueError, match="another question"):
            stability_map(WALKER, PUMPING, path="s3://maps/walker.zarr")
    finally:
        server.stop()


def test_a_newcomer_splits_one_map_over_two_workers(tmp_path: Path) -> None:
    places = tmp_path / "scheduler.json"
    with ExitStack() as stack:
        place = ["--scheduler-file", str(places)]
        started(stack, "scheduler", "--port", "0", "--no-dashboard", *place)
        address = json.loads(wait_for(places).read_text())["address"]
        started(stack, "worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard")
        engine = Engine(scheduler=address)
        with engine.started() as run:
            names = [name for _, name in run(lambda _, k: time.sleep(0.5) or distributed.get_worker().address, None, [(k,) for k in range(40)])]  # fmt: skip
        assert len(set(names)) == 2
        options = ["--scheduler", address, "--out", str(tmp_path / "map.zarr"), "--json"]
        command = [sys.executable, "-m", "lean_yaw_env.cli", "map", "slope=0.01:0.02:2", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    assert stability_map(WALKER, {"slope": [0.01, 0.02]}, path=tmp_path / "map.zarr").status.all()

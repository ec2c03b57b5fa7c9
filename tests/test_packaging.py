"""The wheel: what it installs, what a package index shows of it, and that its agents work beside another distribution of the name ``agents``."""

from __future__ import annotations

import json
import os
import re
import runpy
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
BASELINES = """
import json
from lean_yaw_env.agents import AgentRequest, FixedController, load, make_agent
from lean_yaw_env.agents.evaluation.scoring import run_episodes
from lean_yaw_env.envs.options import EnvOptions

options = EnvOptions(horizon=5.0)
agents = {"fixed": FixedController(), "ppo": load("LeanYaw/Walk-v1")}
agents["feedback"] = make_agent("feedback", AgentRequest("LeanYaw/Heading-v1", EnvOptions()))
tasks = {"feedback": "Heading"}
print(json.dumps({
    name: run_episodes(agent, tasks.get(name, "Walk"), episodes=2, options=options).metrics["return"].tolist()
    for name, agent in agents.items()
}))
"""


def run(*command: str | Path, **options) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)  # fmt: skip


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built from the checkout."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    built = run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory) -> Path:
    """The interpreter of an environment in which the wheel is installed, with this environment's other libraries."""
    home = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", home, check=True)
    interpreter = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    installed = run(interpreter, "-m", "pip", "install", "--no-deps", "--quiet", wheel)
    assert installed.returncode == 0, installed.stderr
    place = run(interpreter, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))")
    # a path file of its own is not read for path files again, so that an editable installation of the checkout stays out
    libraries = Path(place.stdout.strip()) / "libraries.pth"
    libraries.write_text(f"{Path(np.__file__).parents[1]}\n")
    return interpreter


def test_the_wheel_installs_no_name_but_the_package_s(wheel: Path):
    with zipfile.ZipFile(wheel) as file:
        names = file.namelist()
    assert {name.split("/")[0] for name in names} == {
        "lean_yaw_env",
        wheel.name.split("-py3")[0] + ".dist-info",
    }
    assert "lean_yaw_env/py.typed" in names
    shipped = {
        path.relative_to(ROOT).as_posix() for path in (ROOT / "agents").rglob("*.safetensors")
    }
    assert shipped and {f"lean_yaw_env/{path}" for path in shipped} <= set(names)
    assert "lean_yaw_env/agents/settings.json" in names
    assert not [name for name in names if "__pycache__" in name]


def test_checkers_of_distributions_find_nothing(wheel: Path, tmp_path: Path):
    pytest.importorskip("twine")
    pytest.importorskip("check_wheel_contents")
    built = run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    (sdist,) = tmp_path.glob("*.tar.gz")
    for checker in (["twine", "check", "--strict", wheel, sdist], ["check_wheel_contents", wheel]):
        done = run(sys.executable, "-m", *checker)
        assert done.returncode == 0, done.stdout + done.stderr


def test_links_on_a_package_index_lead_to_the_repository_s_address_or_nowhere(wheel: Path):
    with zipfile.ZipFile(wheel) as file:
        (metadata,) = (name for name in file.namelist() if name.endswith("/METADATA"))
        page = file.read(metadata).decode()
    link = re.compile(r"(!?)\[[^\]]*\]\(([^)]+)\)")
    targets = [target for _, target in link.findall(page)]
    assert targets
    assert all(target.startswith(("https://", "#")) for target in targets)
    # with an address
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    page_of_index = runpy.run_path(str(ROOT / "hatch_build.py"))["page_of_index"]
    address = "https://example.org/walkers"
    images, pages = set(), set()
    for image, target in link.findall(page_of_index(readme, address)):
        assert target.startswith(("https://", "#"))
        if target.startswith(address):
            (images if image else pages).add(target.partition("#")[0])
    files = {f"{address}/raw/main/{path}" for path in ("docs/images/walking.webp", "benchmarks/results/comparison.png")}  # fmt: skip
    assert images == files
    assert f"{address}/blob/main/docs/environments.md" in pages


def test_an_installed_wheel_loads_policies_and_runs_baselines(python: Path, tmp_path: Path):
    done = run(python, "-c", BASELINES, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    returns = json.loads(done.stdout)
    assert set(returns) == {"fixed", "ppo", "feedback"}
    assert all(len(values) == 2 and min(values) > 0.0 for values in returns.values())
    arguments = ("evaluate", "--task", "Walk", "--agents", "fixed,ppo", "--episodes", "2", "--json")
    told = run(python, "-m", "lean_yaw_env.agents", *arguments, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert {row["agent"] for row in json.loads(told.stdout)} == {"fixed", "ppo"}


def test_it_works_beside_another_distribution_of_the_name_agents(python: Path, tmp_path: Path):
    installed = run(python, "-m", "pip", "install", "--quiet", "--retries", "1", "openai-agents")
    if installed.returncode != 0:
        pytest.skip(f"openai-agents cannot be installed: {installed.stderr.splitlines()[-1:]}")
    theirs = "import agents; agents.Runner; print(agents.__file__)"
    done = run(python, "-c", f"{theirs}\n{BASELINES}", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    where, returns = done.stdout.splitlines()
    assert "lean_yaw_env" not in where and not where.startswith(str(ROOT))
    assert json.loads(returns)["ppo"][0] > 0.0

"""README and docs: their code runs, their links lead somewhere, their commands exist, and numbers that they take from the code are the code's."""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from lean_yaw_env.envs.tasks import task_named
from lean_yaw_env.kernel.flight import (
    BACKWARD_RATE,
    LANDING_WINDOW,
    LEAST_INDEPENDENCE,
    SHIFTING_LANDING_WINDOW,
)
from lean_yaw_env.registration import ALL_ENV_IDS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    *(page for page in sorted(DOCS.rglob("*.md")) if not {"build", "_cache"} & set(page.parts)),
]
RUN_ELSEWHERE = {
    "other_libraries": "its programs need other libraries: tests/compat runs them",
    "gpu": "it needs an accelerator: tests/gpu_simulation.py runs the simulation",
    "enter_your_agent": "it trains for long: test_agents_entries runs it with a short training",
}
SHORTER = {
    "scaling": {", 200)": ", 3)", "workers=4": "workers=1"},
    "watch_your_agent": {"range(100)": "range(2)"},
}
"""Numbers of a page's program, and smaller ones that are run in their place."""
STAND_INS = {
    "scaling": {
        "dask_jobqueue.py": """
class SLURMCluster:
    scheduler_address = "tcp://127.0.0.1:8786"
    def __init__(self, *, cores, processes, memory, walltime): pass
    def scale(self, *, jobs): pass
""",
        "dask_kubernetes/operator.py": """
class KubeCluster:
    scheduler_address = "tcp://127.0.0.1:8786"
    def __init__(self, *, name, image, n_workers): pass
""",
    },
    "environments": {
        "stand_in.py": """
import threading, time
import pygame

def close_windows():
    while True:
        time.sleep(0.5)
        if pygame.display.get_init() and pygame.display.get_surface():
            pygame.event.post(pygame.event.Event(pygame.QUIT))

threading.Thread(target=close_windows, daemon=True).start()
"""
    },
}
"""Modules in place of clusters and of a person who closes a window; ``stand_in`` is imported first."""
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PROGRAMS = re.compile(r"(pip|python|pytest|lean-yaw|npm|dask) ")
PYTHON_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
COMMAND = re.compile(
    r"(?:python -m (?:agents|benchmarks|lean_yaw_env)|python train\.py|lean-yaw )[^`\n]*"
)


def _program(page: str) -> str:
    """The page's Python blocks, each on its own lines of the page, so that a traceback names the page's line."""
    lines = [""] * len(page.split("\n"))
    for block in PYTHON_BLOCK.finditer(page):
        first = page[: block.start(1)].count("\n")
        body = block[1].split("\n")
        lines[first : first + len(body)] = body
    return "\n".join(lines)


def _anchor(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def _anchors(page: Path) -> set[str]:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    return {_anchor(heading) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_of_a_page_is_of_a_kind_that_is_run(page: Path) -> None:
    """Python and cells of notebooks are programs, blocks without a language are commands; the rest is no code."""
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        no_code = ("json", "bibtex", "{toctree}", "{glossary}", "{include}", "{raw}")
        if language == "":
            lines = [line for line in text.split("\n") if line]
            assert all(PROGRAMS.match(line) for line in lines), text
        else:
            assert language in ("python", "{code-cell} python") or language.startswith(no_code)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs_from_top_to_bottom(page: Path, tmp_path: Path) -> None:
    if page.stem in RUN_ELSEWHERE:
        pytest.skip(RUN_ELSEWHERE[page.stem])
    program = _program(page.read_text(encoding="utf-8"))
    if not program.strip():
        pytest.skip("no code")
    for number, smaller in SHORTER.get(page.stem, {}).items():
        assert number in program
        program = program.replace(number, smaller)
    for name, text in STAND_INS.get(page.stem, {}).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
        if name == "stand_in.py":
            program = f"import stand_in{program}"  # the first line is empty: no code stands there
    if page.stem == "scaling":
        pytest.importorskip("zarr", reason="stores need Python 3.11")
        make_atlas(tmp_path / "atlas")
    script = tmp_path / f"{page.stem}.py"
    script.write_text(program, encoding="utf-8")
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "MPLBACKEND": "agg",
        "SDL_VIDEODRIVER": "dummy",
    }
    result = subprocess.run(
        [sys.executable, script], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr[-3000:]


def make_atlas(folder: Path) -> None:
    """The atlas of a few designs, by the command that makes the whole one."""
    axes = ["slope=0.01:0.02:2", "inter-leg-angle=0.2:0.3:2", "foot-radius=0.4:0.5:2", "hip-width=0.2:0.35:2", "ankle-tilt=0.4:0.6:2"]  # fmt: skip
    command = [sys.executable, "-m", "lean_yaw_env.cli", "atlas", *axes, "--every", "1"]
    subprocess.run([*command, "--out", str(folder)], check=True, capture_output=True)


def _options_by_program() -> dict[str, set[str]]:
    """Each program with its subcommand and other words, and the options that pages give it."""
    found: dict[str, set[str]] = {}
    for page in PAGES:
        for command in COMMAND.findall(page.read_text(encoding="utf-8")):
            words = shlex.split(command.split(" && ")[0], comments=True)
            options = [k for k, word in enumerate(words) if word.startswith("--")]
            program = shlex.join(words[: options[0]] if options else words)
            found.setdefault(program, set()).update(words[k].split("=")[0] for k in options)
    return found


@pytest.mark.parametrize(("program", "options"), _options_by_program().items())
def test_a_documented_command_knows_its_options(program: str, options: set[str]) -> None:
    words = shlex.split(program)
    own = ["-m", "lean_yaw_env.cli"] if words[0] == "lean-yaw" else []
    plain = {**os.environ, "COLUMNS": "300", "TERM": "dumb", "NO_COLOR": "1"}
    done = subprocess.run(
        [sys.executable, *own, *words[1:], "--help"],
        cwd=ROOT,
        env=plain,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    unknown = {option for option in options if not re.search(rf"{option}\b", done.stdout)}
    assert not unknown


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    for target in LINK.findall(text):
        if re.match(r"https?://", target):
            continue
        file, _, anchor = target.partition("#")
        place = page.parent / file if file else page
        assert place.exists(), f"{target} is not there"
        if anchor:
            assert anchor in _anchors(place), f"{target} has no such heading"


def test_the_page_of_the_model_states_the_thresholds_of_the_code() -> None:
    text = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    assert rf"$\dot\theta \ge {BACKWARD_RATE:g}$" in text
    assert LEAST_INDEPENDENCE == 1e-3
    assert r"\le 10^{-3} M_{11} M_{22}" in text
    assert (
        f"within {LANDING_WINDOW:g} units of time ({SHIFTING_LANDING_WINDOW:g} while the masses move"
        in text
    )


def _readme_results() -> list[tuple[str, str, str]]:
    """(task, agent, cell) of the README's table of results."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = text.split("| task | mean |")[1].split("\n\n")[0].splitlines()
    agents = [name.strip() for name in lines[0].strip("|").split("|")]
    cells = []
    for line in lines[2:]:
        task, _, *values = [cell.strip() for cell in line.strip("|").split("|")]
        cells += [(task, agent, cell) for agent, cell in zip(agents, values, strict=True)]
    return cells


def test_extras_that_pages_name_exist() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    known = set(re.findall(r"^(\w+) = \[", project, re.MULTILINE))
    for page in PAGES:
        for names in re.findall(r"'\.\[([\w,]+)\]'", page.read_text(encoding="utf-8")):
            assert set(names.split(",")) <= known


def test_the_readme_lists_every_task() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(LeanYaw/\S+)` \|", text, re.MULTILINE)
    assert sorted(listed) == sorted(ALL_ENV_IDS)


def test_results_in_the_readme_are_those_of_the_leaderboard() -> None:
    with (ROOT / "docs" / "leaderboard.csv").open(encoding="utf-8") as file:
        rows = {(row["task"], row["agent"], row["metric"]): row for row in csv.DictReader(file)}
    for task, agent, cell in _readme_results():
        row = rows.get((task, agent, task_named(task).headline))
        assert (row is None) == (cell == ""), (task, agent)
        if row is not None:
            bold = row["verdict"] == "better"
            mean = float(row["mean"])
            text = f"{mean:.{2 if task in ('Waypoint', 'Metastable') else 1}f}"
            assert cell == (f"**{text}**" if bold else text), (task, agent)


def _measured(benchmark: str) -> dict[str, Any]:
    path = ROOT / "benchmarks" / "results" / f"{benchmark}.json"
    return json.loads(path.read_text(encoding="utf-8"))


def test_speeds_in_the_readme_are_those_measured() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    kept = {**_measured("kernel"), **_measured("environments"), **_measured("training")}
    million = 1e-6
    ppo = kept["training_collecting"] + kept["training_update"]
    for part in (
        f"{million * kept['batch_steps_per_second']:.1f} million walking steps per second, "
        f"{round(kept['batch_over_solve_ivp'], -2):,.0f} times",
        f"{million * kept['vector_1024_fixed_steps_per_second']:.1f} million steps per second, "
        f"{kept['vector_over_sync_cartpole']:.0f} times",
        f"{million * kept['vector_1024_random_steps_per_second']:.1f} million steps per second, "
        f"{kept['random_vector_over_sync_cartpole']:.0f} times",
        f"{kept['single_call']:.1f} µs; {kept['jacobian_call']:.0f} µs; {kept['step_heading']:.1f} µs",
        f"{ppo:.0f} µs per step, of which the gradient updates take {kept['training_update']:.0f} µs",
    ):
        assert part in text


def test_times_of_the_first_step_are_those_measured() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    kept = _measured("startup")
    assert f"about {kept['cold_start']:.0f} seconds of processor time" in text
    assert f"from disk, in {kept['warm_start']:.1f} seconds" in text


def test_the_cost_of_infos_is_that_measured() -> None:
    text = (DOCS / "environments.md").read_text(encoding="utf-8")
    costs = {n: _measured("infos")[f"infos_{n}_cost"] for n in (16, 64, 1024, 4096)}
    shares = [f"{costs[n]:.0f} % with {n:,}" for n in costs]
    assert f"{', '.join(shares[:-1])} and {shares[-1]} walkers" in text

"""Compiled and plain kernels give the same steps, and machine code is renewed when any formula changes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from lean_yaw_env import Walker
from lean_yaw_env.kernel import compilation, fusing, notice
from lean_yaw_env.parameters import Vector

ROOT = Path(compilation.__file__).parents[2]


def _run(code: str, root: Path = ROOT, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root), **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


_STEPS = """
import json
import numpy as np
from lean_yaw_env import Walker, WalkerParameters
from lean_yaw_env.batch import step_batch
from lean_yaw_env.kernel import step
from lean_yaw_env.analysis.step_derivatives import differentiate_step
from lean_yaw_env.walker import require_command

walker = Walker(WalkerParameters(ankle_stiffness=0.02, ankle_damping=0.01))
states = json.loads({states!r})
results = []
for state in states:
    one = walker.step(state, mass_offset=0.02, previous_offset=-0.01)
    results.append([*one.state, one.duration, *one.displacement, *one.energy, one.least_normal_force])
batch = step_batch(walker.parameters, states, 1.0, mass_offsets=0.02, previous_offsets=-0.01)
derivatives = differentiate_step(walker, states[0], "left", require_command(0.3, 0.02, -0.01))
print(json.dumps({{
    "results": results,
    "batch": batch.states.tolist(),
    "by_state": derivatives.by_state.tolist(),
    "compiled": hasattr(step.step, "signatures"),
}}))
"""


def test_kernels_give_the_same_steps_with_the_compiler_off(gait: Vector) -> None:
    # the gait, a disturbed one, and a backward fall
    states = json.dumps([gait.tolist(), (gait * 1.2).tolist(), [0.0, 0.155, 0.0, 0.15, 0.0]])
    code = _STEPS.format(states=states)
    plain = json.loads(_run(code, NUMBA_DISABLE_JIT="1"))
    compiled = json.loads(_run(code))
    assert (plain["compiled"], compiled["compiled"]) == (False, True)
    # the machine's fused operations and numpy's complex arithmetic round differently; a step damps such errors
    for name, tolerance in (("results", 1e-13), ("batch", 1e-13), ("by_state", 1e-11)):
        difference = np.abs(np.array(plain[name]) - np.array(compiled[name]))
        assert difference.max() < tolerance, name
    batch, single = np.array(compiled["batch"]), np.array(compiled["results"])[:, :5]
    assert (batch == single).all()


def test_what_is_compiled_apart_says_so_when_it_cannot_be() -> None:
    call = compilation.apart("lean_yaw_test_apart")

    @compilation.compiled_apart("lean_yaw_test_apart", 4, 1, 9.0)
    def halve(numbers, k):
        if numbers[0] < 0.0:
            raise ValueError("negative")
        numbers[1 + k] = 0.5 * numbers[0]

    @njit
    def caller(numbers, k):
        call(numbers, k)
        return numbers[1 + k]

    assert caller(np.array([3.0, 0.0, 0.0, 0.0]), 2) == 1.5
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "unraisablehook", lambda _: None)
        assert caller(np.array([-3.0, 0.0, 0.0, 0.0]), 1) == 9.0


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with the real compilation module, one formula, one entry point that inlines it, and one a folder away."""
    root = tmp_path / "lean_yaw_env"
    kernel, tasks = root / "kernel", root / "envs" / "tasks"
    for folder in (kernel, tasks):
        folder.mkdir(parents=True)
    for folder in (root, kernel, root / "envs", tasks):
        (folder / "__init__.py").write_text("")
    for module in (compilation, fusing, notice):
        shutil.copy(str(module.__file__), kernel)
    _write_formulas(root, 1.0, 10.0)
    (kernel / "entry.py").write_text(
        "from lean_yaw_env.kernel.compilation import entry_point\n"
        "from lean_yaw_env.kernel.formula import formula\n"
        "@entry_point()\ndef near(x):\n    return formula(x)\n"
    )
    (tasks / "task.py").write_text(
        "from lean_yaw_env.envs.shared import shared\n"
        "from lean_yaw_env.kernel.compilation import entry_point\n"
        "@entry_point()\ndef far(x):\n    return shared(x)\n"
    )
    return tmp_path


def _write_formulas(root: Path, near: float, far: float) -> None:
    head = "from lean_yaw_env.kernel.compilation import inlined\n@inlined\n"
    (root / "kernel" / "formula.py").write_text(f"{head}def formula(x):\n    return x + {near}\n")
    (root / "envs" / "shared.py").write_text(f"{head}def shared(x):\n    return x + {far}\n")


_CALL = """
from lean_yaw_env.kernel.entry import near
from lean_yaw_env.envs.tasks.task import far
print(near(0.5), far(0.5), sum(near.stats.cache_hits.values()), sum(far.stats.cache_hits.values()))
"""


def _call(package: Path) -> list[float]:
    printed = _run(_CALL, package, NUMBA_CACHE_DIR=str(package / "cache"))
    return [float(word) for word in printed.split()]


def test_machine_code_is_kept_until_a_formula_in_another_file_changes(package: Path) -> None:
    assert _call(package) == [1.5, 10.5, 0, 0]
    assert _call(package) == [1.5, 10.5, 1, 1]
    _write_formulas(package / "lean_yaw_env", 2.0, 10.0)
    near, far, hits, _ = _call(package)
    assert (near, far, hits) == (2.5, 10.5, 0)
    _write_formulas(package / "lean_yaw_env", 2.0, 20.0)
    assert _call(package) == [2.5, 20.5, 1, 0]


def test_machine_code_is_kept_when_files_are_only_touched(package: Path) -> None:
    _call(package)
    for path in package.rglob("*.py"):
        os.utime(path, (1e9, 1e9))
    assert _call(package) == [1.5, 10.5, 1, 1]


_UNWRITABLE = """
import warnings
from numba.core.dispatcher import Dispatcher

def refuse(self):
    raise RuntimeError("cannot cache function: no locator available")

Dispatcher.enable_caching = refuse
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from lean_yaw_env.kernel.entry import near
    from lean_yaw_env.envs.tasks.task import far
    value = near(0.5), far(0.5)
print(*value, len(caught), caught[0].category.__name__, "NUMBA_CACHE_DIR" in str(caught[0].message))
"""


def test_without_a_folder_for_machine_code_kernels_work_and_one_warning_says_so(
    package: Path,
) -> None:
    printed = _run(_UNWRITABLE, package)
    assert printed.split() == ["1.5", "10.5", "1", "RuntimeWarning", "True"]


def test_importing_the_package_compiles_nothing_and_loads_no_compiler() -> None:
    printed = _run(
        "import sys, lean_yaw_env; print('numba' in sys.modules, 'scipy' in sys.modules)"
    )
    assert printed.split() == ["False", "False"]


def test_the_walker_compiles_without_its_environments() -> None:
    # what a script that only steps has to wait for
    code = "import sys; from lean_yaw_env import Walker; print('lean_yaw_env.envs.dynamics' in sys.modules)"
    assert _run(code).strip() == "False"
    assert Walker().parameters.hip_width == 0.3

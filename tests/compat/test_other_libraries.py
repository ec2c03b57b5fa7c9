"""Other libraries take the environments: the programs of ``docs/other_libraries.md`` run, and what they leave is right.

Each program runs on its own, as a user would run it, with checks at its end. A library that is missing is a skip that names it.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "other_libraries.md"
SECTION = re.compile(r"^## (.+?)\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PROGRAMS = {
    name: "\n".join(BLOCK.findall(text))
    for name, text in SECTION.findall(PAGE.read_text(encoding="utf-8"))
}
RLLIB = "ray[rllib]>=2.60"

# of each section: the modules that it needs beside the package, and what must hold after its program
CHECKS = {
    "Gymnasium": (
        ("torch", "array_api_compat"),
        """
        assert observations.dtype == torch.float32 and observations.shape == (4, 6)
        assert rewards.dtype == torch.float64 and terminations.dtype == torch.bool
        assert infos["fall"].dtype == torch.int64 and infos["state"].shape == (4, 5)
        assert nothing == {}
        own = lean.unwrapped.simulation.observations
        assert views.data_ptr() == own.ctypes.data  # no copy
        lean.step(torch.ones(4, 2))
        assert (views.numpy() == own).all()
        """,
    ),
    "Stable-Baselines3": (
        ("stable_baselines3", "moviepy", "pygame"),
        """
        from pathlib import Path
        assert model.num_timesteps == 1024
        (video,) = Path("videos").glob("*.mp4")
        assert video.stat().st_size > 5_000
        """,
    ),
    "sb3-contrib": (
        ("sb3_contrib",),
        """
        assert model.num_timesteps == 128
        assert (walkers.reset()[:, 3:5] == 0.0).all()  # the rates
        """,
    ),
    "TorchRL": (
        ("torchrl",),
        """
        if __name__ == "__main__":
            import torch
            assert len(walk) == 100 or walk["next", "done"][-1]
            assert walks.batch_size == (2, 100) and many.batch_size == (64, 100)
            for each in (walk, walks, many):
                assert each["next", "fall"].dtype == torch.int64
                assert each["next", "state"].shape == (*each.batch_size, 5)
        """,
    ),
    "Tianshou": (
        ("tianshou",),
        """
        assert result.train_step == 1024 and result.update_step == 2
        """,
    ),
    "skrl": (
        ("skrl",),
        """
        after = list(agent.policy.parameters())
        assert all(not torch.equal(old, new) for old, new in zip(before, after, strict=True))
        """,
    ),
    "Minari": (
        ("minari", "h5py", "jax"),
        """
        import numpy as np
        assert len(episodes) == 3
        options = again.unwrapped.options
        assert options == env.unwrapped.options and options.horizon == 10.0
        assert options.parameters.slope == 0.012
        # the same seed and actions give the same episode, infos included
        for seed, episode in enumerate(episodes):
            observation, info = again.reset(seed=seed)
            for k, action in enumerate(episode.actions):
                assert np.array_equal(observation, episode.observations[k])
                for key in ("state", "footprint", "fall", "time"):
                    assert np.array_equal(info[key], episode.infos[key][k])
                observation, reward, terminated, truncated, info = again.step(action)
                assert reward == episode.rewards[k]
            assert np.array_equal(info["fall"], episode.infos["fall"][-1])
        """,
    ),
}


def run(program: str, folder: Path, python: str | Path = sys.executable) -> None:
    """Run a program in a folder, without the checkout on its path; it must end without an error."""
    script = folder / "program.py"
    script.write_text(program, encoding="utf-8")
    environment = {
        **os.environ,
        "MINARI_DATASETS_PATH": str(folder / "datasets"),
        "OMP_NUM_THREADS": "1",
        "RAY_AUTH_MODE": "disabled",
        "SDL_VIDEODRIVER": "dummy",
    }
    done = subprocess.run(
        [str(python), str(script)], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]


def test_every_section_has_a_program_and_checks() -> None:
    assert set(PROGRAMS) == {*CHECKS, "RLlib"}
    assert all(PROGRAMS.values())


@pytest.mark.parametrize("library", CHECKS)
def test_a_library_s_program_runs(library: str, tmp_path: Path) -> None:
    modules, checks = CHECKS[library]
    for module in modules:
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is missing: pip install 'lean-yaw-env[compat]'")
    run(f"{PROGRAMS[library]}\n{textwrap.dedent(checks)}", tmp_path)


@pytest.fixture(scope="module")
def python_of_rllib(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of an environment in which RLlib and its Gymnasium are installed, with this environment's other libraries."""
    if importlib.util.find_spec("torchrl") is None:
        pytest.skip("RLlib is not installed without the others: pip install 'lean-yaw-env[compat]'")
    home = tmp_path_factory.mktemp("rllib")
    own = [
        sys.executable,
        "-c",
        "import lean_yaw_env, numpy; print(lean_yaw_env.__file__, numpy.__file__)",
    ]
    files = subprocess.check_output(own, cwd=home, text=True).split()
    subprocess.run([sys.executable, "-m", "venv", home], check=True)
    python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    place = "import sysconfig; print(sysconfig.get_path('purelib'))"
    libraries = Path(subprocess.check_output([python, "-c", place], text=True).strip())
    folders = dict.fromkeys(str(Path(file).parents[1]) for file in files)
    (libraries / "libraries.pth").write_text("\n".join(folders))
    install = [python, "-m", "pip", "install", "--quiet", "--retries", "1", RLLIB]
    done = subprocess.run(install, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip(f"{RLLIB} cannot be installed: {done.stderr.splitlines()[-1:]}")
    return python


def test_rllib_s_program_runs_in_an_environment_of_its_own(
    python_of_rllib: Path, tmp_path: Path
) -> None:
    """RLlib requires one exact version of Gymnasium, another one than the newest."""
    checks = """
    if __name__ == "__main__":
        assert result["training_iteration"] == 1
        assert result["num_env_steps_sampled_lifetime"] >= 256
    """
    run(f"{PROGRAMS['RLlib']}\n{textwrap.dedent(checks)}", tmp_path, python_of_rllib)

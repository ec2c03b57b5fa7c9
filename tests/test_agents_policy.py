"""Policies on disk: what is saved is what is loaded, and nothing but a sound policy for this package's environments is."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
import safetensors.torch
import torch

import agents
from agents.learning.algorithms import train
from agents.learning.ppo import PPOSettings
from agents.observations import ObservationLayout
from agents.policies import policy_files
from agents.policies.policy import Policy, PolicyCard
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.parameters import WalkerParameters

ID = "LeanYaw/Heading-v1"
FEATURES = 7


def weights(seed: int = 0, hidden: int = 8) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(seed)

    def draw(*shape: int) -> np.ndarray:
        return generator.normal(0.0, 0.5, shape).astype(np.float32)

    return {
        "layers.0.weight": draw(hidden, FEATURES),
        "layers.0.bias": draw(hidden),
        "layers.1.weight": draw(2, hidden),
        "layers.1.bias": draw(2),
        "log_std": draw(2),
        "observation_mean": draw(FEATURES),
        "observation_variance": draw(FEATURES) ** 2,
    }


def card(**changes) -> PolicyCard:
    options = changes.pop("options", EnvOptions())
    values = {
        "env_id": ID,
        "options": options,
        "layout": ObservationLayout.of("Heading", options),
        "seed": 4,
        "settings": {"steps": 10, "time_constant": float("inf")},
        "training": {"seconds": 1.5},
        "versions": {"numpy": "2"},
    }
    return PolicyCard(**values | changes)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    agents.save(Policy(card(), weights()), tmp_path)
    return tmp_path


def change(folder: Path, **values) -> None:
    path = folder / policy_files.CARD_FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


def test_a_policy_computes_what_torch_computes():
    w = weights()
    policy = Policy(card(), w)
    network = torch.nn.Sequential(
        torch.nn.Linear(FEATURES, 8), torch.nn.Tanh(), torch.nn.Linear(8, 2)
    )
    state = {"0.weight": "layers.0.weight", "0.bias": "layers.0.bias", "2.weight": "layers.1.weight", "2.bias": "layers.1.bias"}  # fmt: skip
    network.load_state_dict({k: torch.from_numpy(w[v]) for k, v in state.items()})
    observation = np.random.default_rng(1).normal(size=(50, FEATURES)).astype(np.float32)
    normal = (observation - w["observation_mean"]) / np.sqrt(w["observation_variance"] + 1e-8)
    expected = network(torch.from_numpy(np.clip(normal, -10, 10))).detach().numpy()
    # float32, in another order of summation
    assert policy.predict(observation)[0] == pytest.approx(np.clip(expected, -1, 1), abs=2e-6)


def test_drawn_actions_have_the_policy_s_deviation_around_its_mean():
    w = weights()
    w["layers.1.weight"] *= 0.0
    w["layers.1.bias"] *= 0.0
    w["log_std"][:] = np.log(0.1)
    policy = Policy(card(), w)
    drawn = policy.predict(np.zeros((4000, FEATURES)), deterministic=False)[0]
    # standard errors of mean and deviation: 0.1 / sqrt(4000), and that over sqrt(2); five of them
    assert np.abs(drawn.mean(axis=0)).max() < 5 * 0.1 / np.sqrt(4000)
    assert np.abs(drawn.std(axis=0) - 0.1).max() < 5 * 0.1 / np.sqrt(8000)
    assert not policy.predict(np.zeros((2, FEATURES)))[0].any()


@pytest.mark.parametrize(
    "options",
    [
        EnvOptions(),
        EnvOptions(mirror=False, horizon=float("inf"), mass_offset_range=0.02),
        EnvOptions(parameters=WalkerParameters(hip_width=0.2, friction_limit=0.7)),
    ],
)
def test_what_is_saved_is_what_is_loaded(tmp_path, options):
    w = weights()
    layout = ObservationLayout.of("Heading", options)
    extra = len(layout.names) - FEATURES  # the stance foot, unless mirrored
    w["layers.0.weight"] = np.pad(w["layers.0.weight"], ((0, 0), (0, extra)))
    w["observation_mean"] = np.pad(w["observation_mean"], (0, extra))
    w["observation_variance"] = np.pad(w["observation_variance"], (0, extra))
    saved = Policy(card(options=options), w)
    agents.save(saved, tmp_path)
    loaded = agents.load(tmp_path, env_id=ID)
    assert loaded.card == saved.card
    observation = np.random.default_rng(2).normal(size=(3, len(layout.names)))
    assert np.array_equal(loaded.predict(observation)[0], saved.predict(observation)[0])
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        policy_files.CARD_FILE,
        policy_files.WEIGHTS_FILE,
    ]


def test_a_policy_file_that_holds_pickled_code_is_refused_and_not_run(folder, tmp_path):
    ran = tmp_path / "ran"

    class Bomb:
        def __reduce__(self):
            return (Path.touch, (ran,))

    for name in (policy_files.WEIGHTS_FILE, policy_files.CARD_FILE):
        (folder / name).write_bytes(pickle.dumps(Bomb()))
        with pytest.raises(agents.PolicyFileError):
            agents.load(folder)
    assert not ran.exists()


def test_another_environment_or_version_is_refused_with_what_to_do(folder):
    with pytest.raises(
        agents.PolicyFileError,
        match="trained for the env_id 'LeanYaw/Heading-v1', not for 'LeanYaw/Walk-v1'",
    ):
        agents.load(folder, env_id="LeanYaw/Walk-v1")
    change(folder, env_id="LeanYaw/Heading-v99")
    with pytest.raises(agents.PolicyFileError, match=r"environment is LeanYaw/Heading-v\d+, not LeanYaw/Heading-v99.*train a policy anew"):  # fmt: skip
        agents.load(folder)
    change(folder, env_id="CartPole-v1")
    with pytest.raises(agents.PolicyFileError, match="env_id must be one of"):
        agents.load(folder)


def test_another_observation_is_refused(folder):
    observation = json.loads((folder / policy_files.CARD_FILE).read_text())["observation"]
    observation["scales"][0] = 1.0
    change(folder, observation=observation)
    with pytest.raises(agents.PolicyFileError, match="trained on other observations"):
        agents.load(folder)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"format": "pickle"}, "format must be"),
        ({"format_version": 2}, "format version 2"),
        ({"surprise": 1}, "must hold format"),
        ({"seed": "0"}, "seed must be of type int"),
        ({"seed": True}, "seed must be of type int"),
        ({"algorithm": "../x"}, "algorithm must be a lower-case word"),
        ({"activation": "eval"}, "activation must be one of tanh, relu"),
        ({"output": "eval"}, "output must be one of clip, tanh"),
        ({"options": {"made_up": 1}}, "options must hold"),
        ({"options": {"parameters": 3}}, "parameters must hold"),
        ({"options": {"horizon": -1.0}}, "horizon must be in"),
        ({"weights_sha256": "0"}, "is not the file that"),
    ],
)
def test_a_damaged_card_is_refused_by_what_is_wrong(folder, values, message):
    change(folder, **values)
    with pytest.raises(agents.PolicyFileError, match=message):
        agents.load(folder)


def test_damaged_or_missing_files_are_refused(folder):
    weights_file = folder / policy_files.WEIGHTS_FILE
    weights_file.write_bytes(weights_file.read_bytes()[:-1])
    with pytest.raises(agents.PolicyFileError, match="is not the file that"):
        agents.load(folder)
    weights_file.unlink()
    with pytest.raises(agents.PolicyFileError, match="cannot be read"):
        agents.load(folder)
    (folder / policy_files.CARD_FILE).write_text("{")
    with pytest.raises(agents.PolicyFileError, match="is not JSON"):
        agents.load(folder)
    with pytest.raises(agents.PolicyFileError, match="there is no file"):
        agents.load(folder / "nowhere")


@pytest.mark.parametrize("kind", ["bfloat16", "float8_e4m3fn", "float8_e5m2", "float16", "float64"])
def test_weights_of_other_number_formats_are_refused(folder, kind):
    kept = {
        name: torch.from_numpy(value).to(getattr(torch, kind)) for name, value in weights().items()
    }
    data = safetensors.torch.save(kept)
    (folder / policy_files.WEIGHTS_FILE).write_bytes(data)
    change(folder, weights_sha256=hashlib.sha256(data).hexdigest())
    with pytest.raises(agents.PolicyFileError, match="float32"):
        agents.load(folder)


@pytest.mark.parametrize("name", [policy_files.CARD_FILE, policy_files.WEIGHTS_FILE])
@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "huge"])
@pytest.mark.skipif(os.name == "nt", reason="there are no pipes and devices among files")
def test_what_is_no_regular_file_of_moderate_size_is_refused_and_not_opened(folder, name, kind):
    (folder / name).unlink()
    if kind == "folder":
        (folder / name).mkdir()
    elif kind == "pipe":
        os.mkfifo(folder / name)  # opening it would wait for a writer
    elif kind == "device":
        (folder / name).symlink_to("/dev/zero")  # reading it would never end
    else:
        with (folder / name).open("wb") as file:
            file.truncate(2**40)  # a sparse file, larger than memory
    with pytest.raises(agents.PolicyFileError, match=r"not a regular file|at most .* are read"):
        agents.load(folder)


def test_weights_that_are_no_network_are_refused():
    good = weights()
    for name, value, message in [
        ("layers.0.weight", good["layers.0.weight"][:, :-1], "shape"),
        ("layers.1.bias", good["layers.1.bias"].astype(float), "float32"),
        ("log_std", np.array([0.0, np.nan], dtype=np.float32), "finite"),
        ("observation_variance", -good["observation_variance"] - 1, "negative"),
        ("extra", good["log_std"], "weights must be"),
        ("layers.5.weight", good["layers.1.weight"], "weights must be"),
    ]:
        with pytest.raises(ValueError, match=message):
            Policy(card(), good | {name: value})
    with pytest.raises(ValueError, match="no layer"):
        Policy(card(), {})


def test_agents_of_the_package_are_found_by_id_algorithm_and_seed(tmp_path, monkeypatch):
    monkeypatch.setattr(policy_files, "SHIPPED", tmp_path)
    for algorithm, seed in [("ppo", 3), ("ppo", 11), ("sac", 2)]:
        folder = policy_files.shipping_folder(ID, algorithm, seed)
        agents.save(Policy(card(algorithm=algorithm, seed=seed), weights(seed)), folder)
    assert (tmp_path / "Heading-v1" / "sac" / "seed2" / policy_files.CARD_FILE).exists()
    assert agents.shipped_seeds(ID, "ppo") == [3, 11]
    assert agents.shipped_seeds(ID, "sac") == [2]
    assert agents.shipped_seeds("LeanYaw/Walk-v1", "ppo") == []
    assert agents.load(ID).card.seed == 3
    assert agents.load(ID, seed=11).card.seed == 11
    assert agents.load(ID, algorithm="sac").card.algorithm == "sac"
    for id_, choices, message in [
        (ID, {"seed": 5}, "no agent of the algorithm 'ppo' for LeanYaw/Heading-v1 with seed 5"),
        (ID, {"algorithm": "sac", "seed": 3}, "'sac' for LeanYaw/Heading-v1 with seed 3"),
        (ID, {"algorithm": "../ppo"}, "algorithm must be a lower-case word"),
        ("LeanYaw/Walk-v1", {}, "no agent of the algorithm 'ppo' for LeanYaw/Walk-v1"),
        ("LeanYaw/Heading-v7", {}, "not LeanYaw/Heading-v7"),
    ]:
        with pytest.raises(agents.PolicyFileError, match=message):
            agents.load(id_, **choices)


def test_a_folder_s_policy_of_another_algorithm_is_refused(folder):
    assert agents.load(folder, algorithm="ppo").card == card()
    with pytest.raises(
        agents.PolicyFileError, match="trained by the algorithm 'ppo', not by 'sac'"
    ):
        agents.load(folder, algorithm="sac")


def test_the_policy_taken_from_a_training_acts_as_the_trained_network(tmp_path):
    settings = PPOSettings(steps=64, walkers=4, steps_per_update=16, batch_size=64, epochs=1, hidden=(8, 6))  # fmt: skip
    trained = train(
        "ppo", ID, settings, seed=1, checkpoint=tmp_path / "c.safetensors", progress=False
    )
    arrays = safetensors.numpy.load((tmp_path / "c.safetensors").read_bytes())
    names = ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net")
    observation = np.random.default_rng(0).normal(size=(20, FEATURES)).astype(np.float32)
    normal = (observation - arrays["observations/mean"]) / np.sqrt(
        arrays["observations/var"] + 1e-8
    )
    signal = np.clip(normal, -10.0, 10.0)
    for k, name in enumerate(names):
        signal = signal @ arrays[f"policy/{name}.weight"].T + arrays[f"policy/{name}.bias"]
        signal = np.tanh(signal) if k < 2 else np.clip(signal, -1.0, 1.0)
    # float32 against float64
    assert trained.policy.predict(observation)[0] == pytest.approx(signal, abs=1e-5)


OTHERS = "cmaes matplotlib moviepy optuna PIL pygame rich safetensors stable_baselines3 sympy torch tqdm typer xarray"
"""Libraries of the package's extras."""
WITHOUT = """
import sys
class Missing:
    def find_spec(name, path=None, target=None):
        if name.partition(".")[0] in LIBRARIES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Missing)
"""


def without(libraries: str, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program as where some libraries are not installed."""
    code = f"LIBRARIES = {libraries.split()!r}{WITHOUT}{program}"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True)


def core_alone(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program as where only the core's dependencies are installed."""
    return without(OTHERS, program, *arguments)


def test_the_core_alone_runs_controllers_and_says_what_policies_need():
    program = """
from agents import AgentRequest, FixedController, load, make_agent
from agents.evaluation.scoring import run_episodes
from lean_yaw_env.envs.options import EnvOptions
short = EnvOptions(horizon=3.0)
for agent in (FixedController(), make_agent("lqr", AgentRequest("LeanYaw/Walk-v1", short))):
    print(run_episodes(agent, "Walk", episodes=1, options=short).survived)
try:
    load("LeanYaw/Walk-v1")
except ImportError as error:
    print(error)
"""
    done = core_alone(program)
    assert done.returncode == 0, done.stderr
    hint = "safetensors is not installed, run `pip install 'lean-yaw-env[agents]'`"
    assert done.stdout.splitlines() == ["[ True]", "[ True]", hint]


@pytest.mark.parametrize(
    ("name", "start"), [("agents", "run_module('agents'"), ("train", "run_path('train.py'")]
)
def test_the_command_line_says_what_it_needs(name, start):
    done = core_alone(f"import runpy; runpy.{start}, run_name='__main__')", "--help")
    assert done.returncode == 1
    hint = f"{name}: typer is not installed, run `pip install 'lean-yaw-env[train]'`"
    assert done.stderr.strip() == hint


@pytest.mark.parametrize(
    ("library", "command"), [("torch", "train"), ("optuna", "tune feedback Heading")]
)
def test_a_command_says_what_installs_a_library_that_it_alone_needs(library, command):
    program = "import runpy; runpy.run_module('agents', run_name='__main__')"
    done = without(library, program, *command.split())
    assert done.returncode == 1
    name = command.split()[0]
    hint = f"{name}: {library} is not installed, run `pip install 'lean-yaw-env[train]'`"
    assert done.stderr.strip() == hint

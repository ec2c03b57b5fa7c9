"""A trained policy for inference: a small network in numpy, with all it takes to know what it was trained for."""

from __future__ import annotations

import contextlib
import importlib.metadata
import platform
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lean_yaw_env import __version__
from lean_yaw_env.envs.options import ACTION_SIZE, EnvOptions
from lean_yaw_env.validation import require_choice, require_flag

from ..agent import State
from ..observations import ObservationLayout

Weights = Mapping[str, NDArray[np.float32]]

ACTIVATIONS: dict[str, Callable[[NDArray[np.float32]], NDArray[np.float32]]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, np.float32(0.0)),
}
"""Between two layers."""

OUTPUTS: dict[str, Callable[[NDArray[np.float32]], NDArray[np.float32]]] = {
    "clip": lambda x: np.clip(x, np.float32(-1.0), np.float32(1.0)),
    "tanh": np.tanh,
}
"""After the last layer: keeps actions within the action space."""

NORMALISATION_FLOOR = 1e-8
"""Added to an observation's variance, as Stable-Baselines3's ``VecNormalize`` does."""
NORMALISED_LIMIT = 10.0
"""Bound of a normalised observation, as there."""
LOG_STD_LIMITS = (np.float32(-20.0), np.float32(2.0))
"""Bounds of a logarithm of a deviation that a layer gives, as in Stable-Baselines3's SAC."""

MEMORY = "memory"
"""Of the weights of an LSTM."""

_PACKAGES = ("numpy", "scipy", "numba", "gymnasium", "torch", "stable-baselines3", "sb3-contrib")


def package_versions() -> dict[str, str]:
    """Versions of the packages that a result depends on; those that are not installed are left out."""
    found = {"python": platform.python_version(), "lean-yaw-env": __version__}
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found


def require_algorithm(name: str) -> str:
    """The name of an algorithm, which may be no path, or ``ValueError``."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise ValueError(f"algorithm must be a lower-case word, as ppo, got {name!r}")
    return name


@dataclass(frozen=True)
class PolicyCard:
    """What a policy is and where it comes from; plain values only.

    Attributes
    ----------
    env_id : the environment it was trained for, with its version
    options : those of the environment
    layout : the observation it takes
    algorithm : that trained it, as ``ppo``; a lower-case word, since it names the agent and its folder
    activation, output : names in ``ACTIVATIONS`` and ``OUTPUTS``
    seed : of its training
    settings : of its training
    training : what came of it: steps, seconds
    versions : of the packages that trained it
    """

    env_id: str
    options: EnvOptions
    layout: ObservationLayout
    algorithm: str = "ppo"
    activation: str = "tanh"
    output: str = "clip"
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    training: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_algorithm(self.algorithm)
        require_choice("activation", self.activation, ACTIVATIONS)
        require_choice("output", self.output, OUTPUTS)


class Policy:
    """A small network from observations to actions, with Stable-Baselines3's ``predict``; it needs no torch.

    It is a multilayer perceptron. What it remembers from step to step, if anything, is its latest observations, or the state of a long
    short-term memory (LSTM; Hochreiter and Schmidhuber 1997) in front of the perceptron, or both. ``predict`` returns it and takes it.

    Parameters
    ----------
    card : what the policy is
    weights : float32 arrays by name
        ``layers.<k>.weight`` (outputs, inputs) and ``layers.<k>.bias`` (outputs,) for k = 0, 1, ...; ``observation_mean`` and
        ``observation_variance`` (features,), which normalise observations, or (frames features,) of a network that sees the latest frames,
        the oldest first; of an LSTM ``memory.input`` (4 units, inputs), ``memory.state`` (4 units, units) and ``memory.bias`` (4 units,), for
        the input, forget, cell and output gates; ``log_std`` (2,), the logarithm of the standard deviation of
        actions that are drawn, before they are kept in bounds, or ``log_std.weight`` and ``log_std.bias``, a layer beside the last that gives it.
    generator : draws actions for ``deterministic=False``; by default seeded by the card's seed

    Raises
    ------
    ValueError
        If a weight is missing, unknown, of a wrong shape or type, or not finite.
    """

    def __init__(
        self, card: PolicyCard, weights: Weights, generator: np.random.Generator | None = None
    ) -> None:
        self.card = card
        self.weights = dict(weights)
        features = len(card.layout.names)
        self.depth = _require_weights(self.weights, features)
        earlier = len(self.weights["observation_mean"]) - features
        units = len(self.weights.get(f"{MEMORY}.bias", ())) // 4
        self._memory_sizes = (*((earlier,) if earlier else ()), *((units, units) if units else ()))
        self._scale = 1.0 / np.sqrt(
            self.weights["observation_variance"].astype(float) + NORMALISATION_FLOOR
        )
        self._generator = np.random.default_rng(card.seed) if generator is None else generator

    def predict(
        self,
        observation: ArrayLike,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], State]:
        """The network's actions, and what it remembers; see ``Agent.predict``.

        Raises
        ------
        ValueError
            If the observation is none of the environment's, or the state not one of so many walkers.
        """
        require_flag("deterministic", deterministic)
        seen = self.card.layout.require(observation)
        recalled = self._recalled(state, episode_start, seen.shape[:-1])
        kept: tuple[NDArray[Any], ...] = ()
        if len(self._memory_sizes) % 2:  # frames
            frames = np.concatenate([recalled[0], seen], axis=-1)
            seen, kept, recalled = frames, (frames[..., -self._memory_sizes[0] :],), recalled[1:]
        signal = before = self._normalised(seen)
        if recalled:
            signal, cell = self._long_short_term(signal, *recalled)
            before, kept = signal, (*kept, signal, cell)
        activate = ACTIVATIONS[self.card.activation]
        for k in range(self.depth):
            before, signal = signal, self._linear(f"layers.{k}", signal)
            if k < self.depth - 1:
                signal = activate(signal)
        if not deterministic:
            signal = signal + np.exp(self._log_std(before)) * self._generator.standard_normal(
                signal.shape, dtype=np.float32
            )
        return OUTPUTS[self.card.output](signal), kept or None

    def _recalled(
        self, state: State, episode_start: NDArray[np.bool_] | None, batch: tuple[int, ...]
    ) -> tuple[NDArray[Any], ...]:
        """What is remembered of the episodes so far: zeros where they start."""
        shapes = [(*batch, size) for size in self._memory_sizes]
        if state is None or not shapes:
            return tuple(np.zeros(shape, np.float32) for shape in shapes)
        if [np.shape(each) for each in state] != shapes:
            raise ValueError(
                f"state must be what predict returned for these walkers, arrays of shapes {shapes}, got {[np.shape(each) for each in state]}"
            )
        goes_on = np.float32(1.0) - np.float32(0.0 if episode_start is None else episode_start)
        return tuple(np.asarray(goes_on)[..., None] * each for each in state)

    def _long_short_term(
        self, signal: NDArray[np.float32], hidden: NDArray[np.float32], cell: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The next hidden and cell states of the LSTM."""
        gates = signal @ self.weights[f"{MEMORY}.input"].T + self.weights[f"{MEMORY}.bias"]
        gates = gates + hidden @ self.weights[f"{MEMORY}.state"].T
        taken, remembered, new, shown = np.split(gates, 4, axis=-1)
        cell = _sigmoid(remembered) * cell + _sigmoid(taken) * np.tanh(new)
        return _sigmoid(shown) * np.tanh(cell), cell

    def _linear(self, name: str, signal: NDArray[np.float32]) -> NDArray[np.float32]:
        return signal @ self.weights[f"{name}.weight"].T + self.weights[f"{name}.bias"]

    def _log_std(self, signal: NDArray[np.float32]) -> NDArray[np.float32]:
        """The logarithm of the actions' deviation: a constant, or a layer beside the last."""
        if "log_std" in self.weights:
            return self.weights["log_std"]
        return np.clip(self._linear("log_std", signal), *LOG_STD_LIMITS)

    def _normalised(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        centred = (observation - self.weights["observation_mean"].astype(float)) * self._scale
        return np.clip(centred, -NORMALISED_LIMIT, NORMALISED_LIMIT).astype(np.float32)


def _sigmoid(x: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.float32(0.5) + np.float32(0.5) * np.tanh(np.float32(0.5) * x)


def _require_weights(weights: Weights, features: int) -> int:
    """Check names, shapes and values of a network's weights, and return its number of layers."""
    depth = sum(name.startswith("layers.") and name.endswith(".weight") for name in weights)
    if depth == 0:
        raise ValueError("weights must hold layers.0.weight, but hold no layer")
    frames = max(1, len(np.atleast_1d(weights.get("observation_mean", ()))) // features)
    inputs = before = frames * features
    expected: dict[str, tuple[int, ...]] = {
        "observation_mean": (inputs,),
        "observation_variance": (inputs,),
    }
    if f"{MEMORY}.bias" in weights:
        units = weights[f"{MEMORY}.bias"].size // 4
        expected[f"{MEMORY}.input"] = (4 * units, inputs)
        expected[f"{MEMORY}.state"] = (4 * units, units)
        expected[f"{MEMORY}.bias"] = (4 * units,)
        inputs = before = units
    for k in range(depth):
        name = f"layers.{k}.weight"
        shape = weights[name].shape if name in weights else ()
        outputs = ACTION_SIZE if k == depth - 1 else (shape[0] if shape else 0)
        expected[name] = (outputs, inputs)
        expected[f"layers.{k}.bias"] = (outputs,)
        before, inputs = inputs, outputs
    if "log_std" in weights:
        expected["log_std"] = (ACTION_SIZE,)
    else:
        expected |= {"log_std.weight": (ACTION_SIZE, before), "log_std.bias": (ACTION_SIZE,)}
    if set(weights) != set(expected):
        raise ValueError(f"weights must be {sorted(expected)}, got {sorted(weights)}")
    for name, shape in expected.items():
        array = weights[name]
        if array.dtype != np.float32 or array.shape != shape:
            raise ValueError(
                f"weight {name} must be float32 of shape {shape}, got {array.dtype} of shape {array.shape}"
            )
        if not np.isfinite(array).all():
            raise ValueError(f"weight {name} must hold finite numbers only")
    if (weights["observation_variance"] < 0.0).any():
        raise ValueError("weight observation_variance must not be negative")
    return depth

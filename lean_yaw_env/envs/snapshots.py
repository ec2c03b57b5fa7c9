"""The state of an environment as arrays: all that its next step depends on."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.utils import EzPickle
from numpy.typing import NDArray

from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.validation import require_mapping

State = dict[str, NDArray[Any]]
"""Arrays by name; ``walkers`` and ``tasks`` are records with named fields."""

_ARRAYS = ("walkers", "tasks", "bodies", "observations")
_WORDS = 6  # of 64 bits, that a PCG64 generator's state takes
_WORD = 2**64


class PickledWithState(EzPickle):
    """An environment that is pickled as its arguments and, if episodes are under way, its state."""

    def __getstate__(self: Any) -> dict[str, Any]:
        state = self.get_state() if self.is_under_way else None
        return {**EzPickle.__getstate__(self), "_state": state, "_spec": self.spec}

    def __setstate__(self: Any, kept: dict[str, Any]) -> None:
        EzPickle.__setstate__(self, kept)
        self.spec = kept["_spec"]
        if kept["_state"] is not None:
            self.set_state(kept["_state"])


def state_of(simulation: Simulation, generators: list[np.random.Generator]) -> State:
    """Copies of all that the walkers' next steps depend on."""
    return {
        **{name: getattr(simulation, name).copy() for name in _ARRAYS},
        "generators": np.array([_words_of(each) for each in generators], dtype=np.uint64),
    }


def restore(simulation: Simulation, state: State) -> list[np.random.Generator]:
    """Bring a simulation to a state and return its generators.

    Raises
    ------
    ValueError
        If it is a state of other walkers, or holds what is not a number; nothing has changed then.
    """
    own = {name: getattr(simulation, name) for name in _ARRAYS}
    forms = {name: (array.shape, array.dtype) for name, array in own.items()}
    forms["generators"] = ((simulation.n, _WORDS), np.dtype(np.uint64))
    for name, (shape, kind) in forms.items():
        given = require_mapping("state", state).get(name)
        if not isinstance(given, np.ndarray) or given.shape != shape or given.dtype != kind:
            is_array = isinstance(given, np.ndarray)
            found = f"shape {given.shape} of {given.dtype}" if is_array else repr(given)
            raise ValueError(f"state must hold {name!r} in shape {shape} of {kind}, got {found}")
        for field in given.dtype.names or ():
            values = given[field]
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                raise ValueError(
                    f"state must hold finite numbers, got {name}[{field!r}] = {values}"
                )
    for name, array in own.items():
        array[:] = state[name]
    return [_generator_of(words) for words in state["generators"]]


def plain(state: State) -> dict[str, NDArray[Any]]:
    """The same with records as rows of 64-bit words (n, fields), for files that know no records."""
    return {
        name: array.view(np.uint64).reshape(len(array), -1) if array.dtype.names else array
        for name, array in state.items()
    }


def from_plain(simulation: Simulation, arrays: dict[str, NDArray[Any]]) -> State:
    """A state of this simulation from its ``plain`` arrays, or ``ValueError``."""
    state = dict(arrays)
    for name in ("walkers", "tasks"):
        kind = getattr(simulation, name).dtype
        words = arrays.get(name)
        size = kind.itemsize // 8
        if not isinstance(words, np.ndarray) or words.ndim != 2 or words.shape[1] != size:
            raise ValueError(f"snapshot must hold {name!r} in rows of {size} words, got {words!r}")
        state[name] = np.ascontiguousarray(words, dtype=np.uint64).view(kind)[:, 0]
    return state


def _words_of(generator: np.random.Generator) -> list[int]:
    """The state of a PCG64 generator, as Gymnasium seeds them, in words of 64 bits."""
    state = generator.bit_generator.state
    if state["bit_generator"] != "PCG64":
        raise ValueError(f"np_random must be a PCG64 generator, got {state['bit_generator']}")
    words = [part for key in ("state", "inc") for part in divmod(state["state"][key], _WORD)]
    return [*words, state["has_uint32"], state["uinteger"]]


def _generator_of(words: NDArray[np.uint64]) -> np.random.Generator:
    """The generator of a state from ``_words_of``."""
    high, low, high_increment, low_increment, has_uint32, uinteger = (int(word) for word in words)
    bits = np.random.PCG64()
    bits.state = {
        "bit_generator": "PCG64",
        "state": {"state": high * _WORD + low, "inc": high_increment * _WORD + low_increment},
        "has_uint32": has_uint32,
        "uinteger": uinteger,
    }
    return np.random.Generator(bits)

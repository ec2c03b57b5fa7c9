"""Counter-based random numbers for compiled steps: a walker's n-th number depends on its key and n alone.

SplitMix64 (Steele, Lea, Flood 2014): the output function is a bijection of the counter's multiples of an odd constant. A key is drawn from
the environment's own generator at every reset, so that one environment and a batch of them agree whatever the batch.
"""

from __future__ import annotations

import numpy as np

from lean_yaw_env.kernel.compilation import inlined

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_ONE = np.uint64(1)
_UNIT = 2.0**-53


@inlined
def uniform(stream, low, high):
    """The next number in [low, high); ``stream`` is a record with the fields ``key`` and ``counter``, both uint64."""
    counter = stream.counter + _ONE
    stream.counter = counter
    z = stream.key + counter * _GAMMA
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    z = z ^ (z >> _S31)
    return low + (high - low) * (np.float64(z >> _S11) * _UNIT)


@inlined
def normal(stream):
    """The next number around 0 with standard deviation 1, never beyond 6: the sum of twelve uniform ones, less 6.

    Additions alone give it the same bits on every machine, which a logarithm or a sine does not.
    """
    total = -6.0
    for _ in range(12):
        total += uniform(stream, 0.0, 1.0)
    return total

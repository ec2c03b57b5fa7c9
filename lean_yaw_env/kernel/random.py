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


_LOW, _S32, _S58, _S63 = np.uint64(0xFFFFFFFF), np.uint64(32), np.uint64(58), np.uint64(63)
# The multiplier of PCG64, 128 bits
_HIGH_FACTOR, _LOW_FACTOR = np.uint64(2549297995355413924), np.uint64(4865540595714422341)


@inlined
def _high_product(a, b):
    """The upper 64 of a product's 128 bits."""
    a0, a1, b0, b1 = a & _LOW, a >> _S32, b & _LOW, b >> _S32
    middle = a1 * b0 + ((a0 * b0) >> _S32)
    other = a0 * b1 + (middle & _LOW)
    return a1 * b1 + (middle >> _S32) + (other >> _S32)


@inlined
def raw_number(words):
    """The next 64 bits of NumPy's generator PCG64 (O'Neill 2014), as ``random_raw`` returns them.

    ``words`` (4,) uint64 hold its state and its increment, upper word first.
    """
    high, low = words[0], words[1]
    product = low * _LOW_FACTOR
    high = high * _LOW_FACTOR + low * _HIGH_FACTOR + _high_product(low, _LOW_FACTOR) + words[2]
    low = product + words[3]
    if low < product:
        high = high + _ONE
    words[0], words[1] = high, low
    mixed, turn = high ^ low, high >> _S58
    return (mixed >> turn) | (mixed << ((~turn + _ONE) & _S63))


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

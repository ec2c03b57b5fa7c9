"""Sine, cosine and angle from polynomials, for real and complex arguments alike.

A call into a mathematics library inside a loop over walkers would stop LLVM from vectorising it. The angles of a walker are
bounded, so polynomials without range reduction serve; complex arguments carry derivatives (the complex step).
"""

from math import pi
from typing import Any

import numpy as np
from numba.core import types

from lean_yaw_env.kernel.compilation import by_type, fused

_TURN = 2.0 * pi
_SIXTH = 1.0 / 6.0

# sin(x) = x + x z P(z) and cos(x) = 1 + z Q(z) with z = x^2, for half of an angle between -pi and pi. P and Q are the polynomials whose
# own largest error there is least (2e-16 and 6e-18), found by Chebyshev's method in 40 digits.
_S3, _S5, _S7, _S9, _S11, _S13, _S15 = (
    -0.1666666666666665,
    0.008333333333325924,
    -0.00019841269836464245,
    2.755731805475644e-06,
    -2.505197284086259e-08,
    1.60509690477946e-10,
    -7.408007795516067e-13,
)
_C2, _C4, _C6, _C8, _C10, _C12, _C14, _C16 = (
    -0.5,
    0.04166666666666634,
    -0.0013888888888860676,
    2.4801587292437113e-05,
    -2.755731776616188e-07,
    2.0876630792310255e-09,
    -1.1464687487845909e-11,
    4.627646089543635e-14,
)

# atan(t) / t in powers of t**2 on [0, 1] to 1e-5: Abramowitz and Stegun 4.4.47; a seed for one correction.
_T0, _T1, _T2, _T3, _T4 = 0.9998660, -0.3302995, 0.1801410, -0.0851330, 0.0208351


@fused
def _sine_cosine(angle):
    half = 0.5 * angle
    z = half * half
    # fmt: off
    sine = half + half * (z * (_S3 + z * (_S5 + z * (_S7 + z * (_S9 + z * (_S11 + z * (
        _S13 + z * _S15)))))))
    cosine = 1.0 + z * (_C2 + z * (_C4 + z * (_C6 + z * (_C8 + z * (_C10 + z * (
        _C12 + z * (_C14 + z * _C16)))))))
    # fmt: on
    return 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine


def sine_cosine(angle: Any) -> Any:
    """Sine and cosine of an angle between -pi and pi, to 4e-16 within a quarter turn and 4e-15 beyond."""
    return _sine_cosine(angle)


@by_type(sine_cosine)
def _sine_cosine_by_type(angle):
    if not isinstance(angle, types.Complex):
        return lambda angle: _sine_cosine(angle)

    def with_derivative(angle):
        sine, cosine = _sine_cosine(angle.real)
        return complex(sine, cosine * angle.imag), complex(cosine, -sine * angle.imag)

    return with_derivative


@fused
def within_half_turn(angle):
    """The same direction between -pi and pi: a walker that circles counts its turns in its heading."""
    return angle - _TURN * np.floor(angle.real / _TURN + 0.5)


def square_root(x: Any) -> Any:
    """Square root of a number with positive real part; of a complex one to first order in its imaginary part, which is all of a derivative."""
    return np.sqrt(x)


@by_type(square_root)
def _square_root(x):
    if not isinstance(x, types.Complex):
        return lambda x: np.sqrt(x)

    def with_derivative(x):
        root = np.sqrt(x.real)
        return complex(root, 0.5 * x.imag / root)

    return with_derivative


def quotient(x: Any, y: Any) -> Any:
    """x / y; of complex numbers to first order in their imaginary parts: complex division branches, and a branch stops vectorisation."""
    return x / y


@by_type(quotient)
def _quotient(x, y):
    if not (isinstance(x, types.Complex) or isinstance(y, types.Complex)):
        return lambda x, y: x / y

    def with_derivative(x, y):
        ratio = x.real / y.real
        return complex(ratio, (x.imag - ratio * y.imag) / y.real)

    return with_derivative


@fused
def angle_of(sine, cosine):
    """The angle in (-pi, pi) of a point on the unit circle, to round-off, as analytic function of both coordinates."""
    # a quarter of the angle has its tangent in (-1, 1)
    cosine_half = square_root(0.5 * (1.0 + cosine))
    t = quotient(0.5 * sine, cosine_half * (1.0 + cosine_half))
    z = t * t
    seed = 4.0 * t * (_T0 + z * (_T1 + z * (_T2 + z * (_T3 + z * _T4))))
    seed_sine, seed_cosine = sine_cosine(seed)
    s = sine * seed_cosine - cosine * seed_sine  # the sine of what the seed lacks
    return seed + s * (1.0 + s * s * _SIXTH)

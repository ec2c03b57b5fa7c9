"""Closed forms and second opinions: the rimless wheel, wheels with round feet, the synthetic wheel, rocking sideways, the benchmark bicycle."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys

import numpy as np

from lean_yaw_env.analysis import PassiveMap, find_limit_cycle, planar_gait_rate
from lean_yaw_env.errors import LeanYawError, NoGaitError
from lean_yaw_env.paper.checks import Check, Result, Section, assess, compare_all
from lean_yaw_env.paper.walkers import POINT_FOOT_SLOPE, flat_active_walker, gait_of, root
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.passive import FORE_AFT, PassiveWalker
from lean_yaw_env.vehicles import (
    BENCHMARK_2007,
    benchmark_bicycle,
    canonical_matrices,
    follow_eigenvalues,
)

_WHEELS = ((math.pi / 8.0, 0.2), (0.15, 0.02), (0.3, 0.1))
"""Half the angle between two spokes, and slope, rad."""
_SPEEDS = np.linspace(0.0, 10.0, 41)
"""m/s."""
PROGRAM = """
import json, sys
import numpy as np
from bicycleparameters.models import Meijaard2007Model
from bicycleparameters.parameter_sets import Meijaard2007ParameterSet
given = json.load(sys.stdin)
model = Meijaard2007Model(Meijaard2007ParameterSet(given["parameters"], True))
values = [np.linalg.eigvals(model.form_state_space_matrices(v=v)[0]) for v in given["speeds"]]
print(json.dumps([[[z.real, z.imag] for z in each.astype(complex)] for each in values]))
"""
"""Run with BicycleParameters; reads parameters and speeds, writes eigenvalues."""


def rolling_wheels() -> Result:
    """Closed forms against the compiled walkers: a wheel is the flat active walker, whose swing leg is held in front."""
    return Result([*_rimless_checks(), *_other_wheel_checks(), _lateral_check()])


def rate_error(slope: float, half_angle: float, foot_radius: float = 0.0) -> float:
    """Relative error of the computed gait's squared rate against the closed form's."""
    walker = flat_active_walker(slope, foot_radius=foot_radius)
    cycle = find_limit_cycle(walker, inter_leg_angle=2.0 * half_angle)
    return abs((cycle.state[3] / planar_gait_rate(walker, 2.0 * half_angle)) ** 2 - 1.0)


def _rimless_checks() -> list[Check]:
    worst = max(rate_error(slope, half) for half, slope in _WHEELS)
    # The rate alone: the strike sets the angle
    multipliers = max(
        abs(_spoke_gait(half, slope).jacobian[3, 3] - math.cos(2.0 * half) ** 4)
        for half, slope in _WHEELS
    )
    least = {half: least_slope(half) for half, _ in _WHEELS}
    ends = all(
        _has_gait(half, 1.001 * slope) and not _has_gait(half, 0.999 * slope)
        for half, slope in least.items()
    )
    angles = f"at α = {', '.join(f'{half:.3f}' for half in least)}"
    slopes = ", ".join(f"{slope:.5f}" for slope in least.values())
    return [
        assess("rimless wheel, rate", worst < 1e-10, f"relative {worst:.0e} {angles}"),
        assess("rimless wheel, multiplier", multipliers < 1e-10, f"{multipliers:.0e} {angles}"),
        assess("rimless wheel, least slope", ends, f"{slopes} {angles}"),
    ]


def _spoke_gait(half_angle: float, slope: float):
    return find_limit_cycle(
        flat_active_walker(slope, foot_radius=0.0), inter_leg_angle=2.0 * half_angle
    )


def _has_gait(half_angle: float, slope: float) -> bool:
    try:
        _spoke_gait(half_angle, slope)
    except NoGaitError:
        return False
    return True


def least_slope(half_angle: float) -> float:
    """The slope on which the rimless wheel just gets over the top of a spoke."""

    def excess(slope: float) -> float:
        walker = flat_active_walker(slope, foot_radius=0.0)
        needed = 2.0 - 2.0 * math.cos(half_angle - slope)
        return planar_gait_rate(walker, 2.0 * half_angle) ** 2 - needed

    return root(excess, 1e-6, half_angle, 1e-14)


def synthetic_step_time() -> float:
    """A step of the synthetic wheel, in a pendulum's units: the smallest root of 1 + cos τ + 2 sin(τ) / τ = 0.

    The hip rolls at a constant speed, so that the stance leg goes from one angle to the opposite one at a constant rate -2 / τ; the
    swing leg, a pendulum that starts at the other angle with that rate, has to be in front at the same time.
    """
    return root(lambda t: 1.0 + math.cos(t) + 2.0 * math.sin(t) / t, 3.5, 4.5, 1e-12)


def _other_wheel_checks() -> list[Check]:
    worst = max(rate_error(0.01, 0.15, radius) for radius in (0.2, 0.5, 0.8))
    time, angle = synthetic_step_time(), 0.01
    nearly_round = WalkerParameters(hip_width=0.0, foot_radius=0.9999, slope=0.0)
    start = np.array([0.0, angle, 0.0, -2.0 * angle / time, 0.0, 0.0])
    step = PassiveWalker(nearly_round, planar=True).step(start)
    return [
        assess("wheel with round feet", worst < 1e-10, f"relative {worst:.0e}"),
        assess(
            "synthetic wheel",
            step.fall is None and abs(step.duration / time - 1.0) < 1e-4,
            f"{step.duration:.4f}, the equation's root {time:.4f}",
        ),
    ]


def _lateral_check() -> Check:
    body = WalkerParameters(0.0, 0.3, 0.5 * math.pi, POINT_FOOT_SLOPE)
    planar = gait_of(PassiveWalker(body, planar=True))
    matrix = PassiveMap(PassiveWalker(body)).derivative(planar.state)[1]
    values = np.linalg.eigvals(matrix)
    beyond = values[np.abs(values) > 1.01]
    fore_aft = np.sort_complex(np.linalg.eigvals(matrix[np.ix_(FORE_AFT, FORE_AFT)]) ** 2)
    same = float(np.abs(fore_aft - np.sort_complex(planar.eigenvalues)).max())
    holds = beyond.size == 1 and beyond[0].real < 0.0 and beyond[0].imag == 0.0 and same < 1e-6
    texts = ", ".join(f"{value.real:.1f}" for value in beyond)
    return assess("rocking sideways", bool(holds), f"{texts}; the fore-aft ones within {same:.0e}")


def bicycle_benchmark() -> Result:
    """The benchmark bicycle of 2007: matrices, eigenvalues, and BicycleParameters where it is installed."""
    entries = np.concatenate([matrix.ravel() for matrix in canonical_matrices(BENCHMARK_2007)])
    branches = follow_eigenvalues(benchmark_bicycle(), [5.0])
    weave, capsize, caster = branches.weave[0, 0], branches.capsize[0], branches.caster[0]
    values = (caster.real, capsize.real, weave.real, abs(weave.imag))
    checks = [*compare_all("matrix ", entries), *compare_all("eigenvalue, ", values)]
    if importlib.util.find_spec("bicycleparameters") is None:
        missing = Section(
            "Skipped: Carvallo-Whipple, BicycleParameters",
            "The package BicycleParameters is not installed: pip install 'lean-yaw-env[classics]'.",
        )
        return Result(checks, sections=(missing,))
    ours = np.sort_complex(benchmark_bicycle().eigenvalues(_SPEEDS))
    apart = float(np.abs(np.sort_complex(their_eigenvalues()) - ours).max())
    text = f"at most {apart:.0e} 1/s apart, at {_SPEEDS.size} speeds"
    return Result([*checks, assess("Carvallo-Whipple, BicycleParameters", apart < 1e-9, text)])


def _their_parameters() -> dict[str, float]:
    """The benchmark's parameters by the names of BicycleParameters."""
    p = BENCHMARK_2007
    named = {"w": p.wheelbase, "c": p.trail, "lam": p.steer_axis_tilt, "g": p.gravity, "v": 5.0}
    for letter, wheel in (("R", p.rear_wheel), ("F", p.front_wheel)):
        named |= {f"r{letter}": wheel.radius, f"m{letter}": wheel.mass}
        named |= {f"I{letter}xx": wheel.inertia_xx, f"I{letter}yy": wheel.inertia_yy}
    for letter, body in (("B", p.rear_frame), ("H", p.front_frame)):
        named |= {f"m{letter}": body.mass, f"x{letter}": body.x, f"z{letter}": body.z}
        for axes in ("xx", "xz", "yy", "zz"):
            named[f"I{letter}{axes}"] = getattr(body, f"inertia_{axes}")
    return named


def their_eigenvalues() -> np.ndarray:
    """Eigenvalues at ``_SPEEDS`` as BicycleParameters computes them, in a process of its own; shape (n, 4).

    Raises
    ------
    LeanYawError
        If the program fails.
    """
    question = json.dumps({"parameters": _their_parameters(), "speeds": _SPEEDS.tolist()})
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], input=question, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise LeanYawError(f"BicycleParameters failed: {done.stderr.strip().splitlines()[-1:]}")
    pairs = np.array(json.loads(done.stdout.splitlines()[-1]))
    return pairs[..., 0] + 1j * pairs[..., 1]

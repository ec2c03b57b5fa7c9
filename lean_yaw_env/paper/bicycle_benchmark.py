"""The benchmark bicycle of 2007: its published digits, and the package BicycleParameters as a second opinion."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys

import numpy as np

from lean_yaw_env.errors import LeanYawError
from lean_yaw_env.paper.checks import Check, compare, judge
from lean_yaw_env.paper.numbers import numbers_of, statement
from lean_yaw_env.paper.results import Result, Section
from lean_yaw_env.vehicles import (
    BENCHMARK_2007,
    benchmark_bicycle,
    canonical_matrices,
    follow_eigenvalues,
)

_SPEED = 5.0
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


def bicycle_benchmark() -> Result:
    """Matrices, eigenvalues, and BicycleParameters where it is installed."""
    checks = [*_published_checks()]
    if importlib.util.find_spec("bicycleparameters") is None:
        missing = Section(
            "Skipped: Carvallo-Whipple, BicycleParameters",
            "The package BicycleParameters is not installed: pip install 'lean-yaw-env[classics]'.",
        )
        return Result(tuple(checks), sections=(missing,))
    return Result((*checks, _second_opinion()))


def _published_checks() -> list[Check]:
    canonical = canonical_matrices(BENCHMARK_2007)
    matrices = (
        canonical.mass,
        canonical.damping,
        canonical.gravity_stiffness,
        canonical.speed_stiffness,
    )
    entries = np.concatenate([matrix.ravel() for matrix in matrices])
    checks = [
        compare(printed, float(entry))
        for printed, entry in zip(numbers_of("matrix "), entries, strict=True)
    ]
    branches = follow_eigenvalues(benchmark_bicycle(), [_SPEED])
    weave, capsize, caster = branches.weave[0, 0], branches.capsize[0], branches.caster[0]
    values = (caster.real, capsize.real, weave.real, abs(weave.imag))
    return checks + [
        compare(printed, float(value))
        for printed, value in zip(numbers_of("eigenvalue, "), values, strict=True)
    ]


def _their_parameters() -> dict[str, float]:
    """The benchmark's parameters by the names of BicycleParameters."""
    p = BENCHMARK_2007
    named = {
        "w": p.wheelbase,
        "c": p.trail,
        "lam": p.steer_axis_tilt,
        "g": p.gravity,
        "v": _SPEED,
    }
    for letter, wheel in (("R", p.rear_wheel), ("F", p.front_wheel)):
        named |= {f"r{letter}": wheel.radius, f"m{letter}": wheel.mass}
        named |= {f"I{letter}xx": wheel.inertia_xx, f"I{letter}yy": wheel.inertia_yy}
    for letter, body in (("B", p.rear_frame), ("H", p.front_frame)):
        named |= {f"m{letter}": body.mass, f"x{letter}": body.x, f"z{letter}": body.z}
        named |= {
            f"I{letter}{axes}": getattr(body, f"inertia_{axes}")
            for axes in ("xx", "xz", "yy", "zz")
        }
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


def _second_opinion() -> Check:
    apart = [
        np.abs(np.sort_complex(theirs) - np.sort_complex(ours)).max()
        for theirs, ours in zip(
            their_eigenvalues(), benchmark_bicycle().eigenvalues(_SPEEDS), strict=True
        )
    ]
    holds = bool(max(apart) < 1e-9)
    return judge(
        statement("Carvallo-Whipple, BicycleParameters"),
        holds,
        ours=f"at most {max(apart):.0e} 1/s apart, at {_SPEEDS.size} speeds",
        unless="They differ.",
    )

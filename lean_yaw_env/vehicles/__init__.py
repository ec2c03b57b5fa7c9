"""Vehicles that balance by coupling lean to yaw: the skateboard and the bicycle. SI units."""

from lean_yaw_env.vehicles.bicycle import (
    BicycleMotion,
    LinearBicycle,
    benchmark_bicycle,
    paper_bicycle,
)
from lean_yaw_env.vehicles.bicycle_parameters import (
    BENCHMARK_2007,
    BicycleParameters,
    CanonicalMatrices,
    FrameBody,
    Wheel,
    canonical_matrices,
    parameters_2005,
)
from lean_yaw_env.vehicles.characteristic import CharacteristicPolynomial, DoubleRoot
from lean_yaw_env.vehicles.eigenvalue_branches import (
    BRANCH_NAMES,
    UNNAMED_BRANCHES,
    EigenvalueBranches,
    follow_eigenvalues,
)
from lean_yaw_env.vehicles.skateboard import LeanEquation, Skateboard, SkateboardMotion
from lean_yaw_env.vehicles.stability import SpeedRange, critical_speed, stable_speed_range

__all__ = [
    "BENCHMARK_2007",
    "BRANCH_NAMES",
    "UNNAMED_BRANCHES",
    "BicycleMotion",
    "BicycleParameters",
    "CanonicalMatrices",
    "CharacteristicPolynomial",
    "DoubleRoot",
    "EigenvalueBranches",
    "FrameBody",
    "LeanEquation",
    "LinearBicycle",
    "Skateboard",
    "SkateboardMotion",
    "SpeedRange",
    "Wheel",
    "benchmark_bicycle",
    "canonical_matrices",
    "critical_speed",
    "follow_eigenvalues",
    "paper_bicycle",
    "parameters_2005",
    "stable_speed_range",
]

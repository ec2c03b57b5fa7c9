"""Gaits and their stability: stride map, limit cycles, multipliers."""

from lean_yaw_env.analysis.limit_cycle import LimitCycle, find_gait, find_limit_cycle
from lean_yaw_env.analysis.stride import StrideJacobian, stride_jacobian, stride_map

__all__ = [
    "LimitCycle",
    "StrideJacobian",
    "find_gait",
    "find_limit_cycle",
    "stride_jacobian",
    "stride_map",
]

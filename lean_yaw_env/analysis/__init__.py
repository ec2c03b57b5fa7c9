"""Gaits and their stability: stride map, limit cycles, modes, branches, maps, basins, demands."""

from lean_yaw_env.analysis.continuation import Branch, Event, continue_gait
from lean_yaw_env.analysis.limit_cycle import (
    LimitCycle,
    find_gait,
    find_limit_cycle,
    find_passive_gaits,
    planar_gait_rate,
)
from lean_yaw_env.analysis.modes import Mode, modes
from lean_yaw_env.analysis.periodic import find_periodic_gait
from lean_yaw_env.analysis.section_map import (
    BODY_PARAMETERS,
    COMMAND_PARAMETERS,
    ActiveMap,
    PassiveMap,
    section_map_of,
)
from lean_yaw_env.analysis.stride import StrideJacobian, stride_jacobian, stride_map

__all__ = [
    "BODY_PARAMETERS",
    "COMMAND_PARAMETERS",
    "ActiveMap",
    "Branch",
    "Event",
    "LimitCycle",
    "Mode",
    "PassiveMap",
    "StrideJacobian",
    "continue_gait",
    "find_gait",
    "find_limit_cycle",
    "find_passive_gaits",
    "find_periodic_gait",
    "modes",
    "planar_gait_rate",
    "section_map_of",
    "stride_jacobian",
    "stride_map",
]

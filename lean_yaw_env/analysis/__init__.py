"""Gaits and their stability: section maps, limit cycles, modes, branches, maps, basins, demands."""

from lean_yaw_env.analysis.active_map import COMMAND_PARAMETERS, ActiveMap, planar_gait_rate
from lean_yaw_env.analysis.atlas import DESIGNS, Atlas, basin_sizes
from lean_yaw_env.analysis.attraction import (
    Disturbance,
    LargestPushes,
    basin,
    largest_disturbance,
    largest_pushes,
)
from lean_yaw_env.analysis.capturability import (
    Capture,
    Choices,
    capture,
    capture_map,
    refine_capture,
)
from lean_yaw_env.analysis.closed_loop_map import ClosedLoopMap, ControlInterface
from lean_yaw_env.analysis.contact import FloorDemand, StepDemand, floor_demand
from lean_yaw_env.analysis.continuation import Branch, Event, continue_gait
from lean_yaw_env.analysis.critical_speed import stable_speeds
from lean_yaw_env.analysis.eigenmodes import Mode, modes
from lean_yaw_env.analysis.gait_map import map_cost, stability_map
from lean_yaw_env.analysis.limit_cycle import (
    LimitCycle,
    find_gait,
    find_limit_cycle,
    find_passive_gaits,
    find_periodic_gait,
)
from lean_yaw_env.analysis.passive_map import PassiveMap
from lean_yaw_env.analysis.section_map import BODY_PARAMETERS, SectionMap, section_map_of
from lean_yaw_env.analysis.storage import load_dataset, save_dataset
from lean_yaw_env.engine import Engine

__all__ = [
    "BODY_PARAMETERS",
    "COMMAND_PARAMETERS",
    "DESIGNS",
    "ActiveMap",
    "Atlas",
    "Branch",
    "Capture",
    "Choices",
    "ClosedLoopMap",
    "ControlInterface",
    "Disturbance",
    "Engine",
    "Event",
    "FloorDemand",
    "LargestPushes",
    "LimitCycle",
    "Mode",
    "PassiveMap",
    "SectionMap",
    "StepDemand",
    "basin",
    "basin_sizes",
    "capture",
    "capture_map",
    "continue_gait",
    "find_gait",
    "find_limit_cycle",
    "find_passive_gaits",
    "find_periodic_gait",
    "floor_demand",
    "largest_disturbance",
    "largest_pushes",
    "load_dataset",
    "map_cost",
    "modes",
    "planar_gait_rate",
    "refine_capture",
    "save_dataset",
    "section_map_of",
    "stability_map",
    "stable_speeds",
]

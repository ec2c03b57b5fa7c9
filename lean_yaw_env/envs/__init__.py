"""Gymnasium environments: one walker, many walkers, and the tasks they share. ``envs.sb3`` needs Stable-Baselines3."""

from lean_yaw_env.envs.goal_env import WaypointGoalEnv, WaypointGoalVectorEnv
from lean_yaw_env.envs.info import FallCode
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.real_time import RealTime
from lean_yaw_env.envs.simulation import Simulation
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks import Command, Feature, Metric, Task, register_task, task_named
from lean_yaw_env.envs.vector_env import WalkerVectorEnv
from lean_yaw_env.envs.walker_env import WalkerEnv
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import normal, uniform

__all__ = [
    "Command",
    "EnvOptions",
    "FallCode",
    "Feature",
    "Field",
    "Metric",
    "RealTime",
    "Simulation",
    "Task",
    "WalkerEnv",
    "WalkerVectorEnv",
    "WaypointGoalEnv",
    "WaypointGoalVectorEnv",
    "formula",
    "normal",
    "register_task",
    "task_named",
    "uniform",
]

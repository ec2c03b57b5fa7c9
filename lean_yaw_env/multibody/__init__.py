"""The paper's nine-coordinate model (section 3.1) with feet of finite mass.

A second opinion on the compiled walker: the same machine written down independently, with Lagrange multipliers, derivatives by sympy and
integration by scipy. Needs sympy.
"""

from lean_yaw_env.multibody.dynamics import ContactForces
from lean_yaw_env.multibody.gait import (
    PassiveGait,
    Table3Column,
    find_passive_gait,
    table3_c_eigenvalues,
)
from lean_yaw_env.multibody.phase import FALLS
from lean_yaw_env.multibody.walker import ForceExtremes, MultibodyStep, MultibodyWalker, Trajectory

__all__ = [
    "FALLS",
    "ContactForces",
    "ForceExtremes",
    "MultibodyStep",
    "MultibodyWalker",
    "PassiveGait",
    "Table3Column",
    "Trajectory",
    "find_passive_gait",
    "table3_c_eigenvalues",
]

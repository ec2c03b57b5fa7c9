"""Agents for the walking environments: controllers, predictive control, and trained policies.

``load("LeanYaw/Heading-v1")`` gives a trained policy that comes with the package, ``load(folder)`` one of your own; policies need
``lean-yaw-env[agents]``, training ``lean-yaw-env[train]``, the controllers nothing more than the walker itself. In a checkout the package is
``agents``, in an installation ``lean_yaw_env.agents``.
"""

from .agent import Agent
from .controllers.simple import FixedController, HeadingFeedback, HeadingGains, RandomController
from .policies.policy import Policy, PolicyCard
from .policies.policy_files import PolicyFileError, load, save, shipped_seeds
from .registry import AGENTS, AgentRequest, make_agent

__all__ = [
    "AGENTS",
    "Agent",
    "AgentRequest",
    "FixedController",
    "HeadingFeedback",
    "HeadingGains",
    "Policy",
    "PolicyCard",
    "PolicyFileError",
    "RandomController",
    "load",
    "make_agent",
    "save",
    "shipped_seeds",
]

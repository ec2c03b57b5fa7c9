"""Agents for the walking environments: controllers, predictive control, and trained policies.

``load("LeanYaw/Heading-v1")`` gives a trained policy that comes with the package, ``load(folder)`` one of your own; policies need
``lean-yaw-env[agents]``, training ``lean-yaw-env[train]``, the controllers nothing more than the walker itself. In a checkout the package is
``agents``, in an installation ``lean_yaw_env.agents``. Everything is loaded when it is first used, so that commands start quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lean_yaw_env.lazy import lazy_names

if TYPE_CHECKING:
    from .agent import Agent
    from .controllers.simple import FixedController, HeadingFeedback, HeadingGains, RandomController
    from .policies.policy import Policy, PolicyCard
    from .policies.policy_files import PolicyFileError, load, save, shipped_seeds
    from .registry import AGENTS, AgentRequest, make_agent

_EXPORTS = {
    "agent": ("Agent",),
    "controllers.simple": (
        "FixedController",
        "HeadingFeedback",
        "HeadingGains",
        "RandomController",
    ),
    "policies.policy": ("Policy", "PolicyCard"),
    "policies.policy_files": ("PolicyFileError", "load", "save", "shipped_seeds"),
    "registry": ("AGENTS", "AgentRequest", "make_agent"),
}
"""Names by the module that defines them."""

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

__getattr__, __dir__ = lazy_names(__name__, _EXPORTS)

"""Agents for the walking environments: the paper's controller, feedback, and trained policies; needs ``lean-yaw-env[train]``.

``load("LeanYaw/Heading-v0")`` gives a trained policy that comes with the package, ``load(folder)`` one of your own.
"""

from agents.agent import Agent
from agents.controllers.heading_feedback import HeadingFeedback, HeadingGains
from agents.controllers.simple import FixedController, RandomController
from agents.policies.policy import Policy, PolicyCard
from agents.policies.storage import PolicyFileError, load, save, shipped_seeds
from agents.registry import AGENTS, AgentRequest, make_agent

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

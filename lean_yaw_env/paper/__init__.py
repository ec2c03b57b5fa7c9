"""The paper's tables, figures and claims, computed anew and set beside the printed ones."""

from lean_yaw_env.paper.report import Reproduction, reproduce, write_report

__all__ = ["Reproduction", "reproduce", "write_report"]

"""UTurn: headings all round. Beyond a right angle the slope gives no energy, it takes some: an open challenge."""

from __future__ import annotations

from dataclasses import replace
from math import pi

from lean_yaw_env.envs.tasks.heading import LONGEST_COMMAND, SHORTEST_COMMAND, heading_fields
from lean_yaw_env.envs.tasks.heading import TASK as HEADING

TASK = replace(
    HEADING,
    name="UTurn",
    fields=heading_fields(pi),
    summary=f"Walk where you are told, all round: any heading, commanded anew every {SHORTEST_COMMAND} to {LONGEST_COMMAND} steps. Across "
    "the slope it gives no energy, and uphill it takes some; the masses may be moved as fast as in Level, to pump. An open challenge.",
    max_offset_change=0.1,
)

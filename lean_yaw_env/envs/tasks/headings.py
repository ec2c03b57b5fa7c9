"""Heading, UTurn, SpeedHeading and Level: follow a commanded heading; also beyond a right angle; also a commanded speed; also without a slope."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

from lean_yaw_env.envs.formulas import closeness, counted_time, mean_heading, positive, wrapped
from lean_yaw_env.envs.reset import BODY_DEVIATIONS
from lean_yaw_env.envs.state import Field
from lean_yaw_env.envs.tasks.task import (
    FIRST,
    FRICTION_LIMIT,
    NEW,
    SINCE_VERSION_1,
    Command,
    Feature,
    Metric,
    Task,
)
from lean_yaw_env.kernel.compilation import formula
from lean_yaw_env.kernel.random import uniform
from lean_yaw_env.parameters import WalkerParameters

LARGEST_SLOPE_COMMAND = 0.6  # rad: what the slope gives energy enough for, at a gentle pace
SHORTEST_COMMAND, LONGEST_COMMAND = 29, 58  # time units from one command to the next
SETTLED = 0.1  # rad
ERROR_SCALE = 0.6  # rad, of the observed error

# Reward per unit of time: for walking at all, for tracking, and against large actions. All but the last keep it positive, so that no walker
# gains by falling.
WALKING_RATE = 0.2
TRACKING_RATE = 0.8
TRACKING_WIDTH = 0.2  # rad; the error at which half of the tracking rate is left
EFFORT_RATE = 0.05


def heading_fields(largest_command: float) -> tuple[Field, ...]:
    """The record of a task that commands headings up to so many rad either side of downhill."""
    return (
        Field("command", "rad", "commanded heading", is_odd=True),
        Field("command_left", "time units", "until the next command is due"),
        Field("error_sum", "rad * time units", "absolute heading error times duration"),
        Field("settled_sum", "time units", f"time with an error below {SETTLED}"),
        Field("settling_sum", "time units", "from each new command until first settled"),
        Field("settled_commands", "", "commands that got there", "i8"),
        Field("since_command", "time units", "since the command was given"),
        Field("is_settled", "", "whether this command got there", "i8"),
        Field("commands", "", "commanded so far", "i8"),
        Field("largest_command", "rad", "either side of downhill", initial=largest_command),
    )


@formula
def heading_error(walker: Any, task: Any) -> Any:
    """The commanded heading relative to the mean of the last two footprints'."""
    return wrapped(task.command - mean_heading(walker))


@formula
def new_heading(walker: Any, task: Any) -> None:
    """Draw a heading and when the next one is due. When commands are due does not depend on the steps."""
    task.command = uniform(walker, -task.largest_command, task.largest_command)
    task.command_left += uniform(walker, SHORTEST_COMMAND, LONGEST_COMMAND)
    task.since_command = 0.0
    task.is_settled = 0
    task.commands += 1


@formula
def follow_heading(walker: Any, task: Any) -> bool:
    """Add a step's heading error to the sums; return whether the next command is due, at this heel strike or before."""
    error = abs(heading_error(walker, task))
    time = counted_time(walker)
    task.error_sum += error * time
    task.since_command += time
    if error < SETTLED:
        task.settled_sum += time
        if task.is_settled == 0:
            task.is_settled = 1
            task.settled_commands += 1
            task.settling_sum += task.since_command
    task.command_left -= walker.duration
    return task.command_left <= 0.0


@formula
def heading_reward(walker: Any, task: Any) -> Any:
    rate = (
        WALKING_RATE
        + TRACKING_RATE * closeness(heading_error(walker, task), TRACKING_WIDTH)
        - EFFORT_RATE * walker.effort
    )
    return rate * walker.duration


@formula
def heading_update(walker: Any, task: Any) -> bool:
    if follow_heading(walker, task):
        new_heading(walker, task)
    return False


@formula
def heading_features(walker: Any, task: Any) -> Any:
    return (heading_error(walker, task),)


HEADING = Task(
    name="Heading",
    fields=heading_fields(LARGEST_SLOPE_COMMAND),
    start=new_heading,
    reward=heading_reward,
    update=heading_update,
    features=heading_features,
    observed=(
        Feature(
            "heading_error",
            ERROR_SCALE,
            "rad",
            "commanded heading less the mean of the last two footprints', within half a turn",
            is_odd=True,
        ),
    ),
    metrics={
        "mean_absolute_heading_error": Metric("error_sum", "time", "rad, over time", "lower"),
        "settled_fraction": Metric(
            "settled_sum", "time", f"of the time, with an error below {SETTLED} rad", "higher"
        ),
        "mean_settling_time": Metric(
            "settling_sum",
            "settled_commands",
            "from a new command to settled, of commands that got there",
        ),
        "commands": Metric("commands", None, "headings commanded so far"),
    },
    summary=f"Walk where you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill, commanded anew every "
    f"{SHORTEST_COMMAND} to {LONGEST_COMMAND} units of time. The entry level.",
    reward_text=f"{WALKING_RATE} + {TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) - {EFFORT_RATE} effort",
    history=(FIRST, f"1: commands last a time, not a number of steps; {SINCE_VERSION_1}."),
    commands={"command": Command(("command",), -pi, pi, "heading, rad")},
    heading_field="command",
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
)

UTURN = replace(
    HEADING,
    name="UTurn",
    fields=heading_fields(pi),
    summary=f"Walk where you are told, all round: any heading, commanded anew every {SHORTEST_COMMAND} to {LONGEST_COMMAND} units of time, "
    "under pushes. Across the slope it gives no energy, and uphill it takes some; the masses may be moved as fast as in Level, to pump.",
    history=(*HEADING.history[:-1], f"{HEADING.history[-1][:-1]}; pushes at level 0.2."),
    max_offset_change=0.1,
    push_level=0.2,
)

# On a slope of 0.01 the gait walks at 0.68 with an inter-leg angle of 0.15 and at 0.25 with one of 0.45; 0.6 rad off downhill at 0.60
# and 0.10: all these commands are within reach of the default action.
LEAST_SPEED, GREATEST_SPEED = 0.30, 0.55
SPEED_CENTRE, SPEED_SCALE = 0.42, 0.1  # of the observed command
SPEED_ERROR_SCALE = 0.1
EACH_TRACKING_RATE = 0.4  # for heading and for speed
SPEED_WIDTH = 0.05  # the speed error at which half of its tracking rate is left
TRACKING_TEXT = (
    f"{WALKING_RATE} + {EACH_TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {EACH_TRACKING_RATE} / (1 + (speed "
    f"error / {SPEED_WIDTH})^2)"
)
"""``tracking_rate`` in words."""


def speed_fields(least: float, greatest: float) -> tuple[Field, ...]:
    """What a task that commands speeds adds to the record of one that commands headings."""
    return (
        Field("commanded_speed", "", "commanded speed"),
        Field("speed_error_sum", "time units", "absolute speed error times duration"),
        Field("least_speed", "", "of the commanded ones", initial=least),
        Field("greatest_speed", "", "of the commanded ones", initial=greatest),
    )


def speed_observed(centre: float, scale: float) -> tuple[Feature, ...]:
    """What ``speed_features`` are, with the centre and scale of the commanded speed."""
    return (
        *HEADING.observed,
        Feature("commanded_speed", scale, "", "commanded speed", centre),
        Feature(
            "speed_error",
            SPEED_ERROR_SCALE,
            "",
            "commanded speed less the last step's; zero before the first step",
        ),
    )


def speed_command(least: float, greatest: float) -> dict[str, Command]:
    """The reset options of such a task."""
    return {
        **HEADING.commands,
        "speed": Command(("commanded_speed",), least, greatest, "speed"),
    }


@formula
def new_heading_and_speed(walker: Any, task: Any) -> None:
    new_heading(walker, task)
    task.commanded_speed = uniform(walker, task.least_speed, task.greatest_speed)


@formula
def speed_error(walker: Any, task: Any) -> Any:
    """The commanded speed relative to the last step's."""
    return task.commanded_speed - walker.speed


@formula
def tracking_rate(walker: Any, task: Any) -> Any:
    """Reward per unit of time for walking and for both trackings."""
    close = closeness(heading_error(walker, task), TRACKING_WIDTH) + closeness(
        speed_error(walker, task), SPEED_WIDTH
    )
    return WALKING_RATE + EACH_TRACKING_RATE * close


@formula
def speed_reward(walker: Any, task: Any) -> Any:
    rate = tracking_rate(walker, task) - EFFORT_RATE * walker.effort
    return rate * walker.duration


@formula
def speed_update(walker: Any, task: Any) -> bool:
    runs_out = follow_heading(walker, task)
    task.speed_error_sum += abs(speed_error(walker, task)) * counted_time(walker)
    if runs_out:
        new_heading_and_speed(walker, task)
    return False


@formula
def speed_features(walker: Any, task: Any) -> Any:
    error = speed_error(walker, task)
    shown = error if walker.steps > 0 else 0.0 * error
    return heading_error(walker, task), task.commanded_speed, shown


SPEED_HEADING = replace(
    HEADING,
    name="SpeedHeading",
    fields=(*HEADING.fields, *speed_fields(LEAST_SPEED, GREATEST_SPEED)),
    start=new_heading_and_speed,
    reward=speed_reward,
    update=speed_update,
    features=speed_features,
    observed=speed_observed(SPEED_CENTRE, SPEED_SCALE),
    metrics={
        **HEADING.metrics,
        "mean_absolute_speed_error": Metric("speed_error_sum", "time", "over time", "lower"),
        "commanded_speed": Metric("commanded_speed", None, "in force"),
    },
    summary=f"Walk where and as fast as you are told: a heading within {LARGEST_SLOPE_COMMAND} rad of downhill and a speed from "
    f"{LEAST_SPEED:.2f} to {GREATEST_SPEED:.2f}, commanded anew together every {SHORTEST_COMMAND} to {LONGEST_COMMAND} units of time.",
    reward_text=f"{TRACKING_TEXT} - {EFFORT_RATE} effort",
    commands=speed_command(LEAST_SPEED, GREATEST_SPEED),
)

PUMPING = (
    0.03  # mass offset of the gait in which episodes of Level start, away from the stance foot
)

# Reward of Level per unit of time for tracking; per leg length walked; against work, in weight times leg length.
LEVEL_TRACKING_RATE = 0.5
PROGRESS = 0.5
WORK_PRICE = 5.0
LEVEL_PUSHES = 0.3  # without pushes eleven numbers found by search come to 0.96 of the reference


@formula
def level_reward(walker: Any, task: Any) -> Any:
    close = closeness(heading_error(walker, task), TRACKING_WIDTH)
    rate = WALKING_RATE + LEVEL_TRACKING_RATE * close
    work = positive(walker.shift_work)
    return rate * walker.duration + PROGRESS * walker.advance - WORK_PRICE * work


LEVEL = replace(
    HEADING,
    name="Level",
    reward=level_reward,
    metrics={
        **HEADING.metrics,
        "mean_speed": Metric("distance", "time", "distance along the headings over time", "higher"),
        "cost_of_transport": Metric(
            "work",
            "distance",
            "work per weight and distance; of a step's work, what is positive",
            "lower",
        ),
    },
    summary="Walk on a level floor under pushes, powered by nothing but moving the masses from side to side, and "
    f"steer: a heading within {LARGEST_SLOPE_COMMAND} rad, commanded anew every {SHORTEST_COMMAND} to {LONGEST_COMMAND} units of time. Episodes "
    f"start near the gait of offsets of {PUMPING} away from the stance foot.",
    reward_text=f"{WALKING_RATE} + {LEVEL_TRACKING_RATE} / (1 + (heading error / {TRACKING_WIDTH})^2) + {PROGRESS} speed - {WORK_PRICE:g} "
    "(power put into moving the masses)",
    parameters=WalkerParameters(slope=0.0, friction_limit=FRICTION_LIMIT),
    max_offset_change=0.1,
    pumping=PUMPING,
    push_level=LEVEL_PUSHES,
    history=(*HEADING.history[:-1], f"{HEADING.history[-1][:-1]}; pushes at level {LEVEL_PUSHES}."),
)

UPHILL = -0.01

LEVEL_UPHILL = replace(
    LEVEL,
    name="LevelUphill",
    summary=f"Level on a floor that rises: walk up a slope of {-UPHILL} rad under pushes, powered by nothing but moving the masses from side to side, and "
    f"steer as in Level, either side of straight up the slope.",
    history=NEW,
    parameters=WalkerParameters(slope=UPHILL, friction_limit=FRICTION_LIMIT),
)

UNKNOWN_BODY = replace(
    HEADING,
    name="UnknownBody",
    summary="Heading with a body that you do not know: drawn anew for each episode from a box twice as wide as that of other tasks, and with both "
    "rates hidden. It must be learned from how the walker moves, in memory of past observations; an oracle sees it (`show_body=True`).",
    history=NEW,
    parameters=WalkerParameters(friction_limit=FRICTION_LIMIT),
    hidden_rates=True,
    random_body="training",
    body_reach=tuple(2.0 * reach for reach in BODY_DEVIATIONS),
)

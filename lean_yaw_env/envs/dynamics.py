"""How an environment moves a walker: an action made into a command, a walking step, a push. The same compiled code for every task."""

from __future__ import annotations

from typing import Any

import numpy as np

from lean_yaw_env.envs.formulas import advance, mean_heading, positive
from lean_yaw_env.envs.state import SLOPE
from lean_yaw_env.kernel.batch import step_batch
from lean_yaw_env.kernel.compilation import borrowed, entry_point, formula
from lean_yaw_env.kernel.random import normal
from lean_yaw_env.kernel.records import FAILED, STEPPED, Command, Outcome
from lean_yaw_env.kernel.step import body_of, walking_step
from lean_yaw_env.parameters import STATE_SIZE

# Standard deviations of the pushes on pitch rate and ankle rate at push_level = 1.
PITCH_PUSH, ANKLE_PUSH = 0.08, 0.15

OUTCOME_SIZE = len(Outcome._fields)
_BLOCK = 512  # walkers whose steps stay in the processor's cache
_STEPPED = int(STEPPED)


@formula
def command(walker: Any, settings: Any, action: Any) -> None:
    """Clip an action to [-1, 1] and put the command it means into the record, within the largest change of offset.

    With delayed actions the command is that of the action before; this one waits, as an angle and an offset in space.
    """
    first = min(max(float(action[0]), -1.0), 1.0)
    second = min(max(float(action[1]), -1.0), 1.0)
    walker.effort = 0.5 * (first * first + second * second)
    sign = walker.side if settings.mirror != 0 else 1.0
    wanted = sign * settings.mass_offset_range * second
    angle = settings.inter_leg_angle + settings.inter_leg_angle_range * first
    if settings.action_delay != 0:
        angle, walker.pending_angle = walker.pending_angle, angle
        wanted, walker.pending_offset = walker.pending_offset, wanted
    held = walker.mass_offset
    change = settings.max_offset_change
    walker.inter_leg_angle = angle
    walker.commanded_offset = min(max(wanted, held - change), held + change)


@formula
def outcome_of(row: Any) -> Any:
    """A step's outcome from a row of numbers."""
    return Outcome(
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10],
        row[11], row[12], row[13], row[14], row[15], row[16], row[17],
    )  # fmt: skip


@formula
def move(walker: Any, outcome: Any, horizon: float) -> None:
    """Take a step's outcome into the record. A step that the solver gave up leaves the walker where it stood.

    Time, distance and work count to the horizon, a share of the step across it.
    """
    walker.fall = int(outcome.status) - _STEPPED
    walker.steps += 1
    walker.share = 1.0
    if outcome.status == FAILED:
        walker.duration = 0.0
        walker.advance = 0.0
        return
    walks = walker.fall == 0
    if walks:
        walker.previous_heading = walker.heading
        walker.side = -walker.side
    walker.heading = outcome.heading
    walker.stance_pitch = outcome.stance_pitch
    walker.ankle_angle = outcome.ankle_angle
    walker.stance_pitch_rate = outcome.stance_pitch_rate
    walker.ankle_rate = outcome.ankle_rate
    walker.mass_offset = outcome.mass_offset
    walker.duration = outcome.duration
    walker.least_normal_force = outcome.least_normal_force
    walker.greatest_friction = outcome.greatest_friction
    walker.gravity_work = outcome.gravity_work
    walker.shift_work = outcome.shift_work
    walker.impact_loss = outcome.impact_loss
    walker.ankle_loss = outcome.ankle_loss
    left = horizon - walker.time
    if outcome.duration.real > left.real:
        walker.share = left / outcome.duration
        walker.time = horizon
    else:
        walker.time += outcome.duration
    walker.work += walker.share * positive(outcome.shift_work)
    x = outcome.displacement_x
    z = outcome.displacement_z
    walker.place_x += x
    walker.place_z += z
    walker.advance = advance(x, z, mean_heading(walker))
    walker.distance += walker.share * walker.advance
    # a heel strike at the very start of a step takes no time and tells nothing of speed
    if walks and outcome.duration.real > 0.0:
        walker.speed = walker.advance / outcome.duration


@formula
def push(walker: Any, settings: Any) -> None:
    """Add random impulses to the rates with which a walker starts its next step."""
    if walker.fall == 0 and (settings.pitch_push > 0.0 or settings.ankle_push > 0.0):
        walker.pitch_push = settings.pitch_push * normal(walker)
        walker.ankle_push = settings.ankle_push * normal(walker)
        walker.stance_pitch_rate += walker.pitch_push
        walker.ankle_rate += walker.ankle_push


@entry_point()
def command_many(walkers, settings, actions):
    """Put the commands that actions mean into all records, without a step."""
    for i in range(len(walkers)):
        command(walkers[i], settings[0], actions[i])


@entry_point()
def walk_one(walkers, bodies, settings, actions):
    """Walk a step with one walker, through the scalar kernel; return whether its action is made of numbers, else nothing has changed."""
    walkers, bodies = borrowed(walkers), borrowed(bodies)
    settings, actions = borrowed(settings), borrowed(actions)
    walker, common = walkers[0], settings[0]
    if not (np.isfinite(actions[0, 0]) and np.isfinite(actions[0, 1])):
        return False
    bodies[0, SLOPE] = walker.slope
    command(walker, common, actions[0])
    outcome = walking_step(
        body_of(bodies[0]),
        Command(walker.inter_leg_angle, walker.commanded_offset, walker.mass_offset),
        walker.heading, walker.stance_pitch, walker.ankle_angle,
        walker.stance_pitch_rate, walker.ankle_rate, walker.side,
    )  # fmt: skip
    move(walker, outcome, common.horizon)
    push(walker, common)
    return True


@formula
def gather(walker: Any, commands: Any, states: Any, sides: Any, k: int) -> None:
    """Write a walker's step as the batch kernel takes it, to row ``k``."""
    commands[k, 0] = walker.inter_leg_angle
    commands[k, 1] = walker.commanded_offset
    commands[k, 2] = walker.mass_offset
    states[k, 0] = walker.heading
    states[k, 1] = walker.stance_pitch
    states[k, 2] = walker.ankle_angle
    states[k, 3] = walker.stance_pitch_rate
    states[k, 4] = walker.ankle_rate
    sides[k] = walker.side


@entry_point()
def walk_many(walkers, bodies, settings, actions, skip, first, last):
    """Walk a step with walkers ``first`` to ``last`` - 1, but those to skip, through the batch kernel."""
    walkers, bodies = borrowed(walkers), borrowed(bodies)
    settings, actions, skip = borrowed(settings), borrowed(actions), borrowed(skip)
    common = settings[0]
    size = min(_BLOCK, last - first)
    commands, sides = np.empty((size, 3)), np.empty(size)
    states, outcomes = np.empty((size, STATE_SIZE)), np.empty((size, OUTCOME_SIZE))
    owners = np.empty(size, dtype=np.int64)
    one_each = len(bodies) == len(walkers)
    own_bodies = np.empty((size if one_each else 1, bodies.shape[1]))
    for each in range(bodies.shape[1]):
        own_bodies[0, each] = bodies[0, each]
    i = first
    while i < last:
        n = 0
        while i < last and n < size:
            if not skip[i]:
                walker = walkers[i]
                command(walker, common, actions[i])
                gather(walker, commands, states, sides, n)
                if one_each:
                    bodies[i, SLOPE] = walker.slope
                    for each in range(bodies.shape[1]):
                        own_bodies[n, each] = bodies[i, each]
                owners[n] = i
                n += 1
            i += 1
        step_batch(own_bodies, commands, states, sides, outcomes, 0, n)
        for k in range(n):
            walker = walkers[owners[k]]
            move(walker, outcome_of(outcomes[k]), common.horizon)
            push(walker, common)

"""What every task shares of an environment's step, as compiled formulas on one row: action in, walker moved, observation out."""

from __future__ import annotations

from math import pi

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.random import normal, uniform
from lean_yaw_env.kernel.records import STEPPED
from lean_yaw_env.parameters import STATE_SIZE

# An observation is (value - centre) / scale, kept within +-OBSERVATION_LIMIT. Centres and scales are near Table 2's gait and how far a
# walker that does not fall strays from it.
STATE_CENTRES = (0.0, 0.155, 0.0, -0.42, 0.0)
STATE_SCALES = (0.6, 0.03, 0.05, 0.1, 0.1)
OFFSET_SCALE = 0.05
OBSERVATION_LIMIT = 10.0

# Largest deviations of a start from the gait, drawn uniformly, at start_disturbance = 1.
START_DEVIATIONS = (0.2, 0.01, 0.005, 0.03, 0.03)

# Half-widths of the box around the nominal body from which random bodies are drawn: hip width, foot radius, ankle tilt, slope. Bodies
# held out for testing lie outside it, in the box HELD_OUT_REACH times as large.
BODY_DEVIATIONS = (0.06, 0.05, 0.05, 0.002)
HELD_OUT_REACH = 1.5
NOMINAL, TRAINING, HELD_OUT = 0.0, 1.0, 2.0

# Standard deviations of the pushes on pitch rate and ankle rate at push_level = 1.
PITCH_PUSH, ANKLE_PUSH = 0.08, 0.15

_TURN = 2.0 * pi


@inlined
def wrapped(angle):
    """An angle's equal between -pi and pi."""
    return angle - _TURN * np.floor(angle / _TURN + 0.5)


@inlined
def mean_heading(memory, i):
    """Mean heading of the last two footprints, which alternate in a straight walk."""
    return 0.5 * (memory[i, c.HEADING] + memory[i, c.PREVIOUS_HEADING])


@inlined
def middle_place(memory, i):
    """Where the walker is, downhill and to the right: beside the stance foot's contact reference point, below the middle of the hips."""
    aside = 0.5 * memory[i, c.SIDE] * memory[i, c.BODY]
    heading = memory[i, c.HEADING]
    return (
        memory[i, c.PLACE_X] + aside * np.sin(heading),
        memory[i, c.PLACE_Z] + aside * np.cos(heading),
    )


@inlined
def draw_body(bodies, stream, settings, i):
    """Draw walker ``i``'s body: from the box for training, or from around it, between that box and the larger one."""
    trains = settings[c.BODY_DRAW] == TRAINING
    reach = 1.0 if trains else HELD_OUT_REACH
    largest = 0.0
    while largest == 0.0 or not (trains or largest > 1.0):
        largest = 0.0
        for k in range(c.BODY_COLUMNS):
            u = uniform(stream, i, -reach, reach)
            largest = max(largest, abs(u))
            bodies[i, k] = settings[c.BODY_CENTRE + k] + u * settings[c.BODY_REACH + k]


@inlined
def begin(bodies, memory, stream, settings, i):
    """Put walker ``i`` at its start: either foot, the gait and a random deviation; its body drawn anew if bodies are random."""
    for k in range(c.MEMORY):
        memory[i, k] = 0.0
    if settings[c.BODY_DRAW] != NOMINAL:
        draw_body(bodies, stream, settings, i)
    for k in range(c.BODY_COLUMNS):
        memory[i, c.BODY + k] = bodies[body_row(bodies, i), k]
    side = 1.0 if uniform(stream, i, 0.0, 1.0) < 0.5 else -1.0
    memory[i, c.SIDE] = side
    for k in range(STATE_SIZE):
        reach = settings[c.DISTURBANCE] * START_DEVIATIONS[k]
        value = settings[c.GAIT + k] + uniform(stream, i, -reach, reach)
        odd = (k == c.HEADING) | (k == c.ANKLE) | (k == c.ANKLE_RATE)
        memory[i, k] = side * value if odd else value
    memory[i, c.PREVIOUS_HEADING] = memory[i, c.HEADING]
    memory[i, c.INTER_LEG_ANGLE] = settings[c.BASE_ANGLE]
    memory[i, c.PENDING_ANGLE] = settings[c.BASE_ANGLE]
    # a gait of pumping has the masses on alternate sides
    memory[i, c.OFFSET] = side * settings[c.GAIT_OFFSET]
    memory[i, c.COMMANDED_OFFSET] = memory[i, c.OFFSET]
    memory[i, c.PENDING_OFFSET] = -memory[i, c.OFFSET]


@inlined
def body_row(bodies, i):
    """Where walker ``i``'s constants are: all walkers share one row unless bodies are random."""
    return i if bodies.shape[0] > 1 else 0


@inlined
def command(memory, settings, actions, i):
    """Clip an action to [-1, 1] and put the command it means into memory, within the largest change of offset.

    With delayed actions the command is that of the action before; this one waits, as an angle and an offset in space.
    """
    sign = memory[i, c.SIDE] if settings[c.MIRRORED] != 0.0 else 1.0
    first = min(max(float(actions[i, 0]), -1.0), 1.0)
    second = min(max(float(actions[i, 1]), -1.0), 1.0)
    wanted = sign * settings[c.OFFSET_RANGE] * second
    angle = settings[c.BASE_ANGLE] + settings[c.ANGLE_RANGE] * first
    if settings[c.DELAYED] != 0.0:
        angle, memory[i, c.PENDING_ANGLE] = memory[i, c.PENDING_ANGLE], angle
        wanted, memory[i, c.PENDING_OFFSET] = memory[i, c.PENDING_OFFSET], wanted
    held = memory[i, c.OFFSET]
    change = settings[c.OFFSET_CHANGE]
    memory[i, c.INTER_LEG_ANGLE] = angle
    memory[i, c.COMMANDED_OFFSET] = min(max(wanted, held - change), held + change)


@inlined
def effort(actions, i):
    """Mean square of an action's two numbers, each within [-1, 1]."""
    first = min(max(float(actions[i, 0]), -1.0), 1.0)
    second = min(max(float(actions[i, 1]), -1.0), 1.0)
    return 0.5 * (first * first + second * second)


@inlined
def move(memory, outcomes, i):
    """Take a step's outcome into memory; return whether the walker still walks."""
    walks = outcomes[i, c.OUTCOME_STATUS] == STEPPED
    if walks:
        memory[i, c.PREVIOUS_HEADING] = memory[i, c.HEADING]
        memory[i, c.SIDE] = -memory[i, c.SIDE]
    for k in range(STATE_SIZE):
        memory[i, k] = outcomes[i, k]
    x = outcomes[i, c.OUTCOME_X]
    z = outcomes[i, c.OUTCOME_Z]
    heading = mean_heading(memory, i)
    memory[i, c.OFFSET] = outcomes[i, c.OUTCOME_OFFSET]
    memory[i, c.TIME] += outcomes[i, c.OUTCOME_DURATION]
    memory[i, c.STEPS] += 1.0
    memory[i, c.PLACE_X] += x
    memory[i, c.PLACE_Z] += z
    memory[i, c.ADVANCE] = x * np.cos(heading) - z * np.sin(heading)
    memory[i, c.DISTANCE] += memory[i, c.ADVANCE]
    return walks


@inlined
def push(memory, stream, settings, i):
    """Add random impulses to the rates with which walker ``i`` starts its next step."""
    memory[i, c.PITCH_PUSH] = settings[c.PITCH_PUSH_SIZE] * normal(stream, i)
    memory[i, c.ANKLE_PUSH] = settings[c.ANKLE_PUSH_SIZE] * normal(stream, i)
    memory[i, c.PITCH_RATE] += memory[i, c.PITCH_PUSH]
    memory[i, c.ANKLE_RATE] += memory[i, c.ANKLE_PUSH]


@inlined
def limited(value):
    return np.float32(min(max(value, -OBSERVATION_LIMIT), OBSERVATION_LIMIT))


@inlined
def mirror_sign(memory, settings, i):
    """-1 if walker ``i`` is shown as its mirror image, which always stands on its left foot."""
    return memory[i, c.SIDE] if settings[c.MIRRORED] != 0.0 else 1.0


@inlined
def observe(memory, settings, observations, i):
    """Write the section state, the offset in force and, unless mirrored, the stance foot; return the next column.

    Where the slope turns with the walker its heading changes nothing and grows without bounds: it is shown as zero.
    """
    sign = mirror_sign(memory, settings, i)
    for k in range(STATE_SIZE):
        value = wrapped(memory[i, k]) if k == c.HEADING else memory[i, k]
        odd = (k == c.HEADING) | (k == c.ANKLE) | (k == c.ANKLE_RATE)
        value = sign * value if odd else value
        value = 0.0 if (k == c.HEADING) & (settings[c.HIDES_HEADING] != 0.0) else value
        observations[i, k] = limited((value - STATE_CENTRES[k]) / STATE_SCALES[k])
    observations[i, STATE_SIZE] = limited(sign * memory[i, c.OFFSET] / OFFSET_SCALE)
    column = STATE_SIZE + 1
    if settings[c.MIRRORED] == 0.0:
        observations[i, column] = np.float32(memory[i, c.SIDE])
        column += 1
    return column


@inlined
def veil(stream, settings, observations, i):
    """Add noise to all of an observation but the stance foot, and hide the rates, as the options say."""
    foot = STATE_SIZE + 1 if settings[c.MIRRORED] == 0.0 else -1
    if settings[c.NOISE] > 0.0:
        for k in range(observations.shape[1]):
            if k != foot and not (k == c.HEADING and settings[c.HIDES_HEADING] != 0.0):
                shown = float(observations[i, k]) + settings[c.NOISE] * normal(stream, i)
                observations[i, k] = limited(shown)
    if settings[c.HIDES_RATES] != 0.0:
        observations[i, c.PITCH_RATE] = 0.0
        observations[i, c.ANKLE_RATE] = 0.0

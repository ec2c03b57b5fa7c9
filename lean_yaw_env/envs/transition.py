"""What every task shares of an environment's step, as compiled formulas on one row: action in, walker moved, observation out."""

from __future__ import annotations

from math import pi

import numpy as np

from lean_yaw_env.envs import columns as c
from lean_yaw_env.kernel.compilation import inlined
from lean_yaw_env.kernel.random import uniform
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
def begin(memory, stream, settings, i):
    """Put walker ``i`` at its start: either foot, the gait and a random deviation."""
    for k in range(c.MEMORY):
        memory[i, k] = 0.0
    side = 1.0 if uniform(stream, i, 0.0, 1.0) < 0.5 else -1.0
    memory[i, c.SIDE] = side
    for k in range(STATE_SIZE):
        reach = settings[c.DISTURBANCE] * START_DEVIATIONS[k]
        value = settings[c.GAIT + k] + uniform(stream, i, -reach, reach)
        odd = (k == c.HEADING) | (k == c.ANKLE) | (k == c.ANKLE_RATE)
        memory[i, k] = side * value if odd else value
    memory[i, c.PREVIOUS_HEADING] = memory[i, c.HEADING]
    memory[i, c.INTER_LEG_ANGLE] = settings[c.BASE_ANGLE]


@inlined
def command(memory, settings, actions, i):
    """Clip an action to [-1, 1] and put the command it means into memory, within the largest change of offset."""
    sign = memory[i, c.SIDE] if settings[c.MIRRORED] != 0.0 else 1.0
    first = min(max(float(actions[i, 0]), -1.0), 1.0)
    second = min(max(float(actions[i, 1]), -1.0), 1.0)
    wanted = sign * settings[c.OFFSET_RANGE] * second
    held = memory[i, c.OFFSET]
    change = settings[c.OFFSET_CHANGE]
    memory[i, c.INTER_LEG_ANGLE] = settings[c.BASE_ANGLE] + settings[c.ANGLE_RANGE] * first
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
def limited(value):
    return np.float32(min(max(value, -OBSERVATION_LIMIT), OBSERVATION_LIMIT))


@inlined
def mirror_sign(memory, settings, i):
    """-1 if walker ``i`` is shown as its mirror image, which always stands on its left foot."""
    return memory[i, c.SIDE] if settings[c.MIRRORED] != 0.0 else 1.0


@inlined
def observe(memory, settings, observations, i):
    """Write the section state, the offset in force and, unless mirrored, the stance foot; return the next column."""
    sign = mirror_sign(memory, settings, i)
    for k in range(STATE_SIZE):
        value = wrapped(memory[i, k]) if k == c.HEADING else memory[i, k]
        odd = (k == c.HEADING) | (k == c.ANKLE) | (k == c.ANKLE_RATE)
        value = sign * value if odd else value
        observations[i, k] = limited((value - STATE_CENTRES[k]) / STATE_SCALES[k])
    observations[i, STATE_SIZE] = limited(sign * memory[i, c.OFFSET] / OFFSET_SCALE)
    column = STATE_SIZE + 1
    if settings[c.MIRRORED] == 0.0:
        observations[i, column] = np.float32(memory[i, c.SIDE])
        column += 1
    return column

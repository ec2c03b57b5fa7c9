"""Where an environment keeps its numbers: the columns of the arrays that the compiled steps read and write, one row per walker."""

from __future__ import annotations

from lean_yaw_env.kernel.records import Outcome
from lean_yaw_env.parameters import STATE_SIZE

# --- memory: what an episode remembers from step to step
HEADING, PITCH, ANKLE, PITCH_RATE, ANKLE_RATE = range(STATE_SIZE)
SIDE = 5  # +1 while the left foot stands, -1 the right
OFFSET = 6  # mass offset in force
PREVIOUS_HEADING = 7  # of the footprint before, as left and right ones alternate
TIME = 8
STEPS = 9
PLACE_X = 10  # contact reference point: downhill, right
PLACE_Z = 11
DISTANCE = 12  # summed advances
INTER_LEG_ANGLE = 13  # commanded in the last step
COMMANDED_OFFSET = 14
ADVANCE = 15  # of the last step, along the mean heading of its two footprints: sideways, left and right ones alternate
TASK = 16  # the first of the task's own columns
TASK_COLUMNS = 12
MEMORY = TASK + TASK_COLUMNS

# --- settings: what is fixed for an environment
BASE_ANGLE, ANGLE_RANGE, OFFSET_RANGE, OFFSET_CHANGE, HORIZON, MIRRORED, DISTURBANCE = range(7)
GAIT = 7  # a left-stance section state
SETTINGS = GAIT + STATE_SIZE

# --- outcomes: a step's record
OUTCOMES = len(Outcome._fields)
OUTCOME_STATUS = Outcome._fields.index("status")
OUTCOME_DURATION = Outcome._fields.index("duration")
OUTCOME_X = Outcome._fields.index("displacement_x")
OUTCOME_Z = Outcome._fields.index("displacement_z")
OUTCOME_OFFSET = Outcome._fields.index("offset")

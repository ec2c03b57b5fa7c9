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
BODY = 16  # the walker's own hip width, foot radius, ankle tilt and slope
BODY_COLUMNS = 4
PENDING_ANGLE = 20  # commands on their way, where actions are delayed
PENDING_OFFSET = 21
PITCH_PUSH = 22  # the last push, on the rates
ANKLE_PUSH = 23
TASK = 24  # the first of the task's own columns
TASK_COLUMNS = 14
MEMORY = TASK + TASK_COLUMNS

# --- settings: what is fixed for an environment
BASE_ANGLE, ANGLE_RANGE, OFFSET_RANGE, OFFSET_CHANGE, HORIZON, MIRRORED, DISTURBANCE = range(7)
GAIT = 7  # a left-stance section state
GAIT_OFFSET = GAIT + STATE_SIZE  # mass offset in force in that state
DELAYED = GAIT_OFFSET + 1
NOISE = GAIT_OFFSET + 2
HIDES_RATES = GAIT_OFFSET + 3
HIDES_HEADING = GAIT_OFFSET + 4
PITCH_PUSH_SIZE = GAIT_OFFSET + 5  # standard deviations
ANKLE_PUSH_SIZE = GAIT_OFFSET + 6
BODY_DRAW = GAIT_OFFSET + 7  # which bodies: see ``transition.draw_body``
BODY_CENTRE = GAIT_OFFSET + 8
BODY_REACH = BODY_CENTRE + BODY_COLUMNS
TASK_CONSTANTS = BODY_REACH + BODY_COLUMNS  # the first of the task's own
TASK_SETTINGS = 4
SETTINGS = TASK_CONSTANTS + TASK_SETTINGS

# --- outcomes: a step's record
OUTCOMES = len(Outcome._fields)
OUTCOME_STATUS = Outcome._fields.index("status")
OUTCOME_DURATION = Outcome._fields.index("duration")
OUTCOME_X = Outcome._fields.index("displacement_x")
OUTCOME_Z = Outcome._fields.index("displacement_z")
OUTCOME_OFFSET = Outcome._fields.index("mass_offset")

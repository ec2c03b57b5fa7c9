// Written by build_kernel.py from the kernel's records; do not edit.

export const BODY = ["hip_width", "foot_radius", "ankle_tilt", "slope", "ankle_stiffness", "ankle_damping", "shift_time", "friction_limit", "max_step_duration", "slope_turns", "strike_at_start"] as const;
export const COMMAND = ["inter_leg_angle", "mass_offset", "previous_offset"] as const;
export const OUTCOME = ["heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "status", "duration", "displacement_x", "displacement_z", "heading_change", "mass_offset", "least_normal_force", "greatest_friction", "gravity_work", "shift_work", "impact_loss", "ankle_loss", "evaluations"] as const;
export const TRACE = ["time", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "mass_offset", "centre_x", "centre_y", "centre_z", "normal_force", "friction_demand", "yaw_torque", "mechanical_energy"] as const;
export const OUTPUTS = ["heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "duration", "displacement_x", "displacement_z", "mass_offset", "shift_work"] as const;
export const PASSIVE_OUTCOME = ["heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate", "inter_leg_rate", "inter_leg_angle", "status", "duration", "displacement_x", "displacement_z", "heading_change", "least_normal_force", "greatest_friction", "gravity_work", "impact_loss", "ankle_loss", "start_inter_leg_angle", "evaluations"] as const;
export const INPUTS = 8;
export const STATE_SIZE = 5;
export const PASSIVE_INPUTS = 12;
export const PASSIVE_STATE_SIZE = 6;
export const PASSIVE_COLUMNS = 8;
export const STATUS = { STEPPED: 2, BACKWARD: 3, SIDEWAYS: 4, TRIP: 5, LIFT_OFF: 6, SLIP: 7, NO_STRIKE: 8, FAILED: 9 } as const;

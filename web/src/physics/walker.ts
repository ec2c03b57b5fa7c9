// The walker's parameters, its falls, and what a walk is made of. Units: leg length, gravity and mass one; angles in radians.

import { STATUS } from "../kernel/layout";
import type { Body, Side, State } from "../kernel/kernel";

/** What the sliders set: the body, the slope it walks on, and the command held. */
export interface Parameters {
  hip_width: number;
  foot_radius: number;
  ankle_tilt: number;
  slope: number;
  ankle_stiffness: number;
  ankle_damping: number;
  inter_leg_angle: number;
  mass_offset: number;
  slope_turns: boolean;
  /** Constants without a slider, of a walk that Python has saved. */
  more?: Partial<Body>;
}

/** Table 1 of the paper. */
export const TABLE_1: Readonly<Parameters> = {
  hip_width: 0.3,
  foot_radius: 0.5,
  ankle_tilt: 0.55,
  slope: 0.01,
  ankle_stiffness: 0,
  ankle_damping: 0,
  inter_leg_angle: 0.3,
  mass_offset: 0,
  slope_turns: false,
};

export const SHIFT_TIME = 0.35;
const MAX_STEP_DURATION = 10;

/** The constants as the kernel takes them. */
export function bodyOf(p: Parameters): Body {
  return {
    hip_width: p.hip_width,
    foot_radius: p.foot_radius,
    ankle_tilt: p.ankle_tilt,
    slope: p.slope,
    ankle_stiffness: p.ankle_stiffness,
    ankle_damping: p.ankle_damping,
    shift_time: SHIFT_TIME,
    friction_limit: Infinity,
    max_step_duration: MAX_STEP_DURATION,
    slope_turns: p.slope_turns ? 1 : 0,
    strike_at_start: 0,
    ...p.more,
  };
}

export const MIRROR = [-1, 1, -1, 1, -1, 1];

export function mirrored(state: State): State {
  return state.map((value, k) => MIRROR[k] * value || 0);
}

export const COORDINATES = ["heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate"] as const;
export const PASSIVE_COORDINATES = [...COORDINATES, "inter_leg_rate"] as const;

export interface Fall {
  name: string;
  why: string;
}

const FALLS: Record<number, Fall> = {
  [STATUS.BACKWARD]: {
    name: "backward",
    why: "The stance leg did not get past the vertical: too little speed, so it rolled back.",
  },
  [STATUS.SIDEWAYS]: {
    name: "sideways",
    why: "It leaned too far: the feet did not turn under the fall soon enough.",
  },
  [STATUS.TRIP]: {
    name: "trip",
    why: "The hip leaned so far down that the leg put in front began its step inside the floor.",
  },
  [STATUS.LIFT_OFF]: {
    name: "lift-off",
    why: "The floor would have had to pull: the stance foot lost contact.",
  },
  [STATUS.SLIP]: { name: "slip", why: "The step asked for more friction than the floor gives." },
  [STATUS.NO_STRIKE]: { name: "no heel strike", why: "The swing foot did not come down in time." },
  [STATUS.FAILED]: {
    name: "solver failed",
    why: "Not a fall: the integrator did not converge from this state. Please start again.",
  },
};

export function fallOf(status: number): Fall | null {
  return status === STATUS.STEPPED ? null : (FALLS[status] ?? FALLS[STATUS.FAILED]);
}

/** A passive walker that loses the floor before its foot is down tips over forward; its trip is a start that cannot be. */
export function passiveFallOf(status: number, stancePitch: number): Fall | null {
  if (status === STATUS.LIFT_OFF && stancePitch < 0) {
    return { name: "forward", why: "The leg tipped over forward before the swing foot was down." };
  }
  if (status === STATUS.TRIP) {
    return { name: "no start", why: "No trailing foot can be on the floor in this state." };
  }
  if (status === STATUS.NO_STRIKE) {
    return { name: "no heel strike", why: "The swing foot did not come down in front in time." };
  }
  return fallOf(status);
}

/** Everything that a picture of the walker needs. */
export interface Pose {
  heading: number;
  pitch: number;
  ankle: number;
  side: Side;
  /** Of the swing leg in front of the stance leg. */
  interLeg: number;
  /** Share of its length by which the swing leg is drawn shorter on its way. */
  retraction: number;
  offset: number;
  /** Contact reference point: downhill, right. */
  contact: [number, number];
  hasFallen: boolean;
}

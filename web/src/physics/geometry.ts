// From a pose to the walker's shape on its floor: x downhill, y along the floor's normal, z to the right; docs/model.md, "Stance".

import type { Parameters, Pose } from "./walker";

export type Vector = [number, number, number];
/** Columns are the axes of the turned frame. */
export type Frame = [Vector, Vector, Vector];

export interface LegShape {
  hip: Vector;
  /** The leg's lower end, on the sole. */
  ankle: Vector;
  /** Leg frame: forward, along the leg, along the axle. */
  leg: Frame;
  /** Foot frame: forward, up, along the cylinder's axis. */
  foot: Frame;
  /** Forward and down. */
  ankleAxis: Vector;
}

export interface WalkerShape {
  left: LegShape;
  right: LegShape;
  axle: Vector;
  masses: [Vector, Vector];
  centre: Vector;
}

const LEAST_UPRIGHT = 1e-9;

export function add(a: Vector, b: Vector, factor = 1): Vector {
  return [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
}

function applied(frame: Frame, v: Vector): Vector {
  const [e1, e2, e3] = frame;
  return [0, 1, 2].map((k) => e1[k] * v[0] + e2[k] * v[1] + e3[k] * v[2]) as Vector;
}

function composed(a: Frame, b: Frame): Frame {
  return b.map((column) => applied(a, column)) as Frame;
}

/** Right-handed rotation about a unit vector. */
function rotation([x, y, z]: Vector, angle: number): Frame {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const d = 1 - c;
  return [
    [c + d * x * x, d * x * y + s * z, d * x * z - s * y],
    [d * x * y - s * z, c + d * y * y, d * y * z + s * x],
    [d * x * z + s * y, d * y * z - s * x, c + d * z * z],
  ];
}

export function shapeOf(p: Parameters, pose: Pose): WalkerShape {
  const r = p.foot_radius;
  const ankleAxis: Vector = [Math.sin(p.ankle_tilt), -Math.cos(p.ankle_tilt), 0];
  const ahead: Vector = [Math.cos(pose.heading), 0, -Math.sin(pose.heading)];
  const centre = footCentre(r, pose, ahead);
  const foot = composed(rotation([0, 1, 0], pose.heading), rotation([0, 0, 1], pose.pitch));
  const leg = composed(foot, rotation(ankleAxis, pose.ankle));
  const ankle = add(centre, foot[1], -r);
  const hip = add(ankle, leg[1]);
  const axle = leg[2];
  const stance: LegShape = { hip, ankle, leg, foot, ankleAxis: applied(leg, ankleAxis) };

  const otherHip = add(hip, axle, pose.side * p.hip_width);
  const swingLeg = composed(leg, rotation([0, 0, 1], pose.interLeg));
  const flat = flatAnkleAngle(swingLeg, ankleAxis);
  const swing: LegShape = {
    hip: otherHip,
    ankle: add(otherHip, swingLeg[1], -(1 - pose.retraction)),
    leg: swingLeg,
    foot: composed(swingLeg, rotation(ankleAxis, -flat)),
    ankleAxis: applied(swingLeg, ankleAxis),
  };
  const [left, right] = pose.side === 1 ? [stance, swing] : [swing, stance];
  const masses: [Vector, Vector] = [add(left.hip, axle, pose.offset), add(right.hip, axle, pose.offset)];
  return { left, right, axle, masses, centre: add(masses[0], add(masses[1], masses[0], -1), 0.5) };
}

/** The middle of the stance foot's cylinder. A foot of a walker that has fallen tips over its end, where the model's cylinder rolls on. */
function footCentre(radius: number, pose: Pose, ahead: Vector): Vector {
  const reach = pose.hasFallen ? halfArc(radius) : Infinity;
  const rolled = Math.min(Math.max(pose.pitch, -reach), reach);
  const tipped = pose.pitch - rolled;
  const back = -radius * (rolled + Math.sin(tipped));
  return add([pose.contact[0], radius * Math.cos(tipped), pose.contact[1]], ahead, back);
}

/** The ankle angle within a quarter turn that lays the cylinder's axis level; zero where there is none. */
function flatAnkleAngle(leg: Frame, ankleAxis: Vector): number {
  const e1 = applied(leg, [-ankleAxis[1], ankleAxis[0], 0]);
  return e1[1] < LEAST_UPRIGHT ? 0 : Math.atan2(-leg[2][1], e1[1]);
}

/** Half the angle of the drawn part of a foot's cylinder. */
export function halfArc(radius: number): number {
  return radius === 0 ? Math.PI / 2 : Math.min(Math.max(0.16 / radius, 0.3), Math.PI / 2);
}

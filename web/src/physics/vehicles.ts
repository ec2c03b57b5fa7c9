// The linear vehicles, skateboard and bicycle: the package's formulas (lean_yaw_env.vehicles), in SI units.

import { eigen, exponential, magnitude, times, type Complex, type Matrix } from "./linalg";
import type { PAPER_BICYCLE, SKATEBOARD } from "./vehicle_data";

export type BicycleParameters = typeof PAPER_BICYCLE;
export type SkateboardParameters = typeof SKATEBOARD;

/** A vehicle whose state moves by x' = A(speed) x. */
export interface LinearVehicle {
  stateMatrix(speed: number): Matrix;
}

export class Skateboard implements LinearVehicle {
  constructor(readonly p: SkateboardParameters) {}

  /** Curvature of the path for a unit lean, 1/m. */
  get curvaturePerLean(): number {
    return 2 / (this.p.wheelbase * Math.tan(this.p.steering_tilt));
  }

  /** Of lean and lean rate, eq. (2) of the paper with damping added. */
  stateMatrix(speed: number): Matrix {
    const { mass: m, rider_height: height, spring_stiffness: k, gravity, damping } = this.p;
    const inertia = m * height ** 2;
    const stiffness = 2 * k - m * gravity * height + m * height * this.curvaturePerLean * speed ** 2;
    return [[0, 1], [-stiffness / inertia, (-2 * damping) / inertia]];
  }

  /** Speed above which the board is not unstable, eq. (3). */
  get criticalSpeed(): number {
    const { mass: m, rider_height: height, spring_stiffness: k, gravity } = this.p;
    return Math.sqrt(Math.max(m * gravity * height - 2 * k, 0) / (m * height * this.curvaturePerLean));
  }
}

type Two = [[number, number], [number, number]];

/** M q'' + v C1 q' + (g K0 + v^2 K2) q = 0 with q = (lean, steer). */
interface CanonicalMatrices {
  mass: Two;
  damping: Two;
  gravityStiffness: Two;
  speedStiffness: Two;
}

/** Meijaard, Papadopoulos, Ruina and Schwab, Proc. R. Soc. A 463 (2007), equations (A 1) to (A 24). */
export function canonicalMatrices(p: BicycleParameters): CanonicalMatrices {
  const { rear_wheel: r, rear_frame: b, front_frame: h, front_wheel: f, wheelbase: w, trail: c } = p;
  const total = {
    mass: r.mass + b.mass + h.mass + f.mass,
    x: 0,
    z: 0,
    xx: r.inertia_xx + b.inertia_xx + h.inertia_xx + f.inertia_xx + r.mass * r.radius ** 2 + b.mass * b.z ** 2 +
      h.mass * h.z ** 2 + f.mass * f.radius ** 2,
    xz: b.inertia_xz + h.inertia_xz - b.mass * b.x * b.z - h.mass * h.x * h.z + f.mass * w * f.radius,
    zz: r.inertia_xx + b.inertia_zz + h.inertia_zz + f.inertia_xx + b.mass * b.x ** 2 + h.mass * h.x ** 2 + f.mass * w ** 2,
  };
  total.x = (b.x * b.mass + h.x * h.mass + w * f.mass) / total.mass;
  total.z = (-r.radius * r.mass + b.z * b.mass + h.z * h.mass - f.radius * f.mass) / total.mass;

  const frontMass = h.mass + f.mass;
  const x = (h.x * h.mass + w * f.mass) / frontMass;
  const z = (h.z * h.mass - f.radius * f.mass) / frontMass;
  const front = {
    xx: h.inertia_xx + f.inertia_xx + h.mass * (h.z - z) ** 2 + f.mass * (f.radius + z) ** 2,
    xz: h.inertia_xz - h.mass * (h.x - x) * (h.z - z) + f.mass * (w - x) * (f.radius + z),
    zz: h.inertia_zz + f.inertia_xx + h.mass * (h.x - x) ** 2 + f.mass * (w - x) ** 2,
  };

  const [sine, cosine] = [Math.sin(p.steer_axis_tilt), Math.cos(p.steer_axis_tilt)];
  const u = (x - w - c) * cosine - z * sine;
  const ll = frontMass * u ** 2 + front.xx * sine ** 2 + 2 * front.xz * sine * cosine + front.zz * cosine ** 2;
  const lx = -frontMass * u * z + front.xx * sine + front.xz * cosine;
  const lz = frontMass * u * x + front.xz * sine + front.zz * cosine;
  const mu = (c / w) * cosine;
  const frontSpin = f.inertia_yy / f.radius;
  const spin = r.inertia_yy / r.radius + frontSpin;
  const sa = frontMass * u + mu * total.mass * total.x;
  const m12 = lx + mu * total.xz;
  const gyroscopic = mu * spin + frontSpin * cosine;
  const rate = cosine / w;
  return {
    mass: [[total.xx, m12], [m12, ll + 2 * mu * lz + mu ** 2 * total.zz]],
    damping: [
      [0, gyroscopic + total.xz * rate - mu * total.mass * total.z],
      [-gyroscopic, lz * rate + mu * (sa + total.zz * rate)],
    ],
    gravityStiffness: [[total.mass * total.z, -sa], [-sa, -sa * sine]],
    speedStiffness: [[0, (spin - total.mass * total.z) * rate], [0, (sa + frontSpin * sine) * rate]],
  };
}

function solved(m: Two, b: Two): Two {
  const det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
  const inverse: Two = [[m[1][1] / det, -m[0][1] / det], [-m[1][0] / det, m[0][0] / det]];
  return [0, 1].map((i) => [0, 1].map((j) => inverse[i][0] * b[0][j] + inverse[i][1] * b[1][j])) as Two;
}

export class Bicycle implements LinearVehicle {
  private readonly matrices: CanonicalMatrices;

  constructor(readonly p: BicycleParameters) {
    this.matrices = canonicalMatrices(p);
  }

  /** Of lean, steer and their rates. */
  stateMatrix(speed: number): Matrix {
    const { mass, damping, gravityStiffness: k0, speedStiffness: k2 } = this.matrices;
    const g = this.p.gravity;
    const each = (value: (i: number, j: number) => number) => [0, 1].map((i) => [0, 1].map((j) => value(i, j))) as Two;
    const k = solved(mass, each((i, j) => g * k0[i][j] + speed ** 2 * k2[i][j]));
    const c = solved(mass, each((i, j) => speed * damping[i][j]));
    return [[0, 0, 1, 0], [0, 0, 0, 1], [-k[0][0], -k[0][1], -c[0][0], -c[0][1]], [-k[1][0], -k[1][1], -c[1][0], -c[1][1]]];
  }

  /** Yaw rate of the rear frame, to the right. */
  yawRate(speed: number, steer: number, steerRate: number): number {
    return ((speed * steer + this.p.trail * steerRate) * Math.cos(this.p.steer_axis_tilt)) / this.p.wheelbase;
  }
}

/** The exact motion after a time, from a state. */
export function moved(vehicle: LinearVehicle, speed: number, state: number[], duration: number): number[] {
  return times(exponential(vehicle.stateMatrix(speed).map((row) => row.map((value) => value * duration))), state);
}

/** Eigenvalues by falling real part, then falling imaginary part. */
export function eigenvalues(vehicle: LinearVehicle, speed: number): Complex[] {
  return eigen(vehicle.stateMatrix(speed)).values.sort((a, b) => b.re - a.re || b.im - a.im);
}

export interface Branch {
  name: string;
  values: Complex[];
}

export const BICYCLE_MODES = ["weave", "weave", "capsize", "caster"];

interface Mode {
  value: Complex;
  shape: Complex[];
}

function modesAt(vehicle: LinearVehicle, speed: number): Mode[] {
  const { values, vectors } = eigen(vehicle.stateMatrix(speed));
  return values.map((value, k) => {
    const shape = vectors[k].slice(0, 2);
    const size = Math.hypot(...shape.map(magnitude)) || 1;
    return { value, shape: shape.map((z) => ({ re: z.re / size, im: z.im / size })) };
  });
}

function unlikeness(a: Mode, b: Mode, scale: number): number {
  const re = a.shape.reduce((sum, z, k) => sum + z.re * b.shape[k].re + z.im * b.shape[k].im, 0);
  const im = a.shape.reduce((sum, z, k) => sum + z.re * b.shape[k].im - z.im * b.shape[k].re, 0);
  return Math.hypot(a.value.re - b.value.re, a.value.im - b.value.im) / scale + 1 - Math.min(Math.hypot(re, im), 1);
}

const ASSIGNMENTS = permutations([0, 1, 2, 3]);

function permutations(items: number[]): number[][] {
  if (items.length < 2) return [items];
  return items.flatMap((first) => permutations(items.filter((item) => item !== first)).map((rest) => [first, ...rest]));
}

/**
 * The bicycle's eigenvalues at rising speeds, each under its mode's name.
 *
 * Named where one pair oscillates and two roots are real (the greater is the capsize, the lesser the caster mode), and followed up and down
 * from there: each new set is given the names of the old ones that it is most like.
 */
export function bicycleBranches(bicycle: Bicycle, speeds: number[]): Branch[] | null {
  const sets = speeds.map((speed) => modesAt(bicycle, speed));
  const reals = sets.map((modes) => modes.filter((mode) => mode.value.im === 0).length);
  let start = -1;
  speeds.forEach((speed, k) => {
    if (reals[k] === 2 && (start < 0 || Math.abs(speed - 5) < Math.abs(speeds[start] - 5))) start = k;
  });
  if (start < 0) return null;
  const named: Mode[][] = new Array(speeds.length);
  const pair = sets[start].filter((mode) => mode.value.im !== 0).sort((a, b) => b.value.im - a.value.im);
  const real = sets[start].filter((mode) => mode.value.im === 0).sort((a, b) => b.value.re - a.value.re);
  named[start] = [...pair, ...real];
  const follow = (k: number, from: number) => {
    const scale = Math.max(...sets[k].map((mode) => magnitude(mode.value)));
    let best = ASSIGNMENTS[0];
    let least = Infinity;
    for (const assignment of ASSIGNMENTS) {
      const cost = assignment.reduce((sum, to, i) => sum + unlikeness(named[from][i], sets[k][to], scale), 0);
      if (cost < least) [least, best] = [cost, assignment];
    }
    named[k] = best.map((to) => sets[k][to]);
  };
  for (let k = start + 1; k < speeds.length; k++) follow(k, k - 1);
  for (let k = start - 1; k >= 0; k--) follow(k, k + 1);
  return BICYCLE_MODES.map((name, i) => ({ name, values: named.map((modes) => modes[i].value) }));
}

/** Speeds up to `most` at which the greatest real part changes sign, to round-off, and whether it is negative after. */
export function stabilityLimits(vehicle: LinearVehicle, most: number, pieces = 400): { speed: number; stableAfter: boolean }[] {
  const growth = (speed: number) => Math.max(...eigenvalues(vehicle, speed).map((z) => z.re));
  const limits: { speed: number; stableAfter: boolean }[] = [];
  let [low, before] = [most / pieces, growth(most / pieces)];
  for (let k = 2; k <= pieces; k++) {
    const high = (k * most) / pieces;
    const after = growth(high);
    if (before < 0 !== after < 0) {
      let [a, b] = [low, high];
      for (let halving = 0; halving < 60 && b - a > 1e-15 * b; halving++) {
        const middle = 0.5 * (a + b);
        if (growth(middle) < 0 === before < 0) a = middle;
        else b = middle;
      }
      limits.push({ speed: 0.5 * (a + b), stableAfter: after < 0 });
    }
    [low, before] = [high, after];
  }
  return limits;
}

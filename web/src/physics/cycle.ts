// Limit cycles: fixed points of the section map by Newton's method on the kernel's exact derivatives, and their multipliers.

import type { Body, Command, Kernel, Side, State } from "../kernel/kernel";
import { OUTPUTS, STATE_SIZE, STATUS } from "../kernel/layout";
import { determinant, eigen, identity, magnitude, product, selected, solve, type Complex, type Matrix } from "./linalg";
import { bodyOf, COORDINATES, fallOf, MIRROR, mirrored, type Parameters } from "./walker";

export interface Mode {
  value: Complex;
  magnitude: number;
  name: "fore-aft" | "three-dimensional";
  /** Share of heading, ankle angle and ankle rate in it. */
  lateralShare: number;
}

export interface Cycle {
  /** On the left foot. */
  state: State;
  modes: Mode[];
  stable: boolean;
  stridePeriod: number;
  speed: number;
  stepLength: number;
  heading: number;
  turn: number;
  energy: { gravity: number; shift: number; impact: number; ankle: number };
  normalForce: number;
  frictionDemand: number;
  residual: number;
}

/** Largest change of any coordinate over the map that still counts as a fixed point, as in the package. */
const RESIDUAL_LIMIT = 1e-12;
const MOST_ITERATIONS = 30;
const LATERAL = new Set(["heading", "ankle_angle", "ankle_rate"]);

/** A map of the section onto itself with its derivative; null where it ends in a fall. */
export interface SectionMap {
  free: number[];
  names: readonly string[];
  image(state: State): State | null;
  derivative(state: State): { image: State; matrix: Matrix } | null;
}

const STATE_ROWS = Array.from({ length: STATE_SIZE }, (_, k) => k);
if (STATE_ROWS.some((k) => OUTPUTS[k] !== COORDINATES[k])) throw new Error("the kernel's derivatives have another order");

/** Steps of the steered walker at a constant command; an odd number ends with the mirror image. */
export function activeMap(kernel: Kernel, p: Parameters, steps: number): SectionMap {
  const body: Body = bodyOf(p);
  const command: Command = { inter_leg_angle: p.inter_leg_angle, mass_offset: p.mass_offset, previous_offset: p.mass_offset };
  const flip = steps % 2 === 1;
  return {
    free: p.slope !== 0 && !p.slope_turns ? [0, 1, 2, 3, 4] : [1, 2, 3, 4],
    names: COORDINATES,
    image(state) {
      let side: Side = 1;
      for (let k = 0; k < steps; k++) {
        const outcome = kernel.step(body, command, state, side);
        if (outcome.status !== STATUS.STEPPED) return null;
        state = COORDINATES.map((name) => outcome[name]);
        side = -side as Side;
      }
      return flip ? mirrored(state) : state;
    },
    derivative(state) {
      let side: Side = 1;
      let matrix = identity(STATE_SIZE);
      for (let k = 0; k < steps; k++) {
        const step = kernel.derivative(body, command, state, side);
        if (step.status !== STATUS.STEPPED) return null;
        const byState = STATE_ROWS.map((i) => step.matrix[i].slice(0, STATE_SIZE));
        matrix = product(byState, matrix);
        state = step.state;
        side = -side as Side;
      }
      if (!flip) return { image: state, matrix };
      return { image: mirrored(state), matrix: matrix.map((row, i) => row.map((value) => MIRROR[i] * value)) };
    },
  };
}

function change(map: SectionMap, state: State): number[] | null {
  const image = map.image(state);
  return image && map.free.map((k) => image[k] - state[k]);
}

function largest(values: number[]): number {
  return Math.max(...values.map(Math.abs));
}

/** Newton's method with steps that are halved until the change gets smaller; null where it does not arrive. */
export function fixedPoint(map: SectionMap, guess: State): State | null {
  let state = [...guess];
  let now = change(map, state);
  if (!now) return null;
  for (let iteration = 0; iteration < MOST_ITERATIONS; iteration++) {
    if (largest(now) <= 1e-15) return state;
    const derivative = map.derivative(state);
    if (!derivative) return null;
    const slope = selected(derivative.matrix, map.free);
    slope.forEach((row, i) => (row[i] -= 1));
    const step = solve(slope, now.map((value) => -value));
    if (!step) return null;
    let share = 1;
    let next: State | null = null;
    let after: number[] | null = null;
    for (let halving = 0; halving < 4; halving++, share *= 0.5) {
      next = [...state];
      map.free.forEach((k, i) => (next![k] += share * step[i]));
      after = change(map, next);
      if (after && largest(after) < largest(now)) break;
      after = null;
    }
    if (!after || !next) break; // at round-off, or stuck
    state = next;
    now = after;
  }
  return largest(now) <= RESIDUAL_LIMIT ? state : null;
}

/** A sign that a fixed point keeps along a path of maps until it passes a fold. */
export function sideOfFolds(map: SectionMap, state: State): number {
  const derivative = map.derivative(state);
  if (!derivative) return 0;
  const slope = selected(derivative.matrix, map.free);
  slope.forEach((row, i) => (row[i] -= 1));
  return Math.sign(determinant(slope));
}

/** A map for every share from 0 to 1. */
export type Path = (share: number) => SectionMap;

const FIRST_PIECE = 0.25;
const SMALLEST_PIECE = 1 / 256;

/** Follow a fixed point along a path of maps, in pieces that shrink where it fails; on one side of folds only, if one is given. */
export function followed(path: Path, start: State, side?: number): State | null {
  let state = fixedPoint(path(0), start);
  let [reached, piece] = [0, FIRST_PIECE];
  let previous: { reached: number; state: State } | null = null;
  while (state && reached < 1) {
    const target = Math.min(1, reached + piece);
    const now: State = state;
    const share: number = previous ? (target - reached) / (reached - previous.reached) : 0;
    const guess = now.map((value, k) => value + share * (value - (previous?.state[k] ?? value)));
    const map = path(target);
    const found = fixedPoint(map, guess);
    if (found && (side === undefined || sideOfFolds(map, found) === side)) {
      previous = { reached, state: now };
      [state, reached, piece] = [found, target, piece * 1.5];
    } else if ((piece *= 0.5) < SMALLEST_PIECE) {
      return null;
    }
  }
  return state;
}

/** Modes of a map's derivative, by falling magnitude; a mode is named by the coordinates that take the larger part in it. */
export function modesOf(matrix: Matrix, names: readonly string[]): Mode[] {
  const right = eigen(matrix);
  const left = eigen(matrix[0].map((_, j) => matrix.map((row) => row[j])));
  const used = new Set<number>();
  const modes = right.values.map((value, k) => {
    let best = -1;
    let least = Infinity;
    left.values.forEach((other, i) => {
      const distance = Math.hypot(other.re - value.re, other.im - value.im);
      if (!used.has(i) && distance < least) [best, least] = [i, distance];
    });
    used.add(best);
    const weights = right.vectors[k].map((z, i) => magnitude(z) * magnitude(left.vectors[best][i]));
    const own = right.vectors[k].map((z) => magnitude(z) ** 2);
    const shares = weights.reduce((a, b) => a + b, 0) > 1e-12 ? weights : own;
    const total = shares.reduce((a, b) => a + b, 0);
    const lateral = shares.reduce((sum, share, i) => sum + (LATERAL.has(names[i]) ? share : 0), 0) / total;
    const mode: Mode = {
      value,
      magnitude: magnitude(value),
      name: lateral > 0.5 ? "three-dimensional" : "fore-aft",
      lateralShare: lateral,
    };
    return mode;
  });
  return modes.sort((a, b) => b.magnitude - a.magnitude || b.value.im - a.value.im);
}

/** Stance pitch rate of the walker without hip width, in closed form; NaN where the slope gives no energy. */
function planarRate(p: Parameters, heading: number): number {
  const r = p.foot_radius;
  const half = 0.5 * p.inter_leg_angle;
  const level = r + (1 - r) * Math.cos(half);
  const lift = (1 - r) * Math.sin(half);
  const inertia = level ** 2 + lift ** 2;
  const kept = (level ** 2 - lift ** 2) / inertia;
  const stepLength = 2 * (r * half + lift);
  const gained = (2 * stepLength * Math.sin(p.slope) * Math.cos(heading)) / inertia;
  return gained > 0 && kept ** 2 < 1 ? -Math.sqrt((gained * kept ** 2) / (1 - kept ** 2)) : NaN;
}

function planarGuess(p: Parameters): State | null {
  let heading = 0;
  if (p.mass_offset !== 0 && !p.slope_turns) {
    const sine = -p.mass_offset / Math.tan(p.slope || Infinity);
    if (!(Math.abs(sine) < 1)) return null;
    heading = Math.asin(sine);
  }
  const rate = planarRate(p, heading);
  return Number.isNaN(rate) ? null : [heading, 0.5 * p.inter_leg_angle, 0, rate, 0];
}

/** The map at no hip width and no offset (share 0) up to the walker's own (share 1). */
function widening(kernel: Kernel, p: Parameters, steps: number): Path {
  return (share) => activeMap(kernel, { ...p, hip_width: share * p.hip_width, mass_offset: share * p.mass_offset }, steps);
}

/**
 * The steered walker's gait at a constant command, with its multipliers; null where there is none.
 *
 * As the package searches (`search_active`): solved from the planar gait's closed form; where a fast and a slow gait exist, which meet at a
 * fold, the one that the planar gait leads to. What Newton's method reaches from `nearby` comes last.
 */
export function findCycle(kernel: Kernel, p: Parameters, nearby: State | null = null): Cycle | null {
  const steps = p.mass_offset === 0 ? 1 : 2;
  const map = activeMap(kernel, p, steps);
  const path = widening(kernel, p, steps);
  const planar = planarGuess({ ...p, mass_offset: 0 });
  const guess = planarGuess(p);
  let state = guess && fixedPoint(map, guess);
  if (state && planar) {
    const side = sideOfFolds(path(0), planar);
    if (sideOfFolds(map, state) !== side) state = followed(path, planar, side) ?? state;
  }
  state ??= planar && followed(path, planar);
  state ??= nearby && fixedPoint(map, nearby);
  return state && cycleAt(kernel, p, state);
}

/** Describe the gait at a fixed point, over two steps. */
export function cycleAt(kernel: Kernel, p: Parameters, state: State): Cycle | null {
  const body = bodyOf(p);
  const command: Command = { inter_leg_angle: p.inter_leg_angle, mass_offset: p.mass_offset, previous_offset: p.mass_offset };
  const stride = activeMap(kernel, p, 2);
  const derivative = stride.derivative(state);
  const first = kernel.step(body, command, state, 1);
  const second = kernel.step(body, command, COORDINATES.map((name) => first[name]), -1);
  if (!derivative || fallOf(first.status) || fallOf(second.status)) return null;
  const duration = first.duration + second.duration;
  const chord = Math.hypot(
    first.displacement_x + second.displacement_x,
    first.displacement_z + second.displacement_z,
  );
  const modes = modesOf(selected(derivative.matrix, stride.free), stride.free.map((k) => stride.names[k]));
  return {
    state,
    modes,
    stable: modes[0].magnitude < 1,
    stridePeriod: duration,
    speed: chord / duration,
    stepLength: chord / 2,
    heading: 0.5 * (state[0] + first.heading),
    turn: stride.free[0] === 0 ? 0 : derivative.image[0] - state[0],
    energy: {
      gravity: (first.gravity_work + second.gravity_work) / 2,
      shift: (first.shift_work + second.shift_work) / 2,
      impact: (first.impact_loss + second.impact_loss) / 2,
      ankle: (first.ankle_loss + second.ankle_loss) / 2,
    },
    normalForce: Math.min(first.least_normal_force, second.least_normal_force),
    frictionDemand: Math.max(first.greatest_friction, second.greatest_friction),
    residual: largest(stride.free.map((k) => derivative.image[k] - state[k])),
  };
}

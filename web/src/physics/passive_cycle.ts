// Gaits of the passive walkers, in the plane and in space.

import type { Kernel, Side, State } from "../kernel/kernel";
import { PASSIVE_STATE_SIZE, STATUS } from "../kernel/layout";
import { fixedPoint, followed, modesOf, type Cycle, type Path, type SectionMap } from "./cycle";
import { identity, product, selected } from "./linalg";
import { bodyOf, MIRROR, mirrored, PASSIVE_COORDINATES, type Parameters } from "./walker";

/** Coordinates that a walker in the plane moves. */
const FORE_AFT = [1, 3, 5];
/** A smaller step is the solution of not walking at all. */
const LEAST_PITCH = 1e-3;
const ROWS = Array.from({ length: PASSIVE_STATE_SIZE }, (_, k) => k);

function bodyIn(p: Parameters, planar: boolean) {
  return bodyOf(planar ? { ...p, hip_width: 0 } : p);
}

/** Steps of the passive walker from both feet on the floor; an odd number ends with the mirror image. */
export function passiveMap(kernel: Kernel, p: Parameters, planar: boolean, steps: number): SectionMap {
  const body = bodyIn(p, planar);
  const flip = steps % 2 === 1;
  return {
    free: planar ? FORE_AFT : ROWS,
    names: PASSIVE_COORDINATES,
    image(state) {
      let side: Side = 1;
      let angle = NaN;
      for (let k = 0; k < steps; k++) {
        const outcome = kernel.passiveStep(body, state, angle, side);
        if (outcome.status !== STATUS.STEPPED) return null;
        state = PASSIVE_COORDINATES.map((name) => outcome[name]);
        angle = outcome.inter_leg_angle;
        side = -side as Side;
      }
      return flip ? mirrored(state) : state;
    },
    derivative(state) {
      let side: Side = 1;
      let matrix = identity(PASSIVE_STATE_SIZE);
      for (let k = 0; k < steps; k++) {
        const step = kernel.passiveDerivative(body, state, side);
        if (step.status !== STATUS.STEPPED) return null;
        matrix = product(ROWS.map((i) => step.matrix[i].slice(0, PASSIVE_STATE_SIZE)), matrix);
        state = step.state;
        side = -side as Side;
      }
      if (!flip) return { image: state, matrix };
      return { image: mirrored(state), matrix: matrix.map((row, i) => row.map((value) => MIRROR[i] * value)) };
    },
  };
}

/** Guesses of the planar gait, from Garcia's scaling law carried to round feet. */
function* starts(p: Parameters): Generator<State> {
  if (!(p.slope > 0)) return;
  const scale = (p.slope / (1 - p.foot_radius) ** 2) ** (1 / 3);
  for (const ratio of [1.0, 1.1, 0.9, 1.2, 1.3]) {
    for (const rate of [0.9, 0.8, 1.0, 0.7, 1.1]) {
      const pitch = scale * ratio;
      const swing = (1 - p.foot_radius) * pitch * rate * (1 - Math.cos(2 * pitch));
      yield [0, pitch, 0, -pitch * rate, 0, swing];
    }
  }
}

/** The planar gait of the longest period, which alone can be stable. */
function planarGait(kernel: Kernel, p: Parameters): State | null {
  const map = passiveMap(kernel, p, true, 1);
  let best: State | null = null;
  let longest = 0;
  for (const start of starts(p)) {
    const state = fixedPoint(map, start);
    if (!state || state[1] < LEAST_PITCH) continue;
    const { duration } = kernel.passiveStep(bodyIn(p, true), state, NaN, 1);
    if (duration > longest * (1 + 1e-7)) [best, longest] = [state, duration];
  }
  return best;
}

/** The gait that Newton's method reaches from a state; null where it reaches none. */
export function passiveCycleNear(kernel: Kernel, p: Parameters, planar: boolean, nearby: State): Cycle | null {
  const state = fixedPoint(passiveMap(kernel, p, planar, 1), nearby);
  return state && state[1] > LEAST_PITCH ? passiveCycleAt(kernel, p, planar, state) : null;
}

/** A passive walker's gait with its multipliers; null where none was found. */
export function findPassiveCycle(kernel: Kernel, p: Parameters, planar: boolean, nearby: State | null = null): Cycle | null {
  const close = nearby && passiveCycleNear(kernel, p, planar, nearby);
  if (close) return close;
  const flat = planarGait(kernel, p);
  const widening: Path = (share) => passiveMap(kernel, { ...p, hip_width: share * p.hip_width }, false, 1);
  const state = flat && !planar && p.hip_width > 0 ? followed(widening, flat) : flat;
  return state && passiveCycleAt(kernel, p, planar, state);
}

function passiveCycleAt(kernel: Kernel, p: Parameters, planar: boolean, state: State): Cycle | null {
  const body = bodyIn(p, planar);
  const stride = passiveMap(kernel, p, planar, 2);
  const derivative = stride.derivative(state);
  const first = kernel.passiveStep(body, state, NaN, 1);
  const middle = PASSIVE_COORDINATES.map((name) => first[name]);
  const second = kernel.passiveStep(body, middle, first.inter_leg_angle, -1);
  if (!derivative || first.status !== STATUS.STEPPED || second.status !== STATUS.STEPPED) return null;
  const duration = first.duration + second.duration;
  const chord = Math.hypot(first.displacement_x + second.displacement_x, first.displacement_z + second.displacement_z);
  const { free, names } = stride;
  const modes = modesOf(selected(derivative.matrix, free), free.map((k) => names[k]));
  return {
    state,
    modes,
    stable: modes[0].magnitude < 1,
    stridePeriod: duration,
    speed: chord / duration,
    stepLength: chord / 2,
    heading: 0.5 * (state[0] + first.heading),
    turn: 0,
    energy: {
      gravity: (first.gravity_work + second.gravity_work) / 2,
      shift: 0,
      impact: (first.impact_loss + second.impact_loss) / 2,
      ankle: (first.ankle_loss + second.ankle_loss) / 2,
    },
    normalForce: Math.min(first.least_normal_force, second.least_normal_force),
    frictionDemand: Math.max(first.greatest_friction, second.greatest_friction),
    residual: Math.max(...free.map((k) => Math.abs(derivative.image[k] - state[k]))),
  };
}

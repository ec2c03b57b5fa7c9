// A walk as it goes on: steps from the kernel, one after the other, and the pose at any time within them.

import type { Command, Kernel, Samples, Side, State } from "../kernel/kernel";
import { TRACE } from "../kernel/layout";
import {
  bodyOf, COORDINATES, fallOf, PASSIVE_COORDINATES, passiveFallOf, type Fall, type Parameters, type Pose,
} from "./walker";
import { shapeOf, type Vector } from "./geometry";

/** The steered walker holds its swing leg in front; a passive walker's swings, in space or in the plane. */
export type Kind = "steered" | "passive" | "planar";

/** A step of a walk, completed or ending in a fall. */
export interface StepRecord {
  index: number;
  startTime: number;
  duration: number;
  side: Side;
  state: State;
  /** After the step; where the walker was last, if it fell. */
  after: State;
  contact: [number, number];
  interLeg: number;
  commandedOffset: number;
  offsetBefore: number;
  offset: number;
  energy: { gravity: number; shift: number; impact: number; ankle: number };
  normalForce: number;
  frictionDemand: number;
  fall: Fall | null;
  parameters: Parameters;
}

/** What the next step is commanded, and what happens to the walker before it. */
export interface Order {
  parameters: Parameters;
  /** Added to the rates of stance pitch and ankle at the start of the step. */
  push?: { pitchRate: number; ankleRate: number };
  /** Where the step is to begin, instead of where the last one ended. */
  state?: State;
}

/** Short enough that cubics between samples are right to 1e-8 leg lengths. */
const SAMPLE_TIME = 0.045;
/** The model has the swing leg in front at once; it is drawn on its way for this share of a step. */
const SWING_SHARE = 0.5;
const RETRACTION = 0.055;
/** How long after a fall the stance leg's motion is drawn on, at most, and how low the masses then come. */
const FALLING_TIME = 6;
const LYING_HEIGHT = 0.06;

const AT = Object.fromEntries(TRACE.map((name, k) => [name, k])) as Record<(typeof TRACE)[number], number>;
// Columns of a passive motion
const PASSIVE = { time: 0, stance_pitch: 1, ankle_angle: 2, inter_leg: 3, stance_pitch_rate: 4, ankle_rate: 5, height: 7 };

function blend(s: number): number {
  return s * s * s * (10 + s * (6 * s - 15));
}

/** Samples at uniform times, with cubics between them where a rate is known. */
class Track {
  constructor(readonly samples: Samples, readonly end: number) {}

  private at(time: number): [number, number] {
    const place = this.end > 0 ? (Math.min(Math.max(time, 0), this.end) / this.end) * (this.samples.n - 1) : 0;
    const index = Math.min(Math.floor(place), this.samples.n - 2);
    return [index, place - index];
  }

  value(row: number, column: number): number {
    return this.samples.values[row * this.samples.columns + column];
  }

  linear(time: number, column: number): number {
    const [i, s] = this.at(time);
    return (1 - s) * this.value(i, column) + s * this.value(i + 1, column);
  }

  cubic(time: number, column: number, rate: number): number {
    const [i, s] = this.at(time);
    const h = this.end / (this.samples.n - 1);
    const r = 1 - s;
    return (
      r * r * (1 + 2 * s) * this.value(i, column) + s * s * (3 - 2 * s) * this.value(i + 1, column) +
      s * r * h * (r * this.value(i, rate) - s * this.value(i + 1, rate))
    );
  }

  /** The first part, up to a row. */
  until(row: number): Track {
    const n = Math.max(row + 1, 2);
    return new Track({ ...this.samples, n }, (this.end * (n - 1)) / (this.samples.n - 1));
  }
}

export class Walk {
  time = 0;
  state: State;
  side: Side;
  contact: [number, number] = [0, 0];
  offset = 0;
  readonly records: StepRecord[] = [];
  /** The step on the way, or the last one after a fall. */
  current!: StepRecord;
  /** Set when the step on the way ends in one; it has happened once `time` is past the step's end. */
  private track!: Track;
  private falling: Track | null = null;
  private fallingTime = 0;
  private startAngle = NaN;
  private previousAngle: number | null = null;
  onStep: (record: StepRecord) => void = () => {};
  onFall: (record: StepRecord) => void = () => {};
  order: () => Order;

  constructor(
    private readonly kernel: Kernel,
    readonly kind: Kind,
    start: { state: State; side?: Side; contact?: [number, number]; offset?: number },
    order: () => Order,
  ) {
    this.state = [...start.state];
    this.side = start.side ?? 1;
    this.contact = start.contact ?? [0, 0];
    this.offset = start.offset ?? 0;
    this.order = order;
    this.begin();
  }

  get hasFallen(): boolean {
    return this.current.fall !== null && this.time >= this.endTime;
  }

  /** Whether nothing moves any more. */
  get isOver(): boolean {
    return this.hasFallen && this.time >= this.endTime + this.fallingTime;
  }

  private get endTime(): number {
    return this.current.startTime + this.current.duration;
  }

  /** Let time pass; takes as many steps as it holds. */
  advance(duration: number): void {
    const target = this.time + duration;
    while (!this.current.fall && target >= this.endTime) {
      this.time = this.endTime;
      this.land();
    }
    this.time = this.current.fall ? Math.min(target, this.endTime + this.fallingTime) : target;
    if (this.hasFallen && this.records.at(-1) !== this.current) {
      this.records.push(this.current);
      this.onFall(this.current);
    }
  }

  /** Go on to the end of the step on the way, and of the fall if it ends in one. */
  finishStep(): void {
    const rest = Math.max(this.endTime - this.time, 0);
    this.advance(this.current.fall ? rest + this.fallingTime : rest + 1e-9);
  }

  private land(): void {
    const done = this.current;
    this.records.push(done);
    this.state = [...done.after];
    this.side = -this.side as Side;
    this.offset = done.offset;
    this.previousAngle = done.interLeg;
    this.begin();
    this.onStep(done);
  }

  private begin(): void {
    const { parameters, push, state } = this.order();
    if (state) this.state = [...state];
    if (push) {
      this.state[3] += push.pitchRate;
      this.state[4] += push.ankleRate;
    }
    this.current = this.kind === "steered" ? this.steered(parameters) : this.passive(parameters);
    if (this.current.fall) this.fall();
  }

  private nextContact: [number, number] = [0, 0];

  private record(
    parameters: Parameters, outcome: Record<string, number>, fall: Fall | null, after: State, more: Partial<StepRecord>,
  ): StepRecord {
    if (this.records.length) this.contact = this.nextContact;
    this.nextContact = [this.contact[0] + outcome.displacement_x, this.contact[1] + outcome.displacement_z];
    return {
      index: this.records.length,
      startTime: this.records.length ? this.time : 0,
      duration: outcome.duration,
      side: this.side,
      state: [...this.state],
      after,
      contact: this.contact,
      interLeg: parameters.inter_leg_angle,
      commandedOffset: 0,
      offsetBefore: 0,
      offset: 0,
      energy: {
        gravity: outcome.gravity_work,
        shift: outcome.shift_work ?? 0,
        impact: outcome.impact_loss,
        ankle: outcome.ankle_loss,
      },
      normalForce: outcome.least_normal_force,
      frictionDemand: outcome.greatest_friction,
      fall,
      parameters,
      ...more,
    };
  }

  private steered(parameters: Parameters): StepRecord {
    const command = this.command(parameters);
    const outcome = this.kernel.step(bodyOf(parameters), command, this.state, this.side);
    this.track = this.trace(parameters, command, Math.max(outcome.duration, 1e-6));
    const after = COORDINATES.map((name) => outcome[name]);
    return this.record(parameters, outcome, fallOf(outcome.status), after, {
      commandedOffset: parameters.mass_offset,
      offsetBefore: this.offset,
      offset: outcome.mass_offset,
    });
  }

  private command(parameters: Parameters): Command {
    return { inter_leg_angle: parameters.inter_leg_angle, mass_offset: parameters.mass_offset, previous_offset: this.offset };
  }

  private trace(parameters: Parameters, command: Command, duration: number): Track {
    const n = Math.max(Math.ceil(duration / SAMPLE_TIME), 2) + 1;
    return new Track(this.kernel.trace(bodyOf(parameters), command, this.state, this.side, duration, n), duration);
  }

  private passiveBody(parameters: Parameters) {
    return bodyOf(this.kind === "planar" ? { ...parameters, hip_width: 0 } : parameters);
  }

  private passive(parameters: Parameters): StepRecord {
    const outcome = this.kernel.passiveStep(this.passiveBody(parameters), this.state, this.startAngle, this.side);
    const angle = outcome.start_inter_leg_angle;
    this.track = this.passiveTrack(parameters, angle, Math.max(outcome.duration, 1e-6));
    const fall = passiveFallOf(outcome.status, outcome.stance_pitch);
    const after = PASSIVE_COORDINATES.map((name) => outcome[name]);
    const record = this.record(parameters, outcome, fall, after, { interLeg: outcome.inter_leg_angle });
    this.passiveStart = angle;
    this.startAngle = outcome.inter_leg_angle;
    return record;
  }

  private passiveStart = 0;

  private passiveTrack(parameters: Parameters, angle: number, duration: number): Track {
    const n = Math.max(Math.ceil(duration / SAMPLE_TIME), 2) + 1;
    const body = this.passiveBody(parameters);
    return new Track(this.kernel.passiveMotion(body, this.state, angle, this.side, duration, n), duration);
  }

  /** After a fall the stance leg goes on as the model has it, until the masses are down; the floor has no other part in it. */
  private fall(): void {
    const { duration, parameters } = this.current;
    const whole = duration + FALLING_TIME;
    const track =
      this.kind === "steered"
        ? this.trace(parameters, this.command(parameters), whole)
        : this.passiveTrack(parameters, this.passiveStart, whole);
    let row = 1;
    while (row < track.samples.n - 1 && this.isUp(track, row)) row++;
    this.falling = track.until(row);
    this.fallingTime = Math.max(this.falling.end - duration, 0);
  }

  private isUp(track: Track, row: number): boolean {
    const [pitch, ankle] = [track.value(row, 1), track.value(row, 2)];
    if (!(Math.abs(pitch) < 2.2 && Math.abs(ankle) < 2.2)) return false;
    const { side, contact, interLeg, offset } = this.current;
    const pose: Pose = { heading: 0, pitch, ankle, side, contact, interLeg, retraction: 0, offset, hasFallen: true };
    return Math.min(...shapeOf(this.current.parameters, pose).masses.map((mass) => mass[1])) > LYING_HEIGHT;
  }

  /** Where the walker is now. */
  pose(): Pose {
    return this.poseAt(this.time - this.current.startTime);
  }

  private poseAt(within: number): Pose {
    const fallen = within > this.current.duration && this.falling !== null;
    const track = fallen ? this.falling! : this.track;
    const common = {
      heading: this.current.state[0],
      pitch: track.cubic(within, 1, this.kind === "steered" ? AT.stance_pitch_rate : PASSIVE.stance_pitch_rate),
      ankle: track.cubic(within, 2, this.kind === "steered" ? AT.ankle_rate : PASSIVE.ankle_rate),
      side: this.current.side,
      contact: this.current.contact,
      hasFallen: fallen,
    };
    if (this.kind !== "steered") {
      const share = Math.min(within / Math.max(this.current.duration, 1e-9), 1);
      const below = Math.max(-track.linear(within, PASSIVE.height), 0);
      return {
        ...common,
        interLeg: Math.min(Math.max(track.linear(within, PASSIVE.inter_leg), -1.5), 1.5),
        retraction: fallen ? 0 : 1.1 * below + 0.02 * Math.sin(Math.PI * share) ** 2,
        offset: 0,
      };
    }
    return { ...common, ...this.swing(within), offset: track.linear(within, AT.mass_offset) };
  }

  /** The massless swing leg as drawn: from where the old stance leg was left to the front, a little shortened on the way. */
  private swing(within: number): { interLeg: number; retraction: number } {
    const { interLeg, duration, fall } = this.current;
    const s = within / (SWING_SHARE * (fall ? Math.max(duration, 0.6) : duration));
    if (this.previousAngle === null || s >= 1) return { interLeg, retraction: 0 };
    const part = blend(s);
    return {
      interLeg: -this.previousAngle + part * (interLeg + this.previousAngle),
      retraction: RETRACTION * Math.sin(Math.PI * part) ** 2,
    };
  }

  /** The centre of mass (downhill, up, right) at `n` uniform times within the step on the way. */
  centrePath(n: number): Vector[] {
    return Array.from({ length: n }, (_, k) => {
      const pose = this.poseAt((this.current.duration * k) / (n - 1));
      return shapeOf(this.current.parameters, pose).centre;
    });
  }

  /** Angles and rates within the step on the way, for phase plots: rows of (pitch, ankle, pitch rate, ankle rate). */
  phase(): number[][] {
    const { n } = this.track.samples;
    const rates = this.kind === "steered" ? [AT.stance_pitch_rate, AT.ankle_rate] : [PASSIVE.stance_pitch_rate, PASSIVE.ankle_rate];
    return Array.from({ length: n }, (_, row) => [1, 2, ...rates].map((column) => this.track.value(row, column)));
  }

  /** How far the step on the way is, from 0 to 1. */
  get share(): number {
    return Math.min((this.time - this.current.startTime) / Math.max(this.current.duration, 1e-9), 1);
  }
}

// Episodes of the package's tasks: the tasks' own formulas, compiled; records of one walker in memory, as lean_yaw_env.envs keeps them.

import type { Body, Kernel, Side, State } from "../kernel/kernel";
import { BODY, OUTCOME } from "../kernel/layout";
import { COORDINATES, type Parameters } from "../physics/walker";
import description from "./tasks.json";
import address from "./tasks.wasm?url";

/** Place of each field in a record, in words of eight bytes; `-1 - place` of a count. */
type Fields = Record<string, number>;

export interface TaskDescription {
  /** Name and version. */
  id: string;
  summary: string;
  reward: string;
  fields: Fields;
  initial: string;
  settings: string;
  body: string;
  horizon: number;
  observation: string[];
  /** Field, divisor and meaning. */
  metrics: Record<string, [string, string | null, string]>;
  headline: string;
  heading: string | null;
  goal: [string, string] | null;
  radius: number;
  /** The second number of the actions that keep a gait of pumping going. */
  pump: number;
}

type Entry = (...places: number[]) => void;

interface Exports {
  memory: WebAssembly.Memory;
  shared_rows(): number;
  _initialize?(): void;
  start: Entry;
  command: Entry;
  move: Entry;
  [name: string]: unknown;
}

const WALKER: Fields = description.walker;
export const TASKS = description.tasks as unknown as Record<string, TaskDescription>;

// Where records lie in the shared memory, in bytes
const PLACE = { walker: 0, task: 1024, settings: 2048, body: 3072, action: 3328, observation: 3344, results: 3600, outcome: 3648, end: 4096 };
// Events of lean_yaw_env.envs.outputs
const STEP = 0n;
const RESET = 1n;

export class TaskModule {
  private static loaded: Promise<TaskModule> | null = null;

  private constructor(private readonly kernel: Kernel, private readonly exports: Exports) {
    exports._initialize?.();
  }

  static load(kernel: Kernel): Promise<TaskModule> {
    TaskModule.loaded ??= (async () => {
      const bytes = await (await fetch(address)).arrayBuffer();
      const { instance } = await WebAssembly.instantiate(bytes);
      return new TaskModule(kernel, instance.exports as unknown as Exports);
    })();
    return TaskModule.loaded;
  }

  /** An episode that is about to start; the same key draws the same numbers. */
  episode(name: string, key: bigint): Episode {
    return new Episode(this.kernel, this.exports, name, key);
  }
}

function bytesOf(text: string): Uint8Array {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

export class Episode {
  readonly task: TaskDescription;
  private readonly bytes = new Uint8Array(PLACE.end);
  private readonly numbers = new Float64Array(this.bytes.buffer);
  private readonly counts = new BigInt64Array(this.bytes.buffer);
  private readonly floats = new Float32Array(this.bytes.buffer);
  observation!: Float32Array;
  reward = 0;
  terminated = false;
  truncated = false;
  /** Sum of rewards. */
  total = 0;

  constructor(private readonly kernel: Kernel, private readonly exports: Exports, readonly name: string, key: bigint) {
    this.task = TASKS[name];
    this.bytes.set(bytesOf(this.task.initial), PLACE.task);
    this.bytes.set(bytesOf(this.task.settings), PLACE.settings);
    this.bytes.set(bytesOf(this.task.body), PLACE.body);
    this.counts[-1 - WALKER.key] = BigInt.asIntN(64, key);
    this.call(exports.start, PLACE.walker, PLACE.body, PLACE.settings);
    this.write(RESET);
  }

  /** Take a step with an action of two numbers from -1 to 1: inter-leg angle and mass offset, as seen from a left stance. */
  step(action: ArrayLike<number>): void {
    this.numbers[PLACE.body / 8 + BODY.indexOf("slope")] = this.walker("slope");
    this.floats.set(Array.from(action, Math.fround), PLACE.action / 4);
    const { state, side } = this;
    const previous = this.walker("mass_offset");
    this.call(this.exports.command, PLACE.walker, PLACE.settings, PLACE.action);
    const command = { inter_leg_angle: this.walker("inter_leg_angle"), mass_offset: this.walker("commanded_offset"), previous_offset: previous };
    const outcome = this.kernel.step(this.body, command, state, side);
    this.numbers.set(OUTCOME.map((name) => outcome[name]), PLACE.outcome / 8);
    this.call(this.exports.move, PLACE.walker, PLACE.settings, PLACE.outcome);
    this.write(STEP);
    const [reward, terminated, truncated] = this.numbers.subarray(PLACE.results / 8, PLACE.results / 8 + 3);
    this.reward = reward;
    this.total += reward;
    [this.terminated, this.truncated] = [terminated !== 0, truncated !== 0];
  }

  get isOver(): boolean {
    return this.terminated || this.truncated;
  }

  private write(event: bigint): void {
    const outputs = this.exports[`outputs_${this.name}`] as (event: bigint, ...places: number[]) => void;
    this.call((...places) => outputs(event, ...places), PLACE.walker, PLACE.task, PLACE.settings, PLACE.observation, PLACE.results);
    const first = PLACE.observation / 4;
    this.observation = this.floats.slice(first, first + this.task.observation.length);
  }

  private call<Result>(entry: (...places: number[]) => Result, ...places: number[]): Result {
    const base = this.exports.shared_rows();
    const memory = new Uint8Array(this.exports.memory.buffer, base, PLACE.end);
    memory.set(this.bytes);
    const result = entry(...places.map((place) => base + place));
    this.bytes.set(memory);
    return result;
  }

  private get body(): Body {
    const first = PLACE.body / 8;
    return Object.fromEntries(BODY.map((name, k) => [name, this.numbers[first + k]])) as Body;
  }

  /** The body and the last step's command, as walks take them. */
  get parameters(): Parameters {
    const { slope_turns, ...body } = this.body;
    return { ...body, slope_turns: slope_turns !== 0, inter_leg_angle: this.walker("inter_leg_angle"), mass_offset: this.walker("commanded_offset"), more: body };
  }

  /** A number of the walker's record. */
  walker(field: string): number {
    return this.at(0, WALKER[field]);
  }

  /** A number, or the first, of the task's own record or else of the walker's. */
  value(field: string): number {
    return field in this.task.fields ? this.at(PLACE.task / 8, this.task.fields[field]) : this.walker(field);
  }

  private at(first: number, place: number): number {
    return place < 0 ? Number(this.counts[first - 1 - place]) : this.numbers[first + place];
  }

  get state(): State {
    return COORDINATES.map((name) => this.walker(name));
  }

  get side(): Side {
    return this.walker("side") as Side;
  }

  /** The task's measures so far. */
  get metrics(): Record<string, number> {
    const measured = Object.entries(this.task.metrics).map(([name, [field, divisor]]) => {
      const below = divisor ? this.value(divisor) : 1;
      return [name, below > 0 ? this.value(field) / below : 0];
    });
    return Object.fromEntries(measured);
  }

  get goal(): [number, number] | null {
    return this.task.goal && [this.value(this.task.goal[0]), this.value(this.task.goal[1])];
  }

  /** The gate after the next, in a race. */
  get laterGate(): [number, number] | null {
    return "later_x" in this.task.fields ? [this.value("later_x"), this.value("later_z")] : null;
  }

  get commandedHeading(): number | null {
    return this.task.heading === null ? null : this.value(this.task.heading);
  }

  /** How far to the right the path to be followed is at a place downhill; null if there is no path. */
  get path(): ((downhill: number) => number) | null {
    const entry = this.exports[`path_${this.name}`] as ((task: number, downhill: number) => number) | undefined;
    return entry ? (downhill) => this.call((task) => entry(task, downhill), PLACE.task) : null;
  }
}

// Episodes of the package's tasks: the tasks' own formulas, compiled; records of one walker in memory, as lean_yaw_env.envs keeps them.

import type { Side, State } from "../kernel/kernel";
import description from "./tasks.json";
import address from "./tasks.wasm?url";

/** Place of a field in a record, in words of eight bytes, and how many it has. */
type Fields = Record<string, [number, number]>;

export interface TaskDescription {
  summary: string;
  reward: string;
  fields: Fields;
  initial: string;
  settings: string;
  parameters: Record<string, number | boolean | string>;
  body: string;
  horizon: number;
  observation: string[];
  metrics: Record<string, { field: string; divisor: string | null; meaning: string }>;
  heading_field: string | null;
  goal_fields: [string, string] | null;
  goal_radius: number;
  /** Means of the shipped agents over held-out episodes, by metric. */
  agents: Record<string, Record<string, number>>;
}

interface Exports {
  memory: WebAssembly.Memory;
  shared_rows(): number;
  _initialize?(): void;
  [name: string]: unknown;
}

const WALKER = description.walker as unknown as Fields;
export const TASKS = description.tasks as unknown as Record<string, TaskDescription>;

// Where records lie in the shared memory, in bytes
const PLACE = { walker: 0, task: 1024, settings: 2048, body: 3072, action: 3328, observation: 3344, results: 3600, end: 4096 };
const STATE = ["heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate"];

export class TaskModule {
  private static loaded: Promise<TaskModule> | null = null;

  private constructor(readonly exports: Exports) {
    exports._initialize?.();
  }

  static load(): Promise<TaskModule> {
    TaskModule.loaded ??= (async () => {
      const bytes = await (await fetch(address)).arrayBuffer();
      const { instance } = await WebAssembly.instantiate(bytes);
      return new TaskModule(instance.exports as unknown as Exports);
    })();
    return TaskModule.loaded;
  }

  /** An episode that is about to start; the same seed draws the same numbers. */
  episode(name: string, seed: bigint): Episode {
    return new Episode(this, name, seed);
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
  observation: Float32Array;
  total = 0;
  isOver = false;

  constructor(private readonly module: TaskModule, readonly name: string, seed: bigint) {
    this.task = TASKS[name];
    this.bytes.set(bytesOf(this.task.initial), PLACE.task);
    this.bytes.set(bytesOf(this.task.settings), PLACE.settings);
    this.bytes.set(bytesOf(this.task.body), PLACE.body);
    this.counts[WALKER.key[0]] = BigInt.asIntN(64, seed);
    this.call(`start_${name}`, PLACE.walker, PLACE.task, PLACE.settings, PLACE.body, PLACE.observation);
    this.observation = this.seen();
  }

  /** Take a step with an action of two numbers from -1 to 1: inter-leg angle and mass offset, as seen from a left stance. */
  step(action: ArrayLike<number>): { reward: number; terminated: boolean; truncated: boolean } {
    this.floats.set(Array.from(action, Math.fround), PLACE.action / 4);
    this.call(`step_${this.name}`, PLACE.walker, PLACE.task, PLACE.settings, PLACE.body, PLACE.action, PLACE.observation, PLACE.results);
    this.observation = this.seen();
    const [reward, terminated, truncated] = this.numbers.subarray(PLACE.results / 8, PLACE.results / 8 + 3);
    this.total += reward;
    this.isOver = terminated !== 0 || truncated !== 0;
    return { reward, terminated: terminated !== 0, truncated: truncated !== 0 };
  }

  private call(name: string, ...places: number[]): void {
    const { exports } = this.module;
    const base = exports.shared_rows();
    const memory = new Uint8Array(exports.memory.buffer, base, PLACE.end);
    memory.set(this.bytes);
    (exports[name] as (...places: number[]) => void)(...places.map((place) => base + place));
    this.bytes.set(memory);
  }

  private seen(): Float32Array {
    const first = PLACE.observation / 4;
    return this.floats.slice(first, first + this.task.observation.length);
  }

  /** A number of the walker's record. */
  walker(field: string): number {
    return this.numbers[WALKER[field][0]];
  }

  /** A number, or the first, of the task's own record or else of the walker's. */
  value(field: string): number {
    const own = this.task.fields[field];
    const place = own ? PLACE.task / 8 + own[0] : WALKER[field][0];
    const value = this.numbers[place];
    // counts are whole numbers, which read as doubles would be next to nothing
    return value !== 0 && Math.abs(value) < 1e-300 ? Number(this.counts[place]) : value;
  }

  get state(): State {
    return STATE.map((name) => this.walker(name));
  }

  get side(): Side {
    return this.walker("side") as Side;
  }

  /** The task's measures so far. */
  get metrics(): Record<string, number> {
    return Object.fromEntries(
      Object.entries(this.task.metrics).map(([name, { field, divisor }]) => {
        const below = divisor ? this.value(divisor) : 1;
        return [name, below > 0 ? this.value(field) / below : 0];
      }),
    );
  }

  get goal(): [number, number] | null {
    return this.task.goal_fields && [this.value(this.task.goal_fields[0]), this.value(this.task.goal_fields[1])];
  }

  get commandedHeading(): number | null {
    return this.task.heading_field ? this.value(this.task.heading_field) : null;
  }

  /** How far to the right the path to be followed is at a place downhill; null if there is no path. */
  path(downhill: number): number | null {
    const { exports } = this.module;
    const path = exports[`path_${this.name}`] as ((task: number, downhill: number) => number) | undefined;
    if (!path) return null;
    const base = exports.shared_rows();
    new Uint8Array(exports.memory.buffer, base, PLACE.end).set(this.bytes);
    return path(base + PLACE.task, downhill);
  }
}

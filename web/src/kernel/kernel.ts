// The compiled kernel: rows of doubles in, rows of doubles out. Layouts come from the kernel's records, see layout.ts.

import {
  BODY, COMMAND, INPUTS, OUTCOME, OUTPUTS, PASSIVE_COLUMNS, PASSIVE_INPUTS, PASSIVE_OUTCOME, PASSIVE_STATE_SIZE, STATE_SIZE,
  TRACE,
} from "./layout";
import address from "./kernel.wasm?url";

export type Body = Record<(typeof BODY)[number], number>;
export type Command = Record<(typeof COMMAND)[number], number>;
export type Outcome = Record<(typeof OUTCOME)[number], number>;
export type PassiveOutcome = Record<(typeof PASSIVE_OUTCOME)[number], number>;
export type State = number[];
/** +1 when the left foot stands, -1 when the right one does. */
export type Side = 1 | -1;

interface Exports {
  memory: WebAssembly.Memory;
  shared_rows(): number;
  shared_size(): number;
  walker_step(inputs: number, outcome: number): void;
  walker_trace(inputs: number, duration: number, n: number, rows: number): void;
  walker_jacobian(inputs: number, state: number, jacobian: number): number;
  walker_walk(inputs: number, n: number, outcome: number): number;
  passive_step(inputs: number, outcome: number): void;
  passive_motion(inputs: number, duration: number, n: number, rows: number): void;
  passive_derivative(inputs: number, state: number, jacobian: number): number;
  passive_walk(inputs: number, n: number, outcome: number): number;
}

/** Derivatives of a step; row i of `matrix` is output i by every input. */
export interface Derivative {
  status: number;
  state: State;
  matrix: number[][];
}

/** Results of many samples: `n` rows one after the other. */
export interface Samples {
  n: number;
  columns: number;
  values: Float64Array;
}

const RESULT = 64; // where results begin, after the longest row of inputs

export class Kernel {
  private readonly numbers: Float64Array;
  private readonly base: number;

  private constructor(private readonly exports: Exports) {
    this.base = exports.shared_rows();
    this.numbers = new Float64Array(exports.memory.buffer, this.base, exports.shared_size());
  }

  static async load(): Promise<Kernel> {
    const bytes = await (await fetch(address)).arrayBuffer();
    const { instance } = await WebAssembly.instantiate(bytes);
    return new Kernel(instance.exports as unknown as Exports);
  }

  step(body: Body, command: Command, state: State, side: Side): Outcome {
    this.writeWalker(body, command, state, side);
    this.exports.walker_step(this.base, this.place(RESULT));
    return this.record(OUTCOME, RESULT);
  }

  trace(body: Body, command: Command, state: State, side: Side, duration: number, n: number): Samples {
    this.writeWalker(body, command, state, side);
    this.exports.walker_trace(this.base, duration, n, this.place(RESULT));
    return this.samples(n, TRACE.length);
  }

  derivative(body: Body, command: Command, state: State, side: Side): Derivative {
    this.writeWalker(body, command, state, side);
    const matrix = RESULT + STATE_SIZE;
    const status = this.exports.walker_jacobian(this.base, this.place(RESULT), this.place(matrix));
    return { status, state: this.list(RESULT, STATE_SIZE), matrix: this.matrix(matrix, OUTPUTS.length, INPUTS) };
  }

  /** How many of `n` steps are completed at one command, and the last outcome. */
  walk(body: Body, command: Command, state: State, side: Side, n: number): { steps: number; last: Outcome } {
    this.writeWalker(body, command, state, side);
    const steps = this.exports.walker_walk(this.base, n, this.place(RESULT));
    return { steps, last: this.record(OUTCOME, RESULT) };
  }

  /** `angle`: where the swing leg starts; NaN for both feet on the floor. */
  passiveStep(body: Body, state: State, angle: number, side: Side): PassiveOutcome {
    this.writePassive(body, state, angle, side);
    this.exports.passive_step(this.base, this.place(RESULT));
    return this.record(PASSIVE_OUTCOME, RESULT);
  }

  passiveMotion(body: Body, state: State, angle: number, side: Side, duration: number, n: number): Samples {
    this.writePassive(body, state, angle, side);
    this.exports.passive_motion(this.base, duration, n, this.place(RESULT));
    return this.samples(n, PASSIVE_COLUMNS);
  }

  passiveDerivative(body: Body, state: State, side: Side): Derivative {
    this.writePassive(body, state, NaN, side);
    const matrix = RESULT + PASSIVE_STATE_SIZE;
    const status = this.exports.passive_derivative(this.base, this.place(RESULT), this.place(matrix));
    return {
      status,
      state: this.list(RESULT, PASSIVE_STATE_SIZE),
      matrix: this.matrix(matrix, PASSIVE_STATE_SIZE, PASSIVE_INPUTS),
    };
  }

  passiveWalk(body: Body, state: State, angle: number, side: Side, n: number): { steps: number; last: PassiveOutcome } {
    this.writePassive(body, state, angle, side);
    const steps = this.exports.passive_walk(this.base, n, this.place(RESULT));
    return { steps, last: this.record(PASSIVE_OUTCOME, RESULT) };
  }

  private place(index: number): number {
    return this.base + 8 * index;
  }

  private writeWalker(body: Body, command: Command, state: State, side: Side): void {
    let at = 0;
    for (const name of BODY) this.numbers[at++] = body[name];
    for (const name of COMMAND) this.numbers[at++] = command[name];
    for (let k = 0; k < STATE_SIZE; k++) this.numbers[at++] = state[k];
    this.numbers[at] = side;
  }

  private writePassive(body: Body, state: State, angle: number, side: Side): void {
    let at = 0;
    for (const name of BODY) this.numbers[at++] = body[name];
    for (let k = 0; k < PASSIVE_STATE_SIZE; k++) this.numbers[at++] = state[k];
    this.numbers[at++] = angle;
    this.numbers[at] = side;
  }

  private list(first: number, n: number): number[] {
    return Array.from(this.numbers.subarray(first, first + n));
  }

  private record<Name extends string>(names: readonly Name[], first: number): Record<Name, number> {
    const record = {} as Record<Name, number>;
    names.forEach((name, k) => (record[name] = this.numbers[first + k]));
    return record;
  }

  private matrix(first: number, rows: number, columns: number): number[][] {
    return Array.from({ length: rows }, (_, i) => this.list(first + i * columns, columns));
  }

  private samples(n: number, columns: number): Samples {
    return { n, columns, values: this.numbers.slice(RESULT, RESULT + n * columns) };
  }
}

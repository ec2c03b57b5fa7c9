// Who walks a task: the visitor, the paper's fixed controller, and trained policies from their files.

/** Gives an action of two numbers for an observation. */
export interface Agent {
  act(observation: ArrayLike<number>): ArrayLike<number>;
}

/** The paper's controller: no action. */
export const FIXED: Agent = { act: () => [0, 0] };

/** An algorithm's agents at a task: seeds of their trainings, what they observe, and means of their scores over held-out episodes. */
export interface AgentEntry {
  seeds: number[];
  observation: string[];
  means: Record<string, number>;
}

/** What is beside the page: agents by task (with its version) and algorithm; of each task's headline the fixed controller's mean and the reference. */
export interface AgentIndex {
  agents: Record<string, Record<string, AgentEntry>>;
  /** Linear laws: by task a matrix, row by row. */
  laws: Record<string, number[]>;
  references: Record<string, { metric: string; fixed: number; value: number }>;
}

interface PolicyCard {
  env_id: string;
  observation: { names: string[] };
  activation: string;
  output: string;
}

interface Layer {
  weight: Float32Array;
  bias: Float32Array;
}

const FLOOR = 1e-8;
const LIMIT = 10;
const ACTIVATIONS: Record<string, (x: number) => number> = { tanh: Math.tanh, relu: (x) => Math.max(x, 0) };
const OUTPUTS: Record<string, (x: number) => number> = { tanh: Math.tanh, clip: (x) => Math.min(Math.max(x, -1), 1) };

/** Arrays of single precision by name, from a safetensors file. */
function readSafetensors(file: ArrayBuffer): Map<string, Float32Array> {
  const size = Number(new DataView(file).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 8, size))) as Record<string, { dtype: string; data_offsets: [number, number] }>;
  const arrays = new Map<string, Float32Array>();
  for (const [name, { dtype, data_offsets }] of Object.entries(header)) {
    if (name === "__metadata__") continue;
    if (dtype !== "F32") throw new Error(`Weight ${name} must be F32, got ${dtype}.`);
    arrays.set(name, new Float32Array(file.slice(8 + size + data_offsets[0], 8 + size + data_offsets[1])));
  }
  return arrays;
}

/** A matrix times the observation and a constant, kept in bounds. */
export class LinearAgent implements Agent {
  constructor(private readonly matrix: number[]) {}

  act(observation: ArrayLike<number>): number[] {
    const seen = [...Array.from(observation), 1];
    return [0, 1].map((row) => OUTPUTS.clip(seen.reduce((sum, value, column) => sum + this.matrix[row * seen.length + column] * value, 0)));
  }
}

const sigmoid = (x: number) => 0.5 + 0.5 * Math.tanh(0.5 * x);

/** A trained network: normalised observations in, actions out. It may remember its latest observations, or the state of an LSTM. */
export class PolicyAgent implements Agent {
  private readonly layers: Layer[] = [];
  private readonly mean: Float32Array;
  private readonly scale: number[];
  private frames: number[];
  private hidden: number[];
  private cell: number[];

  constructor(private readonly card: PolicyCard, private readonly weights: Map<string, Float32Array>) {
    for (let k = 0; weights.has(`layers.${k}.weight`); k++) {
      this.layers.push({ weight: weights.get(`layers.${k}.weight`)!, bias: weights.get(`layers.${k}.bias`)! });
    }
    this.mean = weights.get("observation_mean")!;
    this.scale = Array.from(weights.get("observation_variance")!, (variance) => 1 / Math.sqrt(variance + FLOOR));
    const units = (weights.get("memory.bias")?.length ?? 0) / 4;
    this.frames = Array(this.mean.length).fill(0);
    this.hidden = Array(units).fill(0);
    this.cell = Array(units).fill(0);
  }

  /** The same network at the start of an episode, with nothing to remember. */
  fresh(): PolicyAgent {
    return new PolicyAgent(this.card, this.weights);
  }

  act(observation: ArrayLike<number>): number[] {
    this.frames = [...this.frames.slice(observation.length), ...Array.from(observation)];
    let signal = this.frames.map((value, k) => Math.fround(Math.min(Math.max((value - this.mean[k]) * this.scale[k], -LIMIT), LIMIT)));
    if (this.hidden.length) signal = this.remember(signal);
    this.layers.forEach((layer, k) => {
      const shape = k === this.layers.length - 1 ? OUTPUTS[this.card.output] : ACTIVATIONS[this.card.activation];
      signal = linear(layer, signal).map(shape);
    });
    return signal;
  }

  /** The next state of the LSTM: input, forget, cell and output gates. */
  private remember(signal: number[]): number[] {
    const weight = (name: string) => this.weights.get(`memory.${name}`)!;
    const fromState = linear({ weight: weight("state"), bias: new Float32Array(weight("bias").length) }, this.hidden);
    const gates = linear({ weight: weight("input"), bias: weight("bias") }, signal).map((value, k) => value + fromState[k]);
    const n = this.hidden.length;
    this.cell = this.cell.map((cell, k) => sigmoid(gates[n + k]) * cell + sigmoid(gates[k]) * Math.tanh(gates[2 * n + k]));
    this.hidden = this.cell.map((cell, k) => sigmoid(gates[3 * n + k]) * Math.tanh(cell));
    return this.hidden;
  }
}

function linear({ weight, bias }: Layer, signal: number[]): number[] {
  return Array.from(bias, (value, row) => signal.reduce((sum, each, column) => sum + weight[row * signal.length + column] * each, value));
}

const beside = (name: string) => new URL(name, document.baseURI);

/** The page's agents; none where their files are not beside the page, as in a notebook. */
export async function agentIndex(): Promise<AgentIndex> {
  const none = { agents: {}, laws: {}, references: {} };
  if (!/^https?:/.test(document.baseURI)) return none;
  const response = await fetch(beside("agents/index.json"));
  return response.ok ? ((await response.json()) as AgentIndex) : none;
}

/** The policy whose two files are at a place beside the page; it must be for observations of these names. */
export async function loadPolicy(place: string, names: string[]): Promise<PolicyAgent> {
  const addresses = [beside(`${place}.json`), beside(`${place}.safetensors`)];
  if (addresses.some(({ origin }) => origin !== location.origin)) throw new Error(`The policy ${place} is not of this site.`);
  const [card, weights] = await Promise.all(addresses.map((address) => fetch(address)));
  if (!card.ok || !weights.ok) throw new Error(`The policy ${place} could not be read.`);
  const described = (await card.json()) as PolicyCard;
  if (described.observation.names.join() !== names.join()) throw new Error(`The policy ${place} is for other observations (${described.env_id}).`);
  return new PolicyAgent(described, readSafetensors(await weights.arrayBuffer()));
}

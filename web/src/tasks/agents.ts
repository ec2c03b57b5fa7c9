// Who walks a task: the visitor, the paper's fixed controller, and trained policies from their files.

/** Gives an action of two numbers for an observation. */
export interface Agent {
  act(observation: ArrayLike<number>): ArrayLike<number>;
}

/** The paper's controller: no action. */
export const FIXED: Agent = { act: () => [0, 0] };

/** What the built page knows of a task's agents: how many seeds were trained, and their means over held-out episodes by metric. */
export interface AgentIndex {
  agents: Record<string, Record<string, { seeds: number; means: Record<string, number> }>>;
  /** Of each task's headline: the fixed controller's mean and the reference. */
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

/** A trained network without memory: normalised observations in, actions out. */
export class PolicyAgent implements Agent {
  private readonly layers: Layer[] = [];
  private readonly mean: Float32Array;
  private readonly scale: number[];

  constructor(private readonly card: PolicyCard, weights: Map<string, Float32Array>) {
    for (let k = 0; weights.has(`layers.${k}.weight`); k++) {
      this.layers.push({ weight: weights.get(`layers.${k}.weight`)!, bias: weights.get(`layers.${k}.bias`)! });
    }
    this.mean = weights.get("observation_mean")!;
    this.scale = Array.from(weights.get("observation_variance")!, (variance) => 1 / Math.sqrt(variance + FLOOR));
    if (weights.has("memory.bias") || this.mean.length !== card.observation.names.length) {
      throw new Error("The page reads policies without a memory only.");
    }
  }

  act(observation: ArrayLike<number>): number[] {
    let signal = this.scale.map((scale, k) => Math.min(Math.max((observation[k] - this.mean[k]) * scale, -LIMIT), LIMIT));
    this.layers.forEach(({ weight, bias }, k) => {
      const shape = k === this.layers.length - 1 ? OUTPUTS[this.card.output] : ACTIVATIONS[this.card.activation];
      signal = Array.from(bias, (value, row) => {
        let sum = value;
        for (let column = 0; column < signal.length; column++) sum += weight[row * signal.length + column] * signal[column];
        return shape(sum);
      });
    });
    return signal;
  }
}

const beside = (name: string) => new URL(name, document.baseURI);

/** The page's agents; none where their files are not beside the page, as in a notebook. */
export async function agentIndex(): Promise<AgentIndex> {
  const none = { agents: {}, references: {} };
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

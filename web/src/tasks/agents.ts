// Who walks a task: the visitor, the paper's fixed controller, and the policies that the package ships.

import type { Episode } from "./episode";

export interface Agent {
  name: string;
  act(episode: Episode): ArrayLike<number>;
}

/** The paper's controller: no action. */
export const FIXED: Agent = { name: "fixed", act: () => [0, 0] };

interface PolicyCard {
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
export function readSafetensors(file: ArrayBuffer): Map<string, Float32Array> {
  const size = Number(new DataView(file).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 8, size))) as Record<string, { dtype: string; data_offsets: [number, number] }>;
  const arrays = new Map<string, Float32Array>();
  for (const [name, { dtype, data_offsets }] of Object.entries(header)) {
    if (name === "__metadata__") continue;
    if (dtype !== "F32") throw new Error(`weight ${name} must be F32, got ${dtype}`);
    arrays.set(name, new Float32Array(file.slice(8 + size + data_offsets[0], 8 + size + data_offsets[1])));
  }
  return arrays;
}

/** A trained network: normalised observations in, actions out. */
export class PolicyAgent implements Agent {
  private readonly layers: Layer[] = [];
  private readonly mean: Float32Array;
  private readonly scale: number[];

  constructor(readonly name: string, private readonly card: PolicyCard, weights: Map<string, Float32Array>) {
    for (let k = 0; weights.has(`layers.${k}.weight`); k++) {
      this.layers.push({ weight: weights.get(`layers.${k}.weight`)!, bias: weights.get(`layers.${k}.bias`)! });
    }
    this.mean = weights.get("observation_mean")!;
    this.scale = Array.from(weights.get("observation_variance")!, (variance) => 1 / Math.sqrt(variance + FLOOR));
  }

  act(episode: Episode): number[] {
    return this.actions(episode.observation);
  }

  actions(observation: ArrayLike<number>): number[] {
    let signal = this.scale.map((scale, k) => Math.min(Math.max((observation[k] - this.mean[k]) * scale, -LIMIT), LIMIT));
    this.layers.forEach(({ weight, bias }, k) => {
      const last = k === this.layers.length - 1;
      const shape = (last ? OUTPUTS[this.card.output] : ACTIVATIONS[this.card.activation]);
      signal = Array.from(bias, (value, row) => {
        let sum = value;
        for (let column = 0; column < signal.length; column++) sum += weight[row * signal.length + column] * signal[column];
        return shape(sum);
      });
    });
    return signal;
  }
}

/** Which algorithms have trained a policy for each task, as built into the page. */
export async function shippedPolicies(): Promise<Record<string, string[]>> {
  const response = await fetch(new URL("agents/index.json", document.baseURI));
  return response.ok ? ((await response.json()) as Record<string, string[]>) : {};
}

export async function loadPolicy(task: string, algorithm: string): Promise<PolicyAgent> {
  const place = (ending: string) => new URL(`agents/${task}-${algorithm}.${ending}`, document.baseURI);
  const [card, weights] = await Promise.all([fetch(place("json")), fetch(place("safetensors"))]);
  if (!card.ok || !weights.ok) throw new Error(`the policy ${algorithm} of ${task} is not here`);
  return new PolicyAgent(algorithm, (await card.json()) as PolicyCard, readSafetensors(await weights.arrayBuffer()));
}

// What takes longer than a frame: finding gaits, and walking from every point of a plane of the section.

import { Kernel, type State } from "../kernel/kernel";
import { STATUS } from "../kernel/layout";
import { findCycle, type Cycle } from "./cycle";
import { findPassiveCycle } from "./passive_cycle";
import { bodyOf, type Parameters } from "./walker";
import type { Kind } from "./walk";

export interface CycleQuestion {
  what: "cycle";
  id: number;
  kind: Kind;
  parameters: Parameters;
  nearby: State | null;
}

export interface BasinQuestion {
  what: "basin";
  id: number;
  kind: Kind;
  parameters: Parameters;
  /** Section states to walk from, on the left foot. */
  states: State[];
  steps: number;
}

export type Question = CycleQuestion | BasinQuestion | { what: "stop"; id: number };

export interface CycleAnswer {
  what: "cycle";
  id: number;
  cycle: Cycle | null;
}

/** Of states `first` on: how many steps each went, and how it ended. */
export interface BasinAnswer {
  what: "basin";
  id: number;
  first: number;
  steps: number[];
  endings: number[];
  done: boolean;
}

export type Answer = CycleAnswer | BasinAnswer;

const kernel = Kernel.load();
const PATIENCE = 30; // ms between looks at what is asked
let current = 0;

const pause = () => new Promise((resolve) => setTimeout(resolve, 0));

function walked(kernel: Kernel, question: BasinQuestion, state: State): { steps: number; ending: number } {
  const { kind, parameters: p, steps } = question;
  if (kind === "steered") {
    const command = { inter_leg_angle: p.inter_leg_angle, mass_offset: p.mass_offset, previous_offset: p.mass_offset };
    const walk = kernel.walk(bodyOf(p), command, state, 1, steps);
    return { steps: walk.steps, ending: walk.last.status };
  }
  const body = bodyOf(kind === "planar" ? { ...p, hip_width: 0 } : p);
  const walk = kernel.passiveWalk(body, state, NaN, 1, steps);
  return { steps: walk.steps, ending: walk.last.status };
}

async function answerBasin(question: BasinQuestion): Promise<void> {
  const loaded = await kernel;
  const { id, states } = question;
  let first = 0;
  while (first < states.length && current === id) {
    const began = performance.now();
    const answer: BasinAnswer = { what: "basin", id, first, steps: [], endings: [], done: false };
    while (first < states.length && performance.now() - began < PATIENCE) {
      const { steps, ending } = walked(loaded, question, states[first++]);
      answer.steps.push(steps);
      answer.endings.push(ending === STATUS.STEPPED ? 0 : ending);
    }
    answer.done = first === states.length;
    postMessage(answer);
    await pause();
  }
}

self.onmessage = async ({ data }: MessageEvent<Question>) => {
  current = data.id;
  if (data.what === "stop") return;
  if (data.what === "basin") return void answerBasin(data);
  const loaded = await kernel;
  await pause();
  if (current !== data.id) return; // a newer question waits
  const { id, kind, parameters, nearby } = data;
  const cycle =
    kind === "steered"
      ? findCycle(loaded, parameters, nearby)
      : findPassiveCycle(loaded, parameters, kind === "planar", nearby);
  postMessage({ what: "cycle", id, cycle } satisfies CycleAnswer);
};

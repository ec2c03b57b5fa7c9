// Workers that find gaits and basins while the walker walks on.

import type { State } from "../kernel/kernel";
import type { Cycle } from "./cycle";
import type { Kind } from "./walk";
import type { Parameters } from "./walker";
import type { Answer, Question } from "./worker";

function newWorker(): Worker {
  return new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
}

let lastId = 0;

/** Finds gaits, one at a time; of several questions only the last is answered. */
export class CycleFinder {
  private readonly worker = newWorker();

  constructor(private readonly onFound: (cycle: Cycle | null, parameters: Parameters) => void) {}

  ask(kind: Kind, parameters: Parameters, nearby: State | null): void {
    const id = ++lastId;
    const asked = { ...parameters };
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if (data.what === "cycle" && data.id === id) this.onFound(data.cycle, asked);
    };
    this.worker.postMessage({ what: "cycle", id, kind, parameters: asked, nearby } satisfies Question);
  }
}

/** Walks from many states; results come in as they are ready, in the order of the states. */
export class BasinFinder {
  private readonly workers: Worker[] = [];
  private id = 0;

  get count(): number {
    return Math.max(1, Math.min(4, (navigator.hardwareConcurrency || 2) - 1));
  }

  ask(
    kind: Kind, parameters: Parameters, states: State[], steps: number,
    onSome: (index: number[], endings: number[], steps: number[]) => void,
  ): void {
    while (this.workers.length < this.count) this.workers.push(newWorker());
    const id = ++lastId;
    this.id = id;
    this.workers.forEach((worker, k) => {
      const index = states.map((_, i) => i).filter((i) => i % this.workers.length === k);
      worker.onmessage = ({ data }: MessageEvent<Answer>) => {
        if (data.what !== "basin" || data.id !== this.id) return;
        onSome(index.slice(data.first, data.first + data.endings.length), data.endings, data.steps);
      };
      const share = index.map((i) => states[i]);
      worker.postMessage({ what: "basin", id, kind, parameters: { ...parameters }, states: share, steps } satisfies Question);
    });
  }

  stop(): void {
    const id = ++lastId;
    this.id = id;
    for (const worker of this.workers) worker.postMessage({ what: "stop", id } satisfies Question);
  }
}

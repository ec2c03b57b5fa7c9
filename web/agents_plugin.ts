import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import type { Plugin } from "vite";

interface Scores {
  seeds: number;
  means: Record<string, number>;
}

const json = (path: string) => JSON.parse(readFileSync(path, "utf-8"));
const folders = (path: string) => (existsSync(path) ? readdirSync(path, { withFileTypes: true }) : []).filter((each) => each.isDirectory()).map((each) => each.name).sort();

/** The names of a policy's weights. */
function weightNames(file: Buffer): string[] {
  return Object.keys(JSON.parse(file.subarray(8, 8 + Number(file.readBigUInt64LE(0))).toString()));
}

/** Means over all seeds of what each seed's evaluation.json reports. */
function scores(place: string, seeds: string[]): Scores {
  const values: Record<string, number[]> = {};
  for (const seed of seeds) {
    const file = join(place, seed, "evaluation.json");
    if (!existsSync(file)) continue;
    for (const { metric, mean } of json(file) as { metric: string; mean: number | null }[]) if (mean !== null) (values[metric] ??= []).push(mean);
  }
  return { seeds: seeds.length, means: Object.fromEntries(Object.entries(values).map(([name, each]) => [name, each.reduce((a, b) => a + b, 0) / each.length])) };
}

/** Puts the shipped policies beside the page: the first seed of each algorithm that needs no memory, and the scores of all seeds. */
export function agents(home: string, tasks: Record<string, { observation: string[] }>): Plugin {
  return {
    name: "agents",
    generateBundle() {
      const index: Record<string, Record<string, Scores>> = {};
      for (const task of Object.keys(tasks)) {
        for (const algorithm of folders(join(home, "trained", `${task}-v1`))) {
          const place = join(home, "trained", `${task}-v1`, algorithm);
          const seeds = folders(place).sort((a, b) => Number(a.slice(4)) - Number(b.slice(4)));
          const first = join(place, seeds[0] ?? "", "policy");
          if (!existsSync(`${first}.safetensors`)) continue;
          const [card, weights] = [readFileSync(`${first}.json`), readFileSync(`${first}.safetensors`)];
          const seen = JSON.parse(card.toString()).observation.names as string[];
          if (weightNames(weights).some((name) => name.startsWith("memory")) || seen.join() !== tasks[task].observation.join()) continue;
          if (weights.length > 400_000) continue;
          (index[task] ??= {})[algorithm] = scores(place, seeds);
          this.emitFile({ type: "asset", fileName: `agents/${task}-${algorithm}.json`, source: card });
          this.emitFile({ type: "asset", fileName: `agents/${task}-${algorithm}.safetensors`, source: weights });
        }
      }
      const references = join(home, "references.json");
      const found = existsSync(references) ? json(references) : {};
      this.emitFile({ type: "asset", fileName: "agents/index.json", source: JSON.stringify({ agents: index, references: found.tasks ?? found }) });
    },
  };
}

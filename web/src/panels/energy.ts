// Where the energy of every step comes from and where it goes.

import type { StepRecord } from "../physics/walk";
import { PALETTE } from "../scene/palette";
import { energy } from "../share/units";
import { h } from "../ui/dom";
import { Plot } from "../ui/plot";

const STEPS = 28;
const PARTS = [
  { name: "gravity", colour: PALETTE.command, sign: 1 },
  { name: "shift", colour: PALETTE.goal, sign: 1 },
  { name: "impact", colour: PALETTE.axis, sign: -1 },
  { name: "ankle", colour: PALETTE.reference, sign: -1 },
] as const;
const NAMES = { gravity: "given by gravity", shift: "by moving the masses", impact: "lost at heel strike", ankle: "into the ankle" };

export class EnergyPanel {
  private readonly plot = new Plot(2.1, "Energy given and lost in each of the last steps");
  private readonly legend = h("ul", { class: "legend" });
  readonly element = h("div", {}, this.plot.canvas, this.legend);

  show(records: StepRecord[]): void {
    const steps = records.filter((record) => !record.fall).slice(-STEPS);
    const last = steps.at(-1);
    this.legend.replaceChildren(
      ...PARTS.map(({ name, colour }) =>
        h("li", {}, h("span", { class: "mark", style: `background:${colour}` }), NAMES[name], h("b", {}, last ? energy(last.energy[name]) : "–")),
      ),
    );
    const { plot } = this;
    if (!plot.begin()) return;
    const sums = steps.flatMap((step) => [
      Math.max(step.energy.gravity, 0) + Math.max(step.energy.shift, 0),
      Math.max(step.energy.impact, 0) + Math.max(step.energy.ankle, 0),
    ]);
    const reach = 1000 * Math.max(0.002, 1.15 * Math.max(...sums, 0));
    const from = (last?.index ?? 0) - STEPS + 1;
    plot.x = { low: Math.max(from, 0) - 0.6, high: Math.max(from, 0) + STEPS - 0.4 };
    plot.y = { low: -reach, high: reach };
    plot.axes("step", "10⁻³ weight · leg");
    const { pen } = plot;
    for (const step of steps) {
      const base = { up: 0, down: 0 };
      for (const { name, colour, sign } of PARTS) {
        const value = 1000 * sign * step.energy[name];
        const side = value >= 0 ? "up" : "down";
        const [y1, y2] = [plot.py(base[side]), plot.py(base[side] + value)];
        base[side] += value;
        pen.fillStyle = colour;
        pen.fillRect(plot.px(step.index - 0.38), Math.min(y1, y2), plot.px(0.76) - plot.px(0), Math.abs(y2 - y1));
      }
    }
  }
}

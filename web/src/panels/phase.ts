// The motion as a curve in the plane of an angle and its rate, and the map from one heel strike to the next.

import type { State } from "../kernel/kernel";
import type { Cycle } from "../physics/cycle";
import type { StepRecord } from "../physics/walk";
import { MIRROR } from "../physics/walker";
import { PALETTE } from "../scene/palette";
import { h } from "../ui/dom";
import { Plot, rangeOf, type Range } from "../ui/plot";

const CURVES = 24;

export class PhasePanel {
  private readonly plot = new Plot(1.5, "Phase plot of an angle and its rate during the last steps");
  private readonly choice = h(
    "select", { "aria-label": "Coordinate of the phase plot", onchange: () => this.rescale() },
    h("option", { value: "1" }, "ankle angle (lean)"),
    h("option", { value: "0" }, "stance pitch"),
  );
  readonly element = h("div", {}, this.choice, this.plot.canvas);
  private steps: { side: number; rows: number[][] }[] = [];
  private ranges: [Range | undefined, Range | undefined] = [undefined, undefined];

  clear(): void {
    this.steps = [];
    this.rescale();
  }

  add(side: number, rows: number[][]): void {
    this.steps.push({ side, rows });
    if (this.steps.length > CURVES) this.steps.shift();
  }

  private rescale(): void {
    this.ranges = [undefined, undefined];
    this.draw(1);
  }

  /** `share`: of the last step that has been walked. */
  draw(share: number): void {
    const { plot } = this;
    if (!plot.begin()) return;
    const column = Number(this.choice.value);
    const all = this.steps.flatMap((step) => step.rows);
    this.ranges = [
      rangeOf(all.map((row) => row[column]), 0.02, this.ranges[0]),
      rangeOf(all.map((row) => row[column + 2]), 0.02, this.ranges[1]),
    ];
    [plot.x, plot.y] = this.ranges as [Range, Range];
    plot.axes("angle, rad", "rate");
    plot.clipped(() => {
      this.steps.forEach(({ side, rows }, k) => {
        const isLast = k === this.steps.length - 1;
        const shown = isLast ? rows.slice(0, Math.max(Math.ceil(share * rows.length), 1)) : rows;
        const points = shown.map((row) => [row[column], row[column + 2]]);
        const age = this.steps.length - k;
        plot.line(points, side === 1 ? PALETTE.left : PALETTE.right, isLast ? 2.2 : 1.3, Math.max(0.9 - 0.06 * age, 0.12));
        const end = points.at(-1);
        if (isLast && end) plot.dot(end[0], end[1], 4, side === 1 ? PALETTE.left : PALETTE.right);
      });
    });
  }
}

const CHOICES = [
  [2, "ankle angle"], [4, "ankle rate"], [1, "stance pitch"], [3, "stance pitch rate"], [0, "heading"],
] as const; // prettier-ignore

export class ReturnMapPanel {
  private readonly plot = new Plot(1.15, "Return map: a coordinate after one heel strike against its value after the next");
  private readonly choice = h(
    "select", { "aria-label": "Coordinate of the return map", onchange: () => this.draw() },
    ...CHOICES.map(([index, name]) => h("option", { value: index }, name)),
  );
  readonly element = h(
    "div", {}, this.choice, this.plot.canvas,
    h("p", { class: "note" }, "One point for every step: left to right what a heel strike left, upwards what the next one left (mirrored to the same foot). The gait is where the points meet the diagonal."),
  );
  private pairs: { from: State; to: State }[] = [];
  private cycle: Cycle | null = null;

  clear(): void {
    this.pairs = [];
    this.draw();
  }

  setCycle(cycle: Cycle | null): void {
    this.cycle = cycle;
    this.draw();
  }

  add(record: StepRecord): void {
    if (record.fall) return;
    // A coordinate of the right foot's step is shown as its mirror image
    const [a, b] = [record.side, -record.side];
    const turned = (state: State, side: number) => state.map((value, k) => (side === 1 ? value : MIRROR[k] * value));
    this.pairs.push({ from: turned(record.state, a), to: turned(record.after, b) });
    if (this.pairs.length > 400) this.pairs.shift();
  }

  draw(): void {
    const { plot } = this;
    if (!plot.begin()) return;
    const k = Number(this.choice.value);
    const fixed = this.cycle?.state[k];
    const values = this.pairs.flatMap(({ from, to }) => [from[k], to[k]]);
    if (fixed !== undefined) values.push(fixed);
    const range = rangeOf(values, 0.01);
    [plot.x, plot.y] = [range, range];
    plot.axes("after a heel strike", "after the next");
    plot.clipped(() => {
      plot.line([[range.low, range.low], [range.high, range.high]], PALETTE.ink, 1, 0.4);
      const web = this.pairs.slice(-24).flatMap(({ from, to }) => [[from[k], to[k]], [to[k], to[k]]]);
      plot.line(web, PALETTE.reference, 1, 0.45);
      this.pairs.forEach(({ from, to }, i) => {
        const age = this.pairs.length - i;
        plot.dot(from[k], to[k], age === 1 ? 4.5 : 2.6, age === 1 ? PALETTE.axis : PALETTE.ink, Math.max(1 - 0.012 * age, 0.2));
      });
      if (fixed !== undefined) {
        plot.pen.strokeStyle = PALETTE.command;
        plot.pen.lineWidth = 2;
        plot.pen.beginPath();
        plot.pen.arc(plot.px(fixed), plot.py(fixed), 7, 0, 2 * Math.PI);
        plot.pen.stroke();
      }
    });
  }
}

// Eigenvalues of a linear vehicle over its speed; a click chooses the speed.

import type { Complex } from "../physics/linalg";
import { PALETTE } from "../scene/palette";
import { h } from "../ui/dom";
import { Plot } from "../ui/plot";

export const MODE_COLOURS: Record<string, string> = {
  weave: PALETTE.left,
  capsize: PALETTE.axis,
  caster: PALETTE.command,
  lean: PALETTE.left,
};

export interface Curves {
  speeds: number[];
  branches: { name: string; values: Complex[] }[];
  /** Ranges of speeds in which nothing grows. */
  stable: [number, number][];
}

export class EigenvaluesPanel {
  private readonly plot = new Plot(1.2, "Real and imaginary parts of the eigenvalues over the speed");
  private readonly legend = h("ul", { class: "legend" });
  readonly element = h("div", {}, this.plot.canvas, this.legend,
    h("p", { class: "note" }, "Solid: growth rate (below zero dies out). Thin: frequency of an oscillation. The shaded speeds are stable. Click to ride at a speed."));
  private curves: Curves | null = null;
  private speed = 0;
  onPick: (speed: number) => void = () => {};

  constructor(private readonly reach: number) {
    this.plot.canvas.classList.add("pickable");
    this.plot.canvas.addEventListener("click", (event) => this.onPick(Math.max(this.plot.inverse(event.offsetX, event.offsetY)[0], 0)));
  }

  show(curves: Curves | null, speed: number): void {
    this.curves = curves;
    this.speed = speed;
    const names = [...new Set(curves?.branches.map((branch) => branch.name) ?? [])];
    this.legend.replaceChildren(...names.map((name) => h("li", {}, h("span", { class: "mark", style: `background:${MODE_COLOURS[name]}` }), name)));
    this.draw();
  }

  draw(): void {
    const { plot, curves } = this;
    if (!curves || !plot.begin()) return;
    plot.x = { low: 0, high: curves.speeds.at(-1)! };
    plot.y = { low: -this.reach, high: this.reach };
    const { top, height } = plot.inner;
    for (const [low, high] of curves.stable) {
      plot.pen.fillStyle = "rgba(22, 142, 104, 0.13)";
      plot.pen.fillRect(plot.px(low), top, plot.px(Math.min(high, plot.x.high)) - plot.px(low), height);
    }
    plot.axes("speed, m/s", "1/s");
    plot.clipped(() => {
      for (const { name, values } of curves.branches) {
        const colour = MODE_COLOURS[name];
        plot.line(curves.speeds.map((speed, k) => [speed, values[k].re]), colour, 2.2);
        plot.line(curves.speeds.map((speed, k) => [speed, values[k].im > 0 ? values[k].im : NaN]), colour, 1, 0.6);
      }
      plot.line([[this.speed, -99], [this.speed, 99]], PALETTE.ink, 1.4, 0.7);
    });
  }
}

/** Angles over the last seconds. */
export class HistoryPanel {
  private readonly plot = new Plot(2, "Lean and steer over the last seconds");
  readonly element: HTMLElement;
  private points: number[][] = [];

  constructor(names: string[], private readonly colours: string[], private readonly duration = 8) {
    const legend = names.map((name, k) => h("li", {}, h("span", { class: "mark", style: `background:${colours[k]}` }), name));
    this.element = h("div", {}, this.plot.canvas, h("ul", { class: "legend" }, ...legend));
  }

  clear(): void {
    this.points = [];
  }

  add(time: number, values: number[]): void {
    this.points.push([time, ...values.map((value) => (value * 180) / Math.PI)]);
    while (this.points.length && this.points[0][0] < time - this.duration) this.points.shift();
  }

  draw(): void {
    const { plot } = this;
    if (!plot.begin()) return;
    const last = this.points.at(-1)?.[0] ?? 0;
    const largest = Math.max(2, ...this.points.flatMap((point) => point.slice(1).map(Math.abs)));
    plot.x = { low: Math.max(last, this.duration) - this.duration, high: Math.max(last, this.duration) };
    plot.y = { low: -1.1 * Math.min(largest, 60), high: 1.1 * Math.min(largest, 60) };
    plot.axes("time, s", "degrees");
    plot.clipped(() => this.colours.forEach((colour, k) => plot.line(this.points.map((point) => [point[0], point[k + 1]]), colour, 1.8)));
  }
}

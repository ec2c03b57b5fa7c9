// The gait's multipliers in the unit circle, with the names of their modes.

import type { Cycle, Mode } from "../physics/cycle";
import { PALETTE } from "../scene/palette";
import { h } from "../ui/dom";
import { number, Plot } from "../ui/plot";

const COLOURS = { "fore-aft": PALETTE.command, "three-dimensional": PALETTE.axis } as const;
const ROOM = { left: 8, right: 8, top: 8, bottom: 8 };

export class MultipliersPanel {
  private readonly plot = new Plot(1.25, "The gait's multipliers in the complex plane, with the unit circle", ROOM);
  private readonly rows = h("tbody");
  readonly element = h(
    "div", {},
    this.plot.canvas,
    h("table", { class: "modes" }, h("caption", { class: "hidden" }, "Multipliers of the gait over two steps"),
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "mode"), h("th", { scope: "col" }, "multiplier"), h("th", { scope: "col" }, "size"))),
      this.rows),
    h("p", { class: "note" },
      "A small disturbance is multiplied by these in every stride (two steps). All inside the circle: it dies out, the gait is stable."),
  );
  private trail: Mode[][] = [];

  show(cycle: Cycle | null): void {
    if (cycle) {
      this.trail.push(cycle.modes);
      if (this.trail.length > 60) this.trail.shift();
    } else {
      this.trail = [];
    }
    this.rows.replaceChildren(...(cycle ? cycle.modes.map(row) : [h("tr", {}, h("td", { colspan: 3 }, "no gait here"))]));
    this.draw();
  }

  draw(): void {
    const { plot } = this;
    if (!plot.begin()) return;
    const last = this.trail.at(-1);
    const largest = Math.max(1, ...(last ?? []).map((mode) => mode.magnitude));
    const reach = 1.12 * Math.min(largest, 3);
    [plot.x, plot.y] = [{ low: -reach * 1.25, high: reach * 1.25 }, { low: -reach, high: reach }];
    const circle = Array.from({ length: 181 }, (_, k) => [Math.cos((k * Math.PI) / 90), Math.sin((k * Math.PI) / 90)]);
    const { pen } = plot;
    pen.beginPath();
    circle.forEach(([x, y]) => pen.lineTo(plot.px(x), plot.py(y)));
    pen.fillStyle = "rgba(22, 142, 104, 0.07)";
    pen.fill();
    plot.line([[-9, 0], [9, 0]], PALETTE.ink, 1, 0.16);
    plot.line([[0, -9], [0, 9]], PALETTE.ink, 1, 0.16);
    plot.line(circle, PALETTE.ink, 1.4, 0.75);
    this.trail.slice(0, -1).forEach((modes, k) => {
      for (const mode of modes) plot.dot(mode.value.re, mode.value.im, 1.6, COLOURS[mode.name], 0.08 + (0.3 * k) / this.trail.length);
    });
    for (const mode of last ?? []) {
      plot.dot(mode.value.re, mode.value.im, 6.5, "#ffffff");
      plot.dot(mode.value.re, mode.value.im, 5, COLOURS[mode.name]);
    }
  }
}

function row(mode: Mode): HTMLTableRowElement {
  const { re, im } = mode.value;
  const text = im === 0 ? number(re, 4) : `${number(re, 4)} ${im > 0 ? "+" : "−"} ${number(Math.abs(im), 4)} i`;
  return h(
    "tr", { class: mode.magnitude < 1 ? "" : "outside", "data-re": re, "data-im": im },
    h("td", {}, h("span", { class: "mark", style: `background:${COLOURS[mode.name]}` }), mode.name),
    h("td", { class: "num" }, text),
    h("td", { class: "num" }, number(mode.magnitude, 4)),
  );
}

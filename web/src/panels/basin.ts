// The basin of attraction: a walk from every point of a plane of the section through the gait, as a picture that fills in.

import type { State } from "../kernel/kernel";
import { STATUS } from "../kernel/layout";
import type { Cycle } from "../physics/cycle";
import { BasinFinder } from "../physics/finder";
import { fallOf, type Parameters } from "../physics/walker";
import type { Kind } from "../physics/walk";
import { PALETTE } from "../scene/palette";
import { h } from "../ui/dom";
import { Plot } from "../ui/plot";

const SIZE = 64;
const STEPS = 40;
const AXES = [
  { name: "ankle angle and ankle rate", x: 2, y: 4, reach: [0.34, 1.0] },
  { name: "stance pitch and its rate", x: 1, y: 3, reach: [0.3, 0.6] },
  { name: "ankle angle and stance pitch rate", x: 2, y: 3, reach: [0.34, 0.6] },
] as const; // prettier-ignore
const NAMES = ["heading", "stance pitch", "ankle angle", "stance pitch rate", "ankle rate"];
const COLOURS: Record<number, string> = {
  0: "#1a9a70",
  [STATUS.BACKWARD]: "#5b7db8",
  [STATUS.SIDEWAYS]: "#d67a43",
  [STATUS.TRIP]: "#b23a63",
  [STATUS.LIFT_OFF]: "#8c6eb4",
  [STATUS.SLIP]: "#8f8a5a",
  [STATUS.NO_STRIKE]: "#6f7077",
  [STATUS.FAILED]: "#000000",
};

/** The order in which points are walked from: coarse first, then ever finer. */
function order(size: number): number[] {
  const cells: number[] = [];
  for (let stride = size / 4; stride >= 1; stride /= 2) {
    for (let row = 0; row < size; row += stride) {
      for (let column = 0; column < size; column += stride) {
        const isNew = stride === size / 4 || row % (2 * stride) !== 0 || column % (2 * stride) !== 0;
        if (isNew) cells.push(row * size + column);
      }
    }
  }
  return cells;
}

const ORDER = order(SIZE);

export class BasinPanel {
  private readonly plot = new Plot(1.15, "Basin of attraction: colours tell how a walk from each point ends");
  private readonly finder = new BasinFinder();
  private readonly choice = h(
    "select", { "aria-label": "Plane of the basin", onchange: () => this.start() },
    ...AXES.map((axes, k) => h("option", { value: k }, axes.name)),
  );
  private readonly button = h("button", { type: "button", class: "small", onclick: () => this.start() }, "Fill in");
  private readonly progress = h("span", { class: "note", role: "status" });
  private readonly legend = h("ul", { class: "legend" });
  readonly element = h(
    "div", {},
    h("div", { class: "row" }, this.choice, this.button), this.plot.canvas, this.legend, this.progress,
    h("p", { class: "note" }, `From every point ${STEPS} exact steps are walked. Click a point to start the walk there.`),
  );
  private readonly cells = new Int8Array(SIZE * SIZE).fill(-1);
  private readonly blocks = new Int16Array(SIZE * SIZE);
  private count = 0;
  private question: { kind: Kind; parameters: Parameters; cycle: Cycle } | null = null;
  private filled: { cycle: Cycle; axes: (typeof AXES)[number] } | null = null;
  onPick: (state: State) => void = () => {};

  constructor() {
    this.plot.canvas.addEventListener("click", (event) => this.pick(event));
    this.plot.canvas.classList.add("pickable");
  }

  /** What would be walked from now on; a picture of another walker is taken away. */
  setCycle(kind: Kind, parameters: Parameters, cycle: Cycle | null): void {
    this.question = cycle && { kind, parameters: { ...parameters }, cycle };
    this.button.disabled = !cycle;
    if (this.filled) this.stop();
  }

  stop(): void {
    this.finder.stop();
    this.filled = null;
    this.cells.fill(-1);
    this.progress.textContent = this.question ? "Not filled in for this walker yet." : "There is no gait to disturb.";
    this.draw();
  }

  start(): void {
    if (!this.question) return;
    const { kind, parameters, cycle } = this.question;
    const axes = AXES[Number(this.choice.value)];
    this.filled = { cycle, axes };
    this.cells.fill(-1);
    this.count = 0;
    const states = ORDER.map((cell) => this.stateOf(cell, cycle, axes));
    const stride = (place: number) => (place < 16 ? 16 : place < 64 ? 8 : place < 256 ? 4 : place < 1024 ? 2 : 1) * (SIZE / 64);
    this.finder.ask(kind, parameters, states, STEPS, (index, endings) => {
      index.forEach((place, k) => {
        this.cells[ORDER[place]] = endings[k];
        this.blocks[ORDER[place]] = stride(place);
      });
      this.count += index.length;
      const done = this.count === ORDER.length;
      const survived = this.cells.reduce((sum, ending) => sum + (ending === 0 ? 1 : 0), 0);
      const share = ((100 * survived) / this.count).toFixed(0);
      this.progress.textContent = done
        ? `${ORDER.length} walks: ${share} % still walk after ${STEPS} steps.`
        : `${this.count} of ${ORDER.length} walks; ${share} % walk on.`;
      this.draw();
    });
    this.draw();
  }

  private stateOf(cell: number, cycle: Cycle, axes: (typeof AXES)[number]): State {
    const [row, column] = [Math.floor(cell / SIZE), cell % SIZE];
    const at = (k: number, reach: number) => ((k + 0.5) / SIZE - 0.5) * 2 * reach;
    const state = [...cycle.state];
    state[axes.x] += at(column, axes.reach[0]);
    state[axes.y] += at(row, axes.reach[1]);
    return state;
  }

  private pick(event: MouseEvent): void {
    if (!this.question) return;
    const axes = this.filled?.axes ?? AXES[Number(this.choice.value)];
    const [x, y] = this.plot.inverse(event.offsetX, event.offsetY);
    const state = [...this.question.cycle.state];
    state[axes.x] = x;
    state[axes.y] = y;
    this.onPick(state);
  }

  draw(): void {
    const { plot } = this;
    if (!plot.begin()) return;
    const cycle = this.filled?.cycle ?? this.question?.cycle;
    const axes = this.filled?.axes ?? AXES[Number(this.choice.value)];
    const middle = cycle ? [cycle.state[axes.x], cycle.state[axes.y]] : [0, 0];
    plot.x = { low: middle[0] - axes.reach[0], high: middle[0] + axes.reach[0] };
    plot.y = { low: middle[1] - axes.reach[1], high: middle[1] + axes.reach[1] };
    const { left, top, width, height } = plot.inner;
    const { pen } = plot;
    pen.fillStyle = "#efece5";
    pen.fillRect(left, top, width, height);
    plot.clipped(() => {
      const [w, hh] = [width / SIZE, height / SIZE];
      for (const cell of ORDER) {
        const ending = this.cells[cell];
        if (ending < 0) continue;
        const block = this.blocks[cell];
        pen.fillStyle = COLOURS[ending] ?? "#000000";
        pen.fillRect(left + (cell % SIZE) * w - 0.2, top + height - (Math.floor(cell / SIZE) + block) * hh - 0.2, w * block + 0.4, hh * block + 0.4);
      }
    });
    plot.axes(NAMES[axes.x], NAMES[axes.y]);
    if (cycle) {
      plot.dot(middle[0], middle[1], 5.5, "#ffffff");
      plot.dot(middle[0], middle[1], 3.8, PALETTE.ink);
    }
    const seen = [...new Set(this.cells)].filter((ending) => ending >= 0).sort();
    this.legend.replaceChildren(
      ...seen.map((ending) =>
        h("li", {}, h("span", { class: "mark", style: `background:${COLOURS[ending]}` }), ending === 0 ? "walks on" : fallOf(ending)!.name),
      ),
    );
  }
}

// The bar under the stage, the keys and the touch buttons.

import type { View } from "../scene/stage";
import { byId, h } from "./dom";

export interface Actions {
  play(): void;
  step(): void;
  reset(): void;
  push(strong: boolean): void;
  rate(value: number): void;
  view(view: View): void;
  names(shown: boolean): void;
  steer(direction: number): void;
  stride(direction: number): void;
}

const RATES = [0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1, 2];
const VIEWS: [View, string][] = [["free", "free view"], ["follow", "follow"], ["side", "side"], ["behind", "behind"], ["above", "above"]];

const ICONS = {
  play: '<path d="M7 5.5v13l11-6.5z"/>',
  pause: '<path d="M7 5h3.6v14H7zM13.4 5H17v14h-3.6z"/>',
  step: '<path d="M6 5.5v13l9-6.5zM16 5h2.6v14H16z"/>',
  reset: '<path d="M12 5V2L7 6.5 12 11V8a4.9 4.9 0 1 1-4.9 5H4.2A7.8 7.8 0 1 0 12 5z"/>',
  names: '<path d="M4 5h16v2.6h-6.6V19h-2.8V7.6H4z"/>',
  push: '<path d="M3 10.6h10V6.4l8 5.6-8 5.6v-4.2H3z"/>',
};

function icon(name: keyof typeof ICONS): HTMLElement {
  const span = h("span", { class: "icon", "aria-hidden": "true" });
  span.innerHTML = `<svg viewBox="0 0 24 24">${ICONS[name]}</svg>`;
  return span;
}

export class Transport {
  private readonly playButton: HTMLButtonElement;
  private readonly rateInput: HTMLInputElement;
  private readonly rateOutput: HTMLOutputElement;
  private readonly namesButton: HTMLButtonElement;
  private readonly stepButton: HTMLButtonElement;
  private readonly pushButton: HTMLButtonElement;
  private readonly viewMenu: HTMLSelectElement;
  private readonly held = new Set<string>();

  constructor(place: HTMLElement, stage: HTMLElement, private readonly actions: Actions) {
    const button = (name: keyof typeof ICONS, label: string, act: () => void, id: string) => {
      const element = h("button", { type: "button", id, "aria-label": label, title: label, onclick: act }, icon(name));
      // a click with the mouse leaves the keys to the walker
      element.addEventListener("pointerup", () => element.blur());
      return element;
    };
    this.playButton = button("pause", "Pause (P)", () => actions.play(), "play");
    const step = button("step", "To the next heel strike (.)", () => actions.step(), "step");
    const push = button("push", "Push (space)", () => actions.push(false), "push");
    this.rateInput = h("input", { type: "range", id: "rate", min: 0, max: RATES.length - 1, step: 1, value: RATES.indexOf(0.4), oninput: () => this.takeRate() });
    this.rateOutput = h("output", { for: "rate" });
    const view = h("select", { id: "camera", "aria-label": "Camera", onchange: () => actions.view(view.value as View) },
      ...VIEWS.map(([value, name]) => h("option", { value }, name)));
    const names = button("names", "Names of the parts (N)", () => this.toggleNames(), "names");
    this.namesButton = names;
    this.stepButton = step;
    this.pushButton = push;
    this.viewMenu = view;
    place.append(
      button("reset", "Start again (R)", () => actions.reset(), "reset"), this.playButton, step,
      h("span", { class: "rate" }, h("label", { for: "rate" }, "speed"), this.rateInput, this.rateOutput),
      push, names, view,
    );
    this.showRate(0.4);
    this.listen(stage);
    this.touch();
  }

  /** Only a walk has steps; not everything can be steered, or pushed. */
  setKind({ isWalk, isSteered, isPushed }: { isWalk: boolean; isSteered: boolean; isPushed: boolean }): void {
    byId("touch").classList.toggle("off", !isSteered);
    this.stepButton.hidden = !isWalk;
    this.pushButton.hidden = !isPushed;
  }

  showView(view: View): void {
    this.viewMenu.value = view;
  }

  private toggleNames(): void {
    const shown = this.namesButton.getAttribute("aria-pressed") !== "true";
    this.namesButton.setAttribute("aria-pressed", String(shown));
    this.actions.names(shown);
  }

  showPlaying(playing: boolean): void {
    this.playButton.replaceChildren(icon(playing ? "pause" : "play"));
    const label = playing ? "Pause (P)" : "Play (P)";
    this.playButton.setAttribute("aria-label", label);
    this.playButton.title = label;
  }

  showRate(rate: number): void {
    const nearest = RATES.reduce((best, each, k) => (Math.abs(each - rate) < Math.abs(RATES[best] - rate) ? k : best), 0);
    this.rateInput.value = String(nearest);
    this.rateOutput.textContent = `×${rate}`;
    this.rateInput.setAttribute("aria-valuetext", `${rate} of real time`);
  }

  private takeRate(): void {
    const rate = RATES[Number(this.rateInput.value)];
    this.showRate(rate);
    this.actions.rate(rate);
  }

  private listen(stage: HTMLElement): void {
    const isBusy = (target: EventTarget | null) =>
      target instanceof HTMLElement && target !== stage && target.closest("input, select, textarea, button, summary, a") !== null;
    window.addEventListener("keydown", (event) => {
      if (isBusy(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
      if (!this.press(event)) return;
      event.preventDefault();
    });
    window.addEventListener("keyup", (event) => {
      if (this.held.delete(event.key)) this.steerHeld();
    });
    window.addEventListener("blur", () => {
      this.held.clear();
      this.steerHeld();
    });
  }

  private press(event: KeyboardEvent): boolean {
    const { actions } = this;
    switch (event.key) {
      case "ArrowLeft":
      case "ArrowRight":
        this.held.add(event.key);
        this.steerHeld();
        return true;
      case "ArrowUp":
      case "ArrowDown":
        actions.stride(event.key === "ArrowUp" ? 1 : -1);
        return true;
      case " ":
        if (!event.repeat) actions.push(event.shiftKey);
        return true;
      case "r":
      case "R":
        actions.reset();
        return true;
      case "p":
      case "P":
        actions.play();
        return true;
      case ".":
        actions.step();
        return true;
      case "n":
      case "N":
        this.toggleNames();
        return true;
    }
    return false;
  }

  private steerHeld(): void {
    this.actions.steer((this.held.has("ArrowRight") ? 1 : 0) - (this.held.has("ArrowLeft") ? 1 : 0));
  }

  private touch(): void {
    byId("touch").hidden = !window.matchMedia("(pointer: coarse), (max-width: 640px)").matches;
    for (const [id, direction] of [["touch-left", -1], ["touch-right", 1]] as const) {
      const element = byId<HTMLButtonElement>(id);
      const release = () => this.actions.steer(0);
      element.addEventListener("pointerdown", (event) => {
        element.setPointerCapture(event.pointerId);
        this.actions.steer(direction);
      });
      element.addEventListener("pointerup", release);
      element.addEventListener("pointercancel", release);
      element.addEventListener("contextmenu", (event) => event.preventDefault());
    }
  }
}

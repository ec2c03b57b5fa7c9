// Names of a vehicle's parts, beside them on the stage.

import * as THREE from "three";
import type { Stage } from "./stage";
import { h } from "../ui/dom";

/** A name, and the place in the floor's frame that it is of. */
export type Name = [string, [number, number, number]];

const GAP = 26; // px between names one above the other
const AWAY = 84; // px from the middle of all places to where names begin

export class Labels {
  private readonly lines = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  private readonly words = new Map<string, HTMLElement>();
  private isShown = false;

  constructor(private readonly place: HTMLElement, private readonly stage: Stage) {
    place.append(this.lines);
    place.hidden = true;
  }

  get shown(): boolean {
    return this.isShown;
  }

  set shown(shown: boolean) {
    this.isShown = shown;
    this.place.hidden = !shown;
  }

  clear(): void {
    this.words.forEach((word) => word.remove());
    this.words.clear();
    this.lines.replaceChildren();
  }

  /** Put names beside their places as the camera sees them now. */
  update(names: Name[]): void {
    if (!this.isShown) return;
    const { clientWidth: width, clientHeight: height } = this.stage.canvas;
    const seen = names.map(([name, at]) => {
      const point = this.stage.world.localToWorld(new THREE.Vector3(...at)).project(this.stage.camera);
      return { name, x: (0.5 + 0.5 * point.x) * width, y: (0.5 - 0.5 * point.y) * height };
    });
    const middle = seen.reduce((sum, each) => sum + each.x, 0) / Math.max(seen.length, 1);
    const reach = Math.max(...seen.map((each) => Math.abs(each.x - middle))) + AWAY;
    this.lines.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.lines.replaceChildren();
    for (const side of [-1, 1]) {
      const mine = seen.filter((each) => (each.x < middle ? -1 : 1) === side).sort((a, b) => a.y - b.y);
      let lowest = -Infinity;
      for (const { name, x, y } of mine) {
        const top = Math.max(y - 14, lowest + GAP);
        lowest = top;
        const word = this.word(name);
        const room = word.offsetWidth + 6;
        const at = Math.min(Math.max(middle + side * reach, side < 0 ? room : 6), side < 0 ? width - 6 : width - room);
        word.style.transform = `translate(${side < 0 ? "-100%" : "0"}, -50%) translate(${at.toFixed(1)}px, ${top.toFixed(1)}px)`;
        this.draw(x, y, at - side * 2, top);
      }
    }
    for (const [name, word] of this.words) word.hidden = !names.some(([each]) => each === name);
  }

  private word(name: string): HTMLElement {
    let word = this.words.get(name);
    if (!word) {
      word = h("span", {}, name);
      this.words.set(name, word);
      this.place.append(word);
    }
    return word;
  }

  private draw(x1: number, y1: number, x2: number, y2: number): void {
    const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
    line.setAttribute("d", `M${x1.toFixed(1)} ${y1.toFixed(1)}L${x2.toFixed(1)} ${y2.toFixed(1)}`);
    const dot = document.createElementNS("http://www.w3.org/2000/svg", "circle");
    dot.setAttribute("cx", x1.toFixed(1));
    dot.setAttribute("cy", y1.toFixed(1));
    dot.setAttribute("r", "2.6");
    this.lines.append(line, dot);
  }
}

// Small plots on a canvas: axes, points, lines; sharp on every screen.

import { PALETTE } from "../scene/palette";
import { h } from "./dom";

export interface Range {
  low: number;
  high: number;
}

const MARGIN = { left: 44, right: 12, top: 10, bottom: 20 };
const FONT = '11px ui-sans-serif, system-ui, "Segoe UI", sans-serif';

export class Plot {
  readonly canvas: HTMLCanvasElement;
  readonly pen: CanvasRenderingContext2D;
  width = 0;
  height = 0;
  x: Range = { low: 0, high: 1 };
  y: Range = { low: 0, high: 1 };

  /** `aspect`: width over height; `description` is read out instead of the picture. */
  constructor(readonly aspect: number, description: string, private readonly margin = MARGIN) {
    this.canvas = h("canvas", { class: "plot", role: "img", "aria-label": description });
    this.canvas.style.aspectRatio = String(aspect);
    this.pen = this.canvas.getContext("2d")!;
  }

  /** Empty the canvas at its present size; false while it is not shown. */
  begin(): boolean {
    const width = this.canvas.clientWidth;
    if (!width) return false;
    const ratio = Math.min(window.devicePixelRatio, 3);
    const height = width / this.aspect;
    const [w, hh] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== hh) [this.canvas.width, this.canvas.height] = [w, hh];
    [this.width, this.height] = [width, height];
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.pen.font = FONT;
    this.pen.lineJoin = "round";
    return true;
  }

  px(x: number): number {
    const { left, right } = this.margin;
    return left + ((x - this.x.low) / (this.x.high - this.x.low)) * (this.width - left - right);
  }

  py(y: number): number {
    const { top, bottom } = this.margin;
    return this.height - bottom - ((y - this.y.low) / (this.y.high - this.y.low)) * (this.height - top - bottom);
  }

  /** What a place on the canvas (in CSS pixels) stands for. */
  inverse(px: number, py: number): [number, number] {
    const { left, right, top, bottom } = this.margin;
    return [
      this.x.low + ((px - left) / (this.width - left - right)) * (this.x.high - this.x.low),
      this.y.low + ((this.height - bottom - py) / (this.height - top - bottom)) * (this.y.high - this.y.low),
    ];
  }

  get inner(): { left: number; top: number; width: number; height: number } {
    const { left, right, top, bottom } = this.margin;
    return { left, top, width: this.width - left - right, height: this.height - top - bottom };
  }

  axes(xName: string, yName: string): void {
    const { pen } = this;
    const { left, top, width, height } = this.inner;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.fillStyle = PALETTE.faint;
    for (const tick of ticks(this.x, Math.max(width / 62, 2))) {
      const at = this.px(tick);
      this.rule(at, top, at, top + height, tick === 0 ? 0.3 : 0.09);
      pen.textAlign = "center";
      pen.fillText(label(tick), at, top + height + 9);
    }
    for (const tick of ticks(this.y, Math.max(height / 34, 2))) {
      const at = this.py(tick);
      this.rule(left, at, left + width, at, tick === 0 ? 0.3 : 0.09);
      pen.textAlign = "right";
      pen.fillText(label(tick), left - 5, at);
    }
    this.note(xName, left + width - 2, top + height - 9, "right");
    this.note(yName, left + 4, top + 9, "left");
  }

  /** Words on a ground that keeps lines away from them. */
  private note(words: string, x: number, y: number, align: "left" | "right"): void {
    const { pen } = this;
    const width = pen.measureText(words).width + 6;
    pen.fillStyle = "rgba(250, 249, 246, 0.85)";
    pen.fillRect(align === "left" ? x - 3 : x - width + 3, y - 8, width, 16);
    pen.fillStyle = PALETTE.faint;
    pen.textAlign = align;
    pen.fillText(words, x, y);
  }

  private rule(x1: number, y1: number, x2: number, y2: number, alpha: number): void {
    this.pen.strokeStyle = `rgba(43, 45, 52, ${alpha})`;
    this.pen.beginPath();
    this.pen.moveTo(x1, y1);
    this.pen.lineTo(x2, y2);
    this.pen.stroke();
  }

  line(points: ArrayLike<number>[], colour: string, width = 1.6, alpha = 1): void {
    const { pen } = this;
    pen.globalAlpha = alpha;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    let down = false;
    for (const point of points) {
      if (!Number.isFinite(point[0] + point[1])) {
        down = false;
        continue;
      }
      if (down) pen.lineTo(this.px(point[0]), this.py(point[1]));
      else pen.moveTo(this.px(point[0]), this.py(point[1]));
      down = true;
    }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  dot(x: number, y: number, radius: number, colour: string, alpha = 1): void {
    const { pen } = this;
    pen.globalAlpha = alpha;
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(this.px(x), this.py(y), radius, 0, 2 * Math.PI);
    pen.fill();
    pen.globalAlpha = 1;
  }

  clipped(draw: () => void): void {
    const { left, top, width, height } = this.inner;
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(left, top, width, height);
    this.pen.clip();
    draw();
    this.pen.restore();
  }
}

/** Round numbers within a range, about `count` of them. */
export function ticks({ low, high }: Range, count: number): number[] {
  const rough = (high - low) / count;
  if (!(rough > 0) || !Number.isFinite(rough)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5, 10].find((factor) => factor * power >= rough) ?? 10);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, k) => (first + k) * step);
}

function label(value: number): string {
  return String(Number(value.toPrecision(4))).replace("-", "−");
}

/** The range of some values with room around it, grown from `old` so that a picture does not jump. */
export function rangeOf(values: number[], least: number, old?: Range): Range {
  const finite = values.filter(Number.isFinite);
  if (!finite.length) return old ?? { low: -least, high: least };
  let low = Math.min(...finite);
  let high = Math.max(...finite);
  const middle = 0.5 * (low + high);
  const half = Math.max(0.58 * (high - low), 0.5 * least);
  [low, high] = [middle - half, middle + half];
  return old ? { low: Math.min(low, old.low), high: Math.max(high, old.high) } : { low, high };
}

export function number(value: number, digits = 3): string {
  return value.toFixed(digits).replace("-", "−");
}

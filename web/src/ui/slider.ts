import { h } from "./dom";

export interface SliderOptions {
  id: string;
  label: string;
  hint: string;
  low: number;
  high: number;
  step: number;
  value: number;
  /** The value in words; may change with the units. */
  show: (value: number) => string;
  onInput: (value: number) => void;
}

/** A labelled slider that shows its value, and takes numbers outside of its marks when they are set from elsewhere. */
export class Slider {
  readonly element: HTMLElement;
  private readonly input: HTMLInputElement;
  private readonly output: HTMLOutputElement;

  constructor(private readonly options: SliderOptions) {
    const { id, label, hint, low, high, step } = options;
    this.input = h("input", { type: "range", id, min: low, max: high, step, oninput: () => this.take() });
    this.output = h("output", { for: id });
    this.element = h(
      "div", { class: "slider", title: hint },
      h("label", { for: id }, label), this.output, this.input,
    );
    this.value = options.value;
  }

  private current = 0;

  get value(): number {
    return this.current;
  }

  /** Without telling the listener. */
  set value(value: number) {
    this.current = value;
    this.input.value = String(value);
    this.refresh();
  }

  refresh(): void {
    const text = this.options.show(this.current);
    this.output.textContent = text;
    this.input.setAttribute("aria-valuetext", text);
    const { low, high } = this.options;
    this.input.style.setProperty("--share", `${(100 * (Math.min(Math.max(this.current, low), high) - low)) / (high - low)}%`);
  }

  private take(): void {
    this.current = Number(this.input.value);
    this.refresh();
    this.options.onInput(this.current);
  }
}

// How long frames take: the time between them, and the time spent on each.

const KEPT = 240;
const SHOWN_EVERY = 30;

export class FrameTimes {
  private readonly between: number[] = [];
  private readonly work: number[] = [];
  private last = 0;
  private began = 0;
  private count = 0;

  constructor(private readonly element: HTMLElement) {}

  begin(): void {
    this.began = performance.now();
    if (this.last) keep(this.between, this.began - this.last);
    this.last = this.began;
  }

  end(): void {
    keep(this.work, performance.now() - this.began);
    if (++this.count % SHOWN_EVERY === 0) {
      const { between, work } = this.summary();
      this.element.textContent = `${(1000 / between).toFixed(0)} frames a second, ${work.toFixed(1)} ms of work in each`;
    }
  }

  /** Medians of the last frames, ms; and the time nine of ten stay under. */
  summary(): { between: number; work: number; work90: number; frames: number } {
    return { between: quantile(this.between, 0.5), work: quantile(this.work, 0.5), work90: quantile(this.work, 0.9), frames: this.count };
  }

  clear(): void {
    this.between.length = this.work.length = 0;
  }
}

function keep(values: number[], value: number): void {
  values.push(value);
  if (values.length > KEPT) values.shift();
}

function quantile(values: number[], share: number): number {
  if (!values.length) return 0;
  return [...values].sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
}

// What exhibits share: the kernel, the stage, the clock, and places on the page.

import type { Kernel } from "./kernel/kernel";
import type { Name } from "./scene/labels";
import type { Stage, View } from "./scene/stage";
import type { Settings } from "./share/link";

/** A tab of the page. */
export interface Exhibit {
  readonly id: string;
  readonly title: string;
  readonly subtitle: string;
  /** Whether it takes steps, one at a time. */
  readonly isWalk: boolean;
  /** Whether arrow keys to the left and right do anything. */
  readonly isSteered: boolean;
  /** Whether the visitor may push. */
  readonly isPushed: boolean;
  enter(settings: Settings): void;
  leave(): void;
  /** Let time pass, in units of the exhibit's model; zero while paused. `real`: seconds since the last frame. */
  frame(duration: number, real: number): void;
  /** Whether something on the stage moves even while time stands still. */
  readonly isMoving: boolean;
  reset(): void;
  push(strong: boolean): void;
  stepOnce(): void;
  /** Arrow keys: -1 left, +1 right, 0 released. */
  steer(direction: number): void;
  /** Arrow keys up and down: -1 shorter, +1 longer steps. */
  stride(direction: number): void;
  settings(): Settings;
  /** Units of the model's time that pass in a second at full speed. */
  timeScale(): number;
  /** Show numbers anew after the units have changed. */
  refresh(): void;
  resize(): void;
  /** Names of the parts on the stage, where they are now. */
  names(): Name[];
}

export interface App {
  kernel: Kernel;
  stage: Stage;
  panel: HTMLElement;
  hud: HTMLElement;
  /** Show words over the stage; nothing takes them away. */
  notice(content: Node | null): void;
  /** Settings have changed: keep them in the address. */
  changed(): void;
  play(playing: boolean): void;
  setRate(rate: number): void;
  setView(view: View): void;
}

// The walkers: a walk that goes on on the stage, sliders that change it, and what its dynamics looks like beside it.

import * as THREE from "three";
import type { App, Exhibit } from "../app";
import { BasinPanel } from "../panels/basin";
import { EnergyPanel } from "../panels/energy";
import { MultipliersPanel } from "../panels/multipliers";
import { PhasePanel, ReturnMapPanel } from "../panels/phase";
import { findCycle, type Cycle } from "../physics/cycle";
import { CycleFinder } from "../physics/finder";
import { passiveCycleNear } from "../physics/passive_cycle";
import { add } from "../physics/geometry";
import { Walk, type Kind, type StepRecord } from "../physics/walk";
import { mirrored, TABLE_1, type Parameters } from "../physics/walker";
import type { State } from "../kernel/kernel";
import type { Name } from "../scene/labels";
import { PushArrow } from "../scene/push_arrow";
import { StagedWalk } from "../scene/staged_walk";
import { asTable, parametersOf, type SavedWalk } from "../share/files";
import type { Settings } from "../share/link";
import * as units from "../share/units";
import { Facts, h, section } from "../ui/dom";
import { number } from "../ui/plot";
import { Slider } from "../ui/slider";

type Knobbed = Exclude<keyof Parameters, "slope_turns" | "more">;

interface Knob {
  name: Knobbed;
  label: string;
  hint: string;
  low: number;
  high: number;
  step: number;
  show: (value: number) => string;
}

const length = (value: number) => units.length(value);
const angle = (value: number) => units.angle(value);

const KNOBS: Record<Knobbed, Knob> = {
  hip_width: { name: "hip_width", label: "Hip width", hint: "Distance between the two hips, in leg lengths", low: 0, high: 0.7, step: 0.005, show: length },
  foot_radius: { name: "foot_radius", label: "Foot radius", hint: "Radius of the cylinder feet, in leg lengths", low: 0, high: 0.9, step: 0.005, show: length },
  ankle_tilt: { name: "ankle_tilt", label: "Ankle tilt", hint: "Angle of the ankle axis from the leg: small steers strongly, 90 degrees does not turn the foot", low: 0.05, high: Math.PI / 2, step: 0.005, show: angle },
  slope: { name: "slope", label: "Slope", hint: "Angle of the floor; the slope drives the walk", low: -0.01, high: 0.05, step: 0.0002, show: (value) => units.angle(value, 4) },
  inter_leg_angle: { name: "inter_leg_angle", label: "Inter-leg angle", hint: "Angle at which the swing leg is held in front: the stride", low: 0.1, high: 0.6, step: 0.005, show: angle },
  mass_offset: { name: "mass_offset", label: "Mass offset", hint: "Both hip masses moved along the axle, positive to the right: steers", low: -0.06, high: 0.06, step: 0.0005, show: (value) => units.length(value, 4) },
  ankle_stiffness: { name: "ankle_stiffness", label: "Ankle spring", hint: "Stiffness of a spring in the ankle, in weight times leg length per radian", low: 0, high: 0.5, step: 0.002, show: (value) => number(value, 3) },
  ankle_damping: { name: "ankle_damping", label: "Ankle damper", hint: "A damper in the ankle", low: 0, high: 0.3, step: 0.001, show: (value) => number(value, 3) },
};

interface Variety {
  id: string;
  title: string;
  subtitle: string;
  knobs: Knobbed[];
  defaults: Parameters;
  ranges: Partial<Record<Knobbed, [number, number, number]>>;
  /** How the start differs from the gait, as a start that is worth looking at: pitch rate, ankle rate. */
  nudge: [number, number];
  push: [number, number];
  presets: [string, Partial<Parameters>][];
  story: string;
  /** A state near the gait of the defaults. */
  guess: State;
}

const PASSIVE: Parameters = { ...TABLE_1, hip_width: 0, ankle_tilt: 0.15, slope: 0.00058 };

export const VARIETIES: Record<Kind, Variety> = {
  planar: {
    id: "plane",
    title: "In the plane",
    subtitle: "A passive walker that cannot fall sideways",
    knobs: ["foot_radius", "slope"],
    defaults: { ...PASSIVE, foot_radius: 0, slope: 0.009 },
    ranges: { slope: [0.0005, 0.02, 0.0001] },
    nudge: [0.001, 0],
    push: [0.002, 0],
    presets: [["Point feet", { foot_radius: 0, slope: 0.009 }], ["Round feet", { foot_radius: 0.5, slope: 0.004 }], ["Limping (steeper)", { foot_radius: 0, slope: 0.0165 }]],
    story: "No motor, no control: a slope gives the energy that every heel strike takes. Steeper than about 0.015 the gait doubles its period: it limps.",
    guess: [0, 0.2, 0, -0.2, 0, 0.016],
  },
  passive: {
    id: "space",
    title: "In space",
    subtitle: "A passive walker that leans, and steers as it leans",
    knobs: ["hip_width", "foot_radius", "ankle_tilt", "slope"],
    defaults: PASSIVE,
    ranges: { slope: [0.0002, 0.004, 0.00001], hip_width: [0, 0.1, 0.001], ankle_tilt: [0.05, 0.6, 0.001] },
    nudge: [0.0, 0.004],
    push: [0, 0.006],
    presets: [["Table 3 of the paper", {}], ["Steeper", { slope: 0.0012 }], ["With a hip", { hip_width: 0.01 }]],
    story: "In space the walker can fall sideways. Its ankle axis turns the foot as the leg leans. At small slopes it walks slowly, so the axis must stand steep; even then it is easily disturbed.",
    guess: [0, 0.1527, 0, -0.1205, 0, 0.003],
  },
  steered: {
    id: "steered",
    title: "Steered walker",
    subtitle: "The swing leg is held in front; moving the masses steers",
    knobs: ["hip_width", "foot_radius", "ankle_tilt", "slope", "inter_leg_angle", "mass_offset", "ankle_stiffness", "ankle_damping"],
    defaults: { ...TABLE_1 },
    ranges: {},
    nudge: [0, -0.07],
    push: [0, 0.13],
    presets: [["Table 1 of the paper", {}], ["No hip", { hip_width: 0 }], ["Flat feet, steep", { foot_radius: 0.2, slope: 0.03 }], ["In circles", { mass_offset: 0.03, slope_turns: true }]],
    story: "Whatever leans must turn into its fall. The tilted ankle axes see to that: as a leg leans, its foot turns. Above a critical speed that is enough to stay up.",
    guess: [0.0015, 0.1554, -0.0041, -0.4151, -0.0702],
  },
};

/** While an arrow key is held the masses are this far to the side. */
const STEER_OFFSET = 0.045;
const STRIDE_CHANGE = 0.02;
const COMPANY_GAP = 0.85;
/** Scale of the stage for so many walkers side by side. */
const SCALES: Record<number, number> = { 1: 1, 2: 1.2, 4: 1.6, 8: 2.3 };
const TINTS = ["", "#168e68", "#8c6eb4", "#be265c", "#b98a12", "#3b8ea5", "#7a5c45", "#5c5e66"];

/** A part of the guided tour. */
interface Lesson {
  title: string;
  words: string;
  button: string;
  change: Partial<Parameters>;
}

const TOUR: Lesson[] = [
  {
    title: "Why does it stand?",
    words: "It stands because it steers. Follow the ankle axes (magenta): when the walker leans to the left, its foot turns to the left and carries the floor's support back under it. Now take that away, in three clicks.",
    button: "1. Lay the ankle axes level (90°)",
    change: { ankle_tilt: Math.PI / 2 },
  },
  {
    title: "The feet hardly turn now",
    words: "Level axes let the legs lean without turning the feet. It still walks, but see the multipliers: the pair in the circle has moved far out, towards its rim. Speed is what saves it.",
    button: "2. Take the speed away (less slope)",
    change: { slope: 0.004 },
  },
  {
    title: "Slower than its critical speed",
    words: "Less slope, less speed. No gait is left: each step leans more than the last. It takes a while, though.",
    button: "3. Give it wide hips, to see it at once",
    change: { hip_width: 0.5 },
  },
  {
    title: "It falls",
    words: "Wide hips throw it from side to side, and there is not enough steering to catch it. Put the tilt back and it walks again: stability here is nothing but lean turned into yaw, and speed.",
    button: "Put everything back",
    change: { ...TABLE_1 },
  },
];

export class WalkExhibit implements Exhibit {
  readonly isWalk = true;
  readonly isPushed = true;
  readonly isSteered: boolean;
  readonly id: string;
  readonly title: string;
  readonly subtitle: string;
  readonly parameters: Parameters;
  private readonly variety: Variety;
  private readonly sliders = new Map<Knobbed, Slider>();
  private readonly multipliers = new MultipliersPanel();
  private readonly energyPanel = new EnergyPanel();
  private readonly phase = new PhasePanel();
  private readonly returnMap = new ReturnMapPanel();
  private readonly basin = new BasinPanel();
  private readonly facts = new Facts();
  private readonly badge = h("p", { class: "badge", role: "status", id: "verdict" });
  private readonly turns = h("input", { type: "checkbox", id: "slope-turns", onchange: () => this.change({ slope_turns: this.turns.checked }) });
  private readonly finder: CycleFinder;
  private readonly arrow = new PushArrow();
  private readonly tour = h("div", { class: "tour" });
  private panels: Node[] = [];
  private company: StagedWalk[] = [];
  private cycle: Cycle | null = null;
  private lastGait: State;
  private steering = 0;
  private latched = 0;
  private pushes = { pitchRate: 0, ankleRate: 0, direction: 1 };
  private companions = 1;
  private isHere = false;
  private sinceDrawn = 1;
  private aside = 0;
  private replay: SavedWalk | null = null;
  /** Whether the walk is to start anew once the gait is found. */
  private awaited = false;

  constructor(private readonly app: App, readonly kind: Kind) {
    this.variety = VARIETIES[kind];
    this.isSteered = kind === "steered";
    this.id = this.variety.id;
    this.title = this.variety.title;
    this.subtitle = this.variety.subtitle;
    this.parameters = { ...this.variety.defaults };
    this.finder = new CycleFinder((cycle, parameters) => this.found(cycle, parameters));
    this.lastGait = this.variety.guess;
    this.basin.onPick = (state) => this.start(state);
  }

  get walk(): Walk {
    return this.company[0].walk;
  }

  enter(settings: Settings): void {
    this.isHere = true;
    for (const name of this.variety.knobs) {
      const value = Number(settings[name]);
      if (settings[name] !== undefined && Number.isFinite(value)) this.parameters[name] = value;
    }
    if (settings.slope_turns !== undefined) this.parameters.slope_turns = settings.slope_turns === "1";
    if (!this.panels.length) this.panels = this.build();
    this.app.panel.replaceChildren(...this.panels);
    this.showParameters();
    this.app.stage.world.add(this.arrow.mesh);
    this.app.stage.floor.setLines(1, !this.parameters.slope_turns);
    this.app.stage.setScale(SCALES[this.companions]);
    if (this.cycle) this.seek();
    else this.found(this.soon(), this.parameters);
    this.awaited = !this.cycle;
    if (!this.cycle) this.seek();
    this.start();
    this.drawPlots();
  }

  leave(): void {
    this.isHere = false;
    this.app.stage.setScale(1);
    this.basin.stop();
    this.arrow.mesh.removeFromParent();
    this.company.forEach((staged) => staged.dispose());
    this.company = [];
  }

  settings(): Settings {
    const settings: Settings = {};
    for (const name of this.variety.knobs) {
      if (this.parameters[name] !== this.variety.defaults[name]) settings[name] = String(this.parameters[name]);
    }
    if (this.parameters.slope_turns) settings.slope_turns = "1";
    return settings;
  }

  get isMoving(): boolean {
    return this.arrow.isShown;
  }

  timeScale(): number {
    return 1 / units.timeUnit();
  }

  // The walk

  reset(): void {
    this.replay = null;
    delete this.parameters.more;
    this.start();
  }

  /** Start the walk, by default near the gait. */
  start(from?: State): void {
    const [pitchRate, ankleRate] = this.variety.nudge;
    const state = [...(from ?? this.cycle?.state ?? this.lastGait)];
    if (!from) {
      state[3] += pitchRate;
      state[4] += ankleRate;
    }
    this.company.forEach((staged) => staged.dispose());
    this.company = Array.from({ length: this.replay ? 1 : this.companions }, (_, k) => this.companion(state, k));
    this.pushes = { pitchRate: 0, ankleRate: 0, direction: 1 };
    this.phase.clear();
    this.returnMap.clear();
    this.app.notice(null);
    this.app.stage.setSlope(this.parameters.slope);
    this.company.forEach((staged) => this.begun(staged));
    this.place(0, true);
    this.drawPlots();
  }

  private companion(gait: State, k: number): StagedWalk {
    const tint = TINTS[k % TINTS.length];
    const lane = (k % 2 ? 1 : -1) * Math.ceil(k / 2) * COMPANY_GAP;
    // the others are disturbed one way and the other, ever more
    const state = [...gait];
    state[3] += 0.6 * k * this.variety.nudge[0];
    state[4] += (k % 2 ? -0.6 : 0.6) * k * this.variety.nudge[1];
    const walk = this.replay
      ? this.replayed(this.replay)
      : new Walk(this.app.kernel, this.kind, { state, contact: [0, lane], offset: this.parameters.mass_offset }, () => this.order(k));
    const staged = new StagedWalk(walk, this.app.stage, tint);
    walk.onStep = (record) => {
      if (k === 0) this.stepped(record);
      this.begun(staged);
    };
    walk.onFall = (record) => {
      if (k === 0) this.fell(record);
    };
    return staged;
  }

  private replayed(saved: SavedWalk): Walk {
    let k = -1;
    const side = saved.stances[0] === "left" ? 1 : -1;
    return new Walk(this.app.kernel, this.kind, { state: saved.states[0], side, offset: saved.mass_offsets[0] }, () => {
      k++;
      const last = Math.min(k, saved.inter_leg_angles.length - 1);
      const command = { inter_leg_angle: saved.inter_leg_angles[last], mass_offset: saved.commanded_offsets[last] };
      return { parameters: { ...this.parameters, ...command }, state: saved.states[k] };
    });
  }

  private begun(staged: StagedWalk): void {
    staged.begin();
    const { walk } = staged;
    if (walk === this.company[0]?.walk) this.phase.add(walk.current.side, walk.phase());
  }

  private order(k: number) {
    const steer = this.steering || this.latched;
    const parameters = { ...this.parameters, mass_offset: this.parameters.mass_offset + STEER_OFFSET * steer };
    if (k === 0) this.latched = 0;
    const { pitchRate, ankleRate } = this.pushes;
    if (k === 0) {
      if (pitchRate || ankleRate) this.pushes.direction *= -1;
      [this.pushes.pitchRate, this.pushes.ankleRate] = [0, 0];
    }
    return { parameters, push: { pitchRate, ankleRate } };
  }

  frame(duration: number, real: number): void {
    if (!this.company.length) return;
    // companions first: the first walker's order clears pushes for all
    for (const { walk } of [...this.company].reverse()) walk.advance(duration);
    this.place(real, false);
    this.arrow.advance(real);
    this.sinceDrawn += real;
    if (duration > 0 && this.sinceDrawn > 0.06) {
      this.sinceDrawn = 0;
      this.phase.draw(this.walk.share);
      this.showHud();
    }
  }

  private place(real: number, jump: boolean): void {
    for (const staged of this.company) staged.place();
    const { centre } = this.company[0].shape();
    // what is looked at goes along without swaying from foot to foot
    const sway = jump ? 1 : 1 - Math.exp(-real / 0.4);
    this.aside += sway * (centre[2] - this.aside);
    this.app.stage.follow(new THREE.Vector3(centre[0], 0.5, this.aside), this.walk.current.state[0], real, jump);
    this.arrow.place(centre, this.walk.current.state[0]);
  }

  private stepped(record: StepRecord): void {
    if (this.replay && this.walk.records.length === this.replay.inter_leg_angles.length) this.ended(this.replay);
    this.returnMap.add(record);
    if (this.app.stage.world.rotation.z !== -this.parameters.slope) this.app.stage.setSlope(this.parameters.slope);
    this.drawSteps();
  }

  private fell(record: StepRecord): void {
    this.drawSteps();
    this.showHud();
    const { fall } = record;
    this.app.notice(
      h("div", { class: "card fall", id: "fall" },
        h("strong", {}, `It fell: ${fall!.name}`), h("span", {}, ` after ${record.index} steps. `), h("p", {}, fall!.why),
        h("button", { type: "button", onclick: () => this.reset() }, "Start again (R)")),
    );
  }

  /** The saved walk is over: the next steps would be the page's own. */
  private ended(saved: SavedWalk): void {
    this.app.play(false);
    const again = () => {
      this.open(saved);
      this.app.play(true);
    };
    this.app.notice(
      h("div", { class: "card", id: "ended" }, h("strong", {}, "The saved walk ends here. "),
        h("p", {}, "Played on, the walker goes on with its last command."),
        h("div", { class: "row" }, h("button", { type: "button", onclick: again }, "From the start"), h("button", { type: "button", onclick: () => this.reset() }, "Leave it (R)"))),
    );
  }

  push(strong: boolean): void {
    const [pitchRate, ankleRate] = this.variety.push;
    const factor = (strong ? 2.5 : 1) * this.pushes.direction;
    this.pushes.pitchRate += pitchRate * factor;
    this.pushes.ankleRate += ankleRate * factor;
    // a leg that leans faster about its ankle axis goes to the right; a pitch that falls more slowly is a push from ahead
    const [right, ahead] = ankleRate ? [factor, 0] : [0, -factor];
    this.arrow.show(right, ahead, Math.abs(factor));
  }

  steer(direction: number): void {
    this.steering = direction;
    if (direction) this.latched = direction;
    this.showHud();
  }

  stride(direction: number): void {
    if (this.kind !== "steered") return;
    const { low, high } = KNOBS.inter_leg_angle;
    const value = Math.min(Math.max(this.parameters.inter_leg_angle + STRIDE_CHANGE * direction, low), high);
    this.change({ inter_leg_angle: Number(value.toFixed(4)) });
  }

  stepOnce(): void {
    this.app.play(false);
    for (const { walk } of [...this.company].reverse()) walk.finishStep();
    this.place(0.2, false);
    this.phase.draw(1);
    this.showHud();
  }

  /** Show a walk that Python has saved: every step computed anew from its state. */
  open(saved: SavedWalk): void {
    this.replay = saved;
    Object.assign(this.parameters, parametersOf(saved));
    this.showParameters();
    this.seek();
    this.start(saved.states[0]);
    this.app.changed();
  }

  table(): string {
    return asTable(this.walk.records);
  }

  // Parameters, gait and panels

  private change(parameters: Partial<Parameters>): void {
    Object.assign(this.parameters, parameters);
    this.showParameters();
    this.seek();
    this.app.changed();
    this.app.stage.floor.setLines(1, !this.parameters.slope_turns);
  }

  /** The gait, if it is near the last one known: found at once. */
  private soon(): Cycle | null {
    const { kernel } = this.app;
    return this.kind === "steered"
      ? findCycle(kernel, this.parameters, this.lastGait)
      : passiveCycleNear(kernel, this.parameters, this.kind === "planar", this.lastGait);
  }

  private seek(): void {
    this.finder.ask(this.kind, this.parameters, this.lastGait);
  }

  private found(cycle: Cycle | null, parameters: Parameters): void {
    this.cycle = cycle;
    if (cycle) this.lastGait = cycle.state;
    if (!this.isHere) return;
    this.multipliers.show(cycle);
    this.returnMap.setCycle(cycle);
    this.basin.setCycle(this.kind, parameters, cycle);
    this.showFacts();
    if (cycle && this.awaited) {
      this.awaited = false;
      this.start();
    }
  }

  private showFacts(): void {
    const { cycle } = this;
    const state = !cycle ? "none" : cycle.stable ? "stable" : "unstable";
    this.badge.dataset.state = state;
    this.badge.textContent = !cycle
      ? "No gait: at these settings it does not walk on."
      : cycle.stable
        ? "Stable: small disturbances die out."
        : "Unstable: small disturbances grow.";
    const shown = (value: (cycle: Cycle) => string) => (cycle ? value(cycle) : "–");
    this.facts.set("speed", shown((c) => units.speed(c.speed)));
    this.facts.set("step length", shown((c) => units.length(c.stepLength)));
    this.facts.set("stride time", shown((c) => units.time(c.stridePeriod)));
    this.facts.set("heading", shown((c) => units.angle(c.heading, 4)));
    this.facts.set("energy per step", shown((c) => units.energy(c.energy.gravity + c.energy.shift)));
    this.facts.set("least normal force", shown((c) => `${number(c.normalForce, 3)} weights`));
    this.facts.set("friction needed", shown((c) => number(c.frictionDemand, 3)));
    if (this.parameters.slope_turns) this.facts.set("turn per stride", shown((c) => units.angle(c.turn, 4)));
  }

  private showParameters(): void {
    for (const [name, slider] of this.sliders) slider.value = this.parameters[name];
    this.turns.checked = this.parameters.slope_turns;
  }

  private build(): Node[] {
    const { variety } = this;
    for (const name of variety.knobs) {
      const knob = KNOBS[name];
      const [low, high, step] = variety.ranges[name] ?? [knob.low, knob.high, knob.step];
      this.sliders.set(name, new Slider({
        ...knob, id: `${this.id}-${name}`, low, high, step, value: this.parameters[name],
        onInput: (value) => this.change({ [name]: value }),
      })); // prettier-ignore
    }
    const presets = variety.presets.map(([name, change]) =>
      h("button", { type: "button", class: "small", onclick: () => this.preset(change) }, name),
    );
    const company = h("select", { id: `${this.id}-company`, onchange: () => this.setCompany(Number(company.value)) },
      ...[1, 2, 4, 8].map((n) => h("option", { value: n }, n === 1 ? "alone" : `${n}, each disturbed more`)));
    const isSteered = this.kind === "steered";
    this.showLesson(-1);
    return [
      h("p", { class: "story" }, variety.story),
      isSteered ? this.tour : null,
      section("Change it", true,
        h("div", { class: "row wrap" }, ...presets), ...[...this.sliders.values()].map((slider) => slider.element),
        isSteered ? h("label", { class: "check" }, this.turns, "The slope turns with the walker: downhill is always ahead") : null,
        h("div", { class: "row" }, h("label", { for: `${this.id}-company` }, "Walkers"), company)),
      section("The gait", true, this.badge, this.facts.element),
      section("Multipliers", true, this.multipliers.element),
      section("Return map", true, this.returnMap.element),
      section("Phase plot", true, this.phase.element),
      section("Energy of each step", true, this.energyPanel.element),
      section("Basin of attraction", true, this.basin.element),
    ].filter((node) => node !== null);
  }

  private setCompany(n: number): void {
    this.companions = n;
    this.app.stage.setScale(SCALES[n]);
    this.start();
  }

  private preset(change: Partial<Parameters>): void {
    this.change({ ...this.variety.defaults, ...change });
    this.replay = null;
    const cycle = this.soon();
    if (cycle) this.found(cycle, this.parameters);
    this.awaited = !cycle;
    this.start();
  }

  /** The guided tour's lesson `k`; -1 before it begins. */
  private showLesson(k: number): void {
    if (k < 0) {
      this.tour.replaceChildren(h("button", { type: "button", class: "primary", id: "why", onclick: () => this.showLesson(0) }, "Why does it stand?"));
      return;
    }
    const lesson = TOUR[k];
    const isLast = k === TOUR.length - 1;
    const next = () => {
      this.change(lesson.change);
      if (isLast) this.start();
      this.app.play(true);
      this.showLesson(isLast ? -1 : k + 1);
      this.tour.querySelector("button")?.focus();
    };
    this.tour.replaceChildren(
      h("div", { class: "card lesson", role: "region", "aria-live": "polite" },
        h("h3", {}, lesson.title), h("p", {}, lesson.words),
        h("div", { class: "row" },
          h("button", { type: "button", class: "primary", id: "lesson-next", onclick: next }, lesson.button),
          isLast ? null : h("button", { type: "button", class: "small quiet", onclick: () => this.showLesson(-1) }, "Close"))),
    );
  }

  refresh(): void {
    for (const slider of this.sliders.values()) slider.refresh();
    this.showFacts();
    this.drawPlots();
    this.showHud();
  }

  resize(): void {
    for (const staged of this.company) staged.resize();
    this.drawPlots();
  }

  private drawSteps(): void {
    this.returnMap.draw();
    this.energyPanel.show(this.walk.records);
  }

  private drawPlots(): void {
    if (!this.company.length) return;
    this.drawSteps();
    this.multipliers.draw();
    this.phase.draw(this.walk.share);
    this.basin.draw();
  }

  private showHud(): void {
    if (!this.company.length) return;
    const { walk } = this;
    const { records, current } = walk;
    const last = records.slice(-2).filter((record) => !record.fall);
    const moved = last.length === 2 ? Math.hypot(current.contact[0] - last[0].contact[0], current.contact[1] - last[0].contact[1]) : NaN;
    const duration = last.reduce((sum, record) => sum + record.duration, 0);
    const speed = moved / duration;
    const heading = last.length ? 0.5 * (current.state[0] + last.at(-1)!.state[0]) : current.state[0];
    const offset = walk.pose().offset;
    this.app.hud.replaceChildren(
      fact("step", String(current.index)),
      fact("time", units.time(walk.time, 1)),
      fact("speed", Number.isFinite(speed) ? units.speed(speed) : "–"),
      fact("heading", units.angle(heading, 2)),
      ...(this.kind === "steered" ? [steeringBar(offset)] : []),
    );
  }

  names(): Name[] {
    const drawn = this.company[0].parameters;
    const shape = this.company[0].shape();
    const leg = this.walk.side === 1 ? shape.left : shape.right;
    const swing = this.walk.side === 1 ? shape.right : shape.left;
    const names: Name[] = [
      ["mass: moves along the axle", shape.masses[0]],
      ["stance leg, length 1", add(leg.ankle, leg.leg[1], 0.55)],
      ["swing leg: no mass", add(swing.ankle, swing.leg[1], 0.6)],
      ["ankle axis, tilted", add(leg.ankle, leg.ankleAxis, -0.22)],
      ["foot: rolls like a cylinder", add(swing.ankle, swing.foot[0], 0.1)],
    ];
    if (drawn.hip_width > 0.12) names.push(["centre of mass", shape.centre], ["hip axle", add(shape.masses[1], shape.axle, 0.09)]);
    return names;
  }

  /** The state right after the last heel strike, on the left foot; for tests and the curious. */
  get sectionState(): State {
    return this.walk.side === 1 ? this.walk.state : mirrored(this.walk.state);
  }
}

export function fact(name: string, value: string): HTMLElement {
  return h("span", {}, h("small", {}, name), value);
}

/** Where the masses are along the axle. */
export function steeringBar(offset: number): HTMLElement {
  const share = 50 + 50 * Math.max(-1, Math.min(1, offset / 0.06));
  return h("span", { class: "steering" }, h("small", {}, "masses"), h("i", {}, h("b", { style: `left:${share}%` })));
}

// Skateboard and bicycle: linear vehicles that ride on the stage, with their eigenvalues over the speed.

import * as THREE from "three";
import type { App, Exhibit } from "../app";
import { EigenvaluesPanel, HistoryPanel, type Curves } from "../panels/eigenvalues";
import type { Complex } from "../physics/linalg";
import {
  Bicycle, bicycleBranches, eigenvalues, moved, Skateboard, stabilityLimits, type BicycleParameters, type LinearVehicle,
  type SkateboardParameters,
} from "../physics/vehicles";
import { BENCHMARK_BICYCLE, PAPER_BICYCLE, SKATEBOARD } from "../physics/vehicle_data";
import type { Name } from "../scene/labels";
import { PALETTE } from "../scene/palette";
import { PushArrow } from "../scene/push_arrow";
import { Trail } from "../scene/trail";
import { BicycleModel, disposeModel, SkateboardModel } from "../scene/vehicle_models";
import type { Settings } from "../share/link";
import { Facts, h, section } from "../ui/dom";
import { number } from "../ui/plot";
import { Slider } from "../ui/slider";

/** Where the linear equations say nothing true any more, and the rider is down. */
const FALLEN = 1.05;
const LYING = 1.45;
const CURVE_POINTS = 241;
const KICK = 0.3;

interface Knob {
  name: string;
  label: string;
  hint: string;
  low: number;
  high: number;
  step: number;
  show: (value: number) => string;
}

const metres = (value: number) => `${number(value, 3)} m`;
const degrees = (value: number) => `${number((value * 180) / Math.PI, 1)}°`;

/** What skateboard and bicycle share; `State` begins with the lean. */
abstract class VehicleExhibit implements Exhibit {
  readonly isWalk = false;
  readonly isSteered = true;
  readonly isPushed = true;
  abstract readonly id: string;
  abstract readonly title: string;
  abstract readonly subtitle: string;
  protected abstract readonly story: string;
  protected abstract readonly fastest: number;
  protected abstract readonly knobs: Knob[];
  protected abstract readonly angles: string[];
  protected abstract values: Record<string, number>;
  protected abstract readonly defaults: Record<string, number>;
  protected abstract vehicle(): LinearVehicle;
  protected abstract curves(vehicle: LinearVehicle): Curves;
  protected abstract describe(facts: Facts, curves: Curves): void;
  protected abstract yawRate(state: number[]): number;
  protected abstract buildModel(): THREE.Group;
  protected abstract placeModel(lean: number): void;
  protected abstract presets(): [string, () => void][];

  protected state: number[] = [];
  protected x = 0;
  protected z = 0;
  protected heading = 0;
  protected rolled = 0;
  private time = 0;
  private fallenFor = -1;
  private fallLean = 0;
  private kicks = 1;
  private sinceDrawn = 1;
  private model: THREE.Group | null = null;
  private readonly trail = new Trail(PALETTE.path);
  private readonly arrow = new PushArrow();
  private readonly sliders = new Map<string, Slider>();
  private readonly facts = new Facts();
  private readonly badge = h("p", { class: "badge", role: "status" });
  private readonly rows = h("tbody");
  private eigenvalues!: EigenvaluesPanel;
  private history!: HistoryPanel;
  private current!: LinearVehicle;
  private shown: Curves | null = null;
  private panels: Node[] = [];

  constructor(protected readonly app: App) {}

  enter(settings: Settings): void {
    for (const name of Object.keys(this.values)) {
      const value = Number(settings[name]);
      if (settings[name] !== undefined && Number.isFinite(value)) this.values[name] = value;
    }
    if (!this.panels.length) this.panels = this.build();
    this.app.panel.replaceChildren(...this.panels);
    this.app.stage.setSlope(0);
    this.app.stage.setScale(2.1);
    this.app.stage.floor.setLines(2, false);
    this.app.stage.world.add(this.trail.group, this.arrow.mesh);
    this.resize();
    this.changed();
    this.reset();
  }

  leave(): void {
    if (this.model) disposeModel(this.model);
    this.model = null;
    this.trail.group.removeFromParent();
    this.arrow.mesh.removeFromParent();
    this.app.stage.setScale(1);
  }

  reset(): void {
    this.state = this.angles.flatMap(() => [0, 0]);
    this.state[0] = 0.035;
    [this.x, this.z, this.heading, this.rolled, this.time] = [0, 0, 0, 0, 0];
    this.fallenFor = -1;
    this.history.clear();
    this.trail.clear();
    this.app.notice(null);
    this.place(0, true);
    this.history.draw();
  }

  push(strong: boolean): void {
    if (this.fallenFor >= 0) return;
    const kick = this.kicks * KICK * (strong ? 2.5 : 1);
    this.kicks *= -1;
    this.state[this.angles.length] += kick;
    this.arrow.show(kick, 0, Math.abs(kick) / KICK);
  }

  /** Arrow keys push gently to the side, as a rider's hip would. */
  steer(direction: number): void {
    if (this.fallenFor < 0) this.state[this.angles.length] += 0.12 * direction;
  }

  stride(direction: number): void {
    this.set({ speed: Math.max(0, Math.min(this.values.speed + 0.1 * direction, this.fastest)) });
  }

  stepOnce(): void {
    this.app.play(false);
    this.frame(0.1, 0.1);
  }

  settings(): Settings {
    const changed = Object.entries(this.values).filter(([name, value]) => value !== this.defaults[name]);
    return Object.fromEntries(changed.map(([name, value]) => [name, String(value)]));
  }

  get isMoving(): boolean {
    return this.arrow.isShown;
  }

  /** Names of parts by their places in the vehicle's own upright frame: ahead, up, right. */
  protected abstract parts(): Name[];

  names(): Name[] {
    const [cosine, sine] = [Math.cos(this.heading), Math.sin(this.heading)];
    const [up, aside] = [Math.cos(this.state[0]), Math.sin(this.state[0])];
    return this.parts().map(([name, [x, y, z]]) => {
      const [high, right] = [y * up - z * aside, y * aside + z * up];
      return [name, [this.x + cosine * x + sine * right, high, this.z - sine * x + cosine * right]];
    });
  }

  timeScale(): number {
    return 2.5; // at the walkers' usual slow motion a bicycle rides in real time
  }

  frame(duration: number, real: number): void {
    if (duration > 0) this.ride(duration);
    this.arrow.advance(real);
    this.place(real, false);
    this.sinceDrawn += real;
    if (duration > 0 && this.sinceDrawn > 0.06) {
      this.sinceDrawn = 0;
      this.history.draw();
      this.showHud();
    }
  }

  private ride(duration: number): void {
    const { speed } = this.values;
    if (this.fallenFor >= 0) {
      this.fallenFor += duration;
      return;
    }
    const pieces = Math.max(1, Math.ceil(duration / 0.01));
    const h = duration / pieces;
    for (let k = 0; k < pieces; k++) {
      const before = this.yawRate(this.state);
      this.state = moved(this.current, speed, this.state, h);
      const turn = 0.5 * h * (before + this.yawRate(this.state));
      const middle = this.heading - 0.5 * turn;
      this.x += speed * h * Math.cos(middle);
      this.z -= speed * h * Math.sin(middle);
      this.heading -= turn;
      this.rolled += speed * h;
      this.time += h;
      if (Math.abs(this.state[0]) > FALLEN || !Number.isFinite(this.state[0])) {
        this.fall();
        break;
      }
    }
    this.history.add(this.time, this.state.slice(0, this.angles.length));
    this.trail.extend([[this.x, 0.006, this.z]]);
  }

  private fall(): void {
    this.fallenFor = 0;
    this.fallLean = Math.sign(this.state[0] || 1) * FALLEN;
    const growing = eigenvalues(this.current, this.values.speed)[0];
    const how = growing.im !== 0 ? "the swinging from side to side grew" : "the lean grew without swinging back";
    this.app.notice(
      h("div", { class: "card fall", id: "fall" },
        h("strong", {}, "It fell: sideways"), h("span", {}, ` after ${number(this.time, 1)} s. `),
        h("p", {}, `At ${number(this.values.speed, 2)} m/s ${how}. The equations are linear: past a small lean they only tell that it falls.`),
        h("button", { type: "button", onclick: () => this.reset() }, "Start again (R)")),
    );
  }

  private place(real: number, jump: boolean): void {
    let lean = this.state[0];
    if (this.fallenFor >= 0) {
      const s = Math.min(this.fallenFor / 0.45, 1);
      lean = this.fallLean + s * s * Math.sign(this.fallLean) * (LYING - FALLEN);
    }
    this.placeModel(lean);
    this.app.stage.follow(new THREE.Vector3(this.x + 0.5 * Math.cos(this.heading), 0.8, this.z - 0.5 * Math.sin(this.heading)), this.heading, real, jump);
    this.arrow.place([this.x + 0.3, 1.1, this.z], this.heading);
  }

  private showHud(): void {
    const fact = (name: string, value: string) => h("span", {}, h("small", {}, name), value);
    this.app.hud.replaceChildren(
      fact("time", `${number(this.time, 1)} s`), fact("speed", `${number(this.values.speed, 2)} m/s`),
      ...this.angles.map((name, k) => fact(name, degrees(Math.max(-9, Math.min(9, this.state[k]))))),
      fact("heading", degrees(this.heading)),
    );
  }

  protected set(values: Record<string, number>): void {
    Object.assign(this.values, values);
    this.changed();
    this.app.changed();
  }

  private changed(): void {
    this.current = this.vehicle();
    this.shown = this.curves(this.current);
    for (const [name, slider] of this.sliders) slider.value = this.values[name];
    if (this.model) disposeModel(this.model);
    this.model = this.buildModel();
    this.app.stage.world.add(this.model);
    if (this.state.length) this.place(0, false);
    this.refresh();
  }

  refresh(): void {
    const { speed } = this.values;
    const now = eigenvalues(this.current, speed);
    const growth = now[0].re;
    const isStable = growth < -1e-9;
    const isNeutral = Math.abs(growth) <= 1e-9;
    this.badge.dataset.state = growth > 1e-9 ? "unstable" : "stable";
    this.badge.textContent = isStable
      ? "Stable at this speed: it rights itself."
      : isNeutral
        ? "Neither grows nor dies out: it swings from side to side for ever."
        : "Unstable at this speed: it falls.";
    this.rows.replaceChildren(...now.map(row));
    this.describe(this.facts, this.shown!);
    this.eigenvalues.show(this.shown, speed);
    for (const slider of this.sliders.values()) slider.refresh();
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.app.stage.canvas;
    this.trail.resize(clientWidth / Math.max(clientHeight, 1), clientHeight);
    this.eigenvalues?.draw();
    this.history?.draw();
  }

  private build(): Node[] {
    this.eigenvalues = new EigenvaluesPanel(this.fastest > 6 ? 10 : 6);
    this.eigenvalues.onPick = (speed) => this.set({ speed: Number(speed.toFixed(2)) });
    this.history = new HistoryPanel(this.angles, [PALETTE.left, PALETTE.right]);
    for (const knob of this.knobs) {
      this.sliders.set(knob.name, new Slider({ ...knob, id: `${this.id}-${knob.name}`, value: this.values[knob.name], onInput: (value) => this.set({ [knob.name]: value }) }));
    }
    const presets = this.presets().map(([name, act]) => h("button", { type: "button", class: "small", onclick: act }, name));
    return [
      h("p", { class: "story" }, this.story),
      section("Change it", true, h("div", { class: "row wrap" }, ...presets), ...[...this.sliders.values()].map((slider) => slider.element)),
      section("At this speed", true, this.badge, this.facts.element,
        h("table", { class: "modes" }, h("caption", { class: "hidden" }, "Eigenvalues at this speed"),
          h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "eigenvalue, 1/s"), h("th", { scope: "col" }, "what it does"))), this.rows)),
      section("Eigenvalues over speed", true, this.eigenvalues.element),
      section("Motion", true, this.history.element),
    ];
  }
}

function row({ re, im }: Complex): HTMLTableRowElement {
  const text = im === 0 ? number(re, 4) : `${number(re, 4)} ${im > 0 ? "+" : "−"} ${number(Math.abs(im), 4)} i`;
  const grows = re > 1e-9;
  const what = `${im !== 0 ? "swings" : "straight"}, ${grows ? "grows" : re < -1e-9 ? "dies out" : "stays"}`;
  return h("tr", { class: grows ? "outside" : "", "data-re": re, "data-im": im },
    h("td", { style: "font-variant-numeric: tabular-nums" }, text), h("td", { class: "num" }, what));
}

export class SkateboardExhibit extends VehicleExhibit {
  readonly id = "skateboard";
  readonly title = "Skateboard";
  readonly subtitle = "Leaning turns the wheels, nothing else";
  protected readonly story = "The simplest case. A stiff rider on a board whose tilted axles turn the wheels as it leans. Fast enough, the board rolls back under the fall: above its critical speed it does not fall.";
  protected readonly fastest = 4;
  protected readonly angles = ["lean"];
  protected readonly defaults: Record<string, number> = { speed: 1.4, spring_stiffness: SKATEBOARD.spring_stiffness, steering_tilt: SKATEBOARD.steering_tilt, wheelbase: SKATEBOARD.wheelbase, rider_height: SKATEBOARD.rider_height, damping: 25 };
  protected values = { ...this.defaults };
  protected readonly knobs: Knob[] = [
    { name: "speed", label: "Speed", hint: "Forward speed", low: 0, high: 4, step: 0.02, show: (v) => `${number(v, 2)} m/s` },
    { name: "steering_tilt", label: "Tilt of the steering axes", hint: "From the vertical", low: 0.2, high: 1.4, step: 0.01, show: degrees },
    { name: "spring_stiffness", label: "Spring of each axis", hint: "N m per radian", low: 0, high: 400, step: 5, show: (v) => `${number(v, 0)} N m/rad` },
    { name: "damping", label: "Damper of each axis", hint: "N m s per radian", low: 0, high: 100, step: 1, show: (v) => `${number(v, 0)} N m s/rad` },
    { name: "rider_height", label: "Height of the rider's mass", hint: "Above the floor", low: 0.6, high: 1.4, step: 0.02, show: metres },
    { name: "wheelbase", label: "Wheelbase", hint: "Between the axles", low: 0.25, high: 0.8, step: 0.01, show: metres },
  ];
  private skateboardModel: SkateboardModel | null = null;

  private parameters(): SkateboardParameters {
    return { ...SKATEBOARD, ...Object.fromEntries(Object.entries(this.values).filter(([name]) => name !== "speed")) };
  }

  protected vehicle(): Skateboard {
    return new Skateboard(this.parameters());
  }

  protected curves(vehicle: Skateboard): Curves {
    const speeds = Array.from({ length: CURVE_POINTS }, (_, k) => (k * this.fastest) / (CURVE_POINTS - 1));
    const sets = speeds.map((speed) => eigenvalues(vehicle, speed));
    return {
      speeds,
      branches: [0, 1].map((k) => ({ name: "lean", values: sets.map((set) => set[k]) })),
      stable: [[vehicle.criticalSpeed, Infinity]],
    };
  }

  protected describe(facts: Facts): void {
    const board = this.vehicle();
    facts.set("critical speed", `${number(board.criticalSpeed, 3)} m/s`);
    facts.set("curve of a lean", `${number(board.curvaturePerLean, 2)} /m`);
  }

  protected yawRate(state: number[]): number {
    return this.values.speed * this.vehicle().curvaturePerLean * state[0];
  }

  protected buildModel(): THREE.Group {
    this.skateboardModel = new SkateboardModel(this.parameters());
    return this.skateboardModel.group;
  }

  protected placeModel(lean: number): void {
    this.skateboardModel?.update(this.x, this.z, this.heading, lean, this.rolled);
  }

  protected parts(): Name[] {
    const half = 0.5 * this.values.wheelbase;
    return [
      ["rider: a point mass at the belt", [0, this.values.rider_height, 0.11]],
      ["steering axis, tilted, with a spring", [half - 0.05, 0.09, 0]], ["wheels turn as the board leans", [-half, 0.034, 0.1]],
    ]; // prettier-ignore
  }

  protected presets(): [string, () => void][] {
    return [
      ["Below critical", () => { this.set({ ...this.defaults, speed: 0.7 }); this.reset(); }],
      ["Above critical", () => { this.set({ ...this.defaults }); this.reset(); }],
      ["No damper", () => { this.set({ ...this.defaults, damping: 0 }); this.reset(); }],
    ]; // prettier-ignore
  }
}

export class BicycleExhibit extends VehicleExhibit {
  readonly id = "bicycle";
  readonly title = "Bicycle";
  readonly subtitle = "A steering fork of its own turns leaning into yaw";
  protected readonly story = "No hands. A bicycle that leans steers into the lean, by its trail, its tilted fork and its spinning wheel. Between its weave speed and its capsize speed this keeps it up without any control.";
  protected readonly fastest = 10;
  protected readonly angles = ["lean", "steer"];
  protected readonly defaults: Record<string, number> = { speed: 5.2, benchmark: 0, trail: PAPER_BICYCLE.trail, steer_axis_tilt: PAPER_BICYCLE.steer_axis_tilt, wheelbase: PAPER_BICYCLE.wheelbase, spin: 1 };
  protected values = { ...this.defaults };
  protected readonly knobs: Knob[] = [
    { name: "speed", label: "Speed", hint: "Forward speed", low: 0, high: 10, step: 0.05, show: (v) => `${number(v, 2)} m/s` },
    { name: "trail", label: "Trail", hint: "How far the front contact lies behind the steering axis", low: -0.04, high: 0.2, step: 0.002, show: metres },
    { name: "steer_axis_tilt", label: "Tilt of the steering axis", hint: "From the vertical, backwards", low: 0, high: 0.7, step: 0.005, show: degrees },
    { name: "spin", label: "Spin of the front wheel", hint: "Its moment of inertia about the axle, as a share of the original", low: 0, high: 2, step: 0.02, show: (v) => `× ${number(v, 2)}` },
    { name: "wheelbase", label: "Wheelbase", hint: "Between the contacts", low: 0.7, high: 1.5, step: 0.01, show: metres },
  ];
  private bicycleModel: BicycleModel | null = null;
  private limits: { speed: number; stableAfter: boolean }[] = [];
  private key = "";
  private kept: Curves | null = null;

  private parameters(): BicycleParameters {
    const base: BicycleParameters = this.values.benchmark ? BENCHMARK_BICYCLE : PAPER_BICYCLE;
    const { trail, steer_axis_tilt, wheelbase, spin } = this.values;
    return { ...base, trail, steer_axis_tilt, wheelbase, front_wheel: { ...base.front_wheel, inertia_yy: spin * base.front_wheel.inertia_yy } };
  }

  protected vehicle(): Bicycle {
    return new Bicycle(this.parameters());
  }

  protected curves(vehicle: Bicycle): Curves {
    const key = JSON.stringify(vehicle.p);
    if (this.kept && key === this.key) return this.kept;
    this.key = key;
    const speeds = Array.from({ length: CURVE_POINTS }, (_, k) => (k * this.fastest) / (CURVE_POINTS - 1));
    this.limits = stabilityLimits(vehicle, 15);
    const stable: [number, number][] = [];
    this.limits.forEach((limit, k) => {
      if (limit.stableAfter) stable.push([limit.speed, this.limits[k + 1]?.speed ?? Infinity]);
    });
    const branches = bicycleBranches(vehicle, speeds) ?? [0, 1, 2, 3].map((k) => ({ name: "weave", values: speeds.map((speed) => eigenvalues(vehicle, speed)[k]) }));
    this.kept = { speeds, branches, stable };
    return this.kept;
  }

  protected describe(facts: Facts, curves: Curves): void {
    const range = curves.stable[0];
    facts.set("stable from", range ? `${number(range[0], 3)} m/s` : "never");
    facts.set("stable up to", range ? (Number.isFinite(range[1]) ? `${number(range[1], 3)} m/s` : "any speed") : "–");
  }

  protected yawRate(state: number[]): number {
    return this.vehicle().yawRate(this.values.speed, state[1], state[3]);
  }

  protected buildModel(): THREE.Group {
    this.bicycleModel = new BicycleModel(this.parameters());
    return this.bicycleModel.group;
  }

  protected placeModel(lean: number): void {
    const steer = Math.max(-1.2, Math.min(1.2, this.state[1] || 0));
    this.bicycleModel?.update(this.x, this.z, this.heading, lean, steer, this.rolled);
  }

  protected parts(): Name[] {
    const { wheelbase, trail } = this.values;
    const tilt = this.values.steer_axis_tilt;
    return [
      ["steering axis", [wheelbase + trail - 1.2 * Math.sin(tilt), 1.2 * Math.cos(tilt), 0]],
      ["rear frame with the rider", [0.3, 1.15, 0.1]], ["front frame", [wheelbase - 0.1, 0.62, 0.05]],
      ["trail: from here to the front contact", [wheelbase + trail, 0, 0]], ["rear contact", [0, 0, 0]],
    ]; // prettier-ignore
  }

  protected presets(): [string, () => void][] {
    const go = (values: Record<string, number>) => () => {
      this.set({ ...this.defaults, ...values });
      this.reset();
    };
    const benchmark = { benchmark: 1, trail: BENCHMARK_BICYCLE.trail, steer_axis_tilt: BENCHMARK_BICYCLE.steer_axis_tilt };
    return [
      ["Stable", go({})], ["Too slow: weave", go({ speed: 3.6 })], ["Too fast: capsize", go({ speed: 8 })],
      ["Benchmark of 2007", go(benchmark)],
    ]; // prettier-ignore
  }
}

// The package's tasks: the visitor, the paper's controller and trained policies walk the same episode side by side, for a score.

import * as THREE from "three";
import type { App, Exhibit } from "../app";
import { Walk } from "../physics/walk";
import { add } from "../physics/geometry";
import type { Fall } from "../physics/walker";
import type { Name } from "../scene/labels";
import { StagedWalk } from "../scene/staged_walk";
import { TaskMarks } from "../scene/task_marks";
import { asTable } from "../share/files";
import type { Settings } from "../share/link";
import * as units from "../share/units";
import { agentIndex, FIXED, LinearAgent, loadPolicy, type Agent, type AgentEntry, type AgentIndex, type PolicyAgent } from "../tasks/agents";
import { TaskModule, TASKS, type Episode } from "../tasks/episode";
import { Facts, h, section } from "../ui/dom";
import { number } from "../ui/plot";
import { Slider } from "../ui/slider";
import { fact, steeringBar } from "./walk_exhibit";

const MOST_WALKERS = 4;
const TINTS = ["", "#168e68", "#8c6eb4", "#be265c"];
const COLOURS = ["#256eb2", ...TINTS.slice(1)];
const YOU = "you";
/** A policy served beside the page: `lean-yaw view --agent-path FOLDER`. */
const OWN = "own";
const LINEAR = "linear";
/** Who walks beside the visitor at first, where there is such an agent. */
const RIVAL = "ppo";
const STRIDE_CHANGE = 0.25;
/** Episodes of more time than this last until a fall. */
const LONG = 1000;
/** Tasks to begin with, as challenges. */
const CHALLENGES: [string, string][] = [["Reach the goals", "Waypoint"], ["Slalom", "Slalom"], ["Stay up under pushes", "Metastable"], ["Race through gates", "Race"]];
/** Leg lengths of a path that are drawn behind and ahead of the walker. */
const PATH_BEHIND = 6;
const PATH_AHEAD = 24;
const GOLDEN = 0x9e3779b97f4a7c15n;
/** Faster than the other tabs: episodes last minutes. */
const RATE = 1;
const OTHER_RATE = 0.4;

/** What is shown of an episode, as it was at the last heel strike: the episode itself is a step ahead of the picture. */
interface Shown {
  total: number;
  time: number;
  metrics: Record<string, number>;
  goal: [number, number] | null;
  laterGate: [number, number] | null;
  heading: number | null;
  slope: number;
}

class Runner {
  readonly staged: StagedWalk;
  readonly walk: Walk;
  shown!: Shown;
  fall: Fall | null = null;
  isOver = false;

  constructor(app: App, readonly name: string, readonly episode: Episode, private readonly agent: Agent, tint: string, onEnd: (runner: Runner) => void) {
    const start = { state: episode.state, side: episode.side, contact: [0, 0] as [number, number], offset: episode.walker("mass_offset") };
    this.walk = new Walk(app.kernel, "steered", start, () => this.order());
    this.staged = new StagedWalk(this.walk, app.stage, tint, tint !== "");
    this.walk.onStep = () => {
      this.staged.begin();
      if (this.isOver) onEnd(this);
    };
    this.walk.onFall = ({ fall }) => {
      this.fall = fall;
      this.isOver = true;
      this.shown = this.look();
      onEnd(this);
    };
    this.staged.begin();
  }

  /** The next step: the agent acts, and the episode takes it. */
  private order() {
    const { episode } = this;
    this.shown = this.look();
    const state = episode.state;
    const slope = episode.walker("slope");
    if (episode.isOver) this.isOver = true;
    else episode.step(this.agent.act(episode.observation));
    return { state, parameters: { ...episode.parameters, slope } };
  }

  private look(): Shown {
    const { episode } = this;
    return {
      total: episode.total, time: episode.walker("time"), metrics: episode.metrics, goal: episode.goal, laterGate: episode.laterGate,
      heading: episode.commandedHeading, slope: episode.walker("slope"),
    }; // prettier-ignore
  }

  advance(duration: number): void {
    if (!this.isOver || this.fall) this.walk.advance(duration);
  }

  /** What the task is measured by: a measure of its own, or the sum of rewards; the time walked, where the time to a fall counts. */
  get score(): number {
    const { headline } = this.episode.task;
    if (headline === "return") return this.shown.total;
    return this.shown.metrics[headline] ?? this.shown.time;
  }

  get state(): string {
    if (this.fall) return this.fall.name;
    if (!this.isOver) return "walks";
    return this.episode.truncated ? "time is up" : "over";
  }
}

export class TaskExhibit implements Exhibit {
  readonly isWalk = true;
  readonly isSteered = true;
  readonly isPushed = false;
  readonly id = "tasks";
  readonly title = "Play";
  readonly subtitle = "The tasks of the suite, for you and for trained agents";
  private task = "Heading";
  private seed = 1;
  private chosen = [YOU, RIVAL];
  /** Walkers that a link asks for. */
  private asked: string[] = [];
  private own: string | null = null;
  private index: AgentIndex = { agents: {}, laws: {}, references: {} };
  private module: TaskModule | null = null;
  private policies = new Map<string, PolicyAgent>();
  private runners: Runner[] = [];
  private steering = 0;
  private isHere = false;
  private started = 0;
  private aside = 0;
  private pathFrom = NaN;
  private readonly marks = new TaskMarks();
  private readonly taskMenu = h("select", { id: "task", onchange: () => this.open(this.taskMenu.value) },
    ...Object.keys(TASKS).map((name) => h("option", { value: name }, name)));
  private readonly summary = h("p", { class: "story", id: "task-summary" });
  private readonly reward = h("p", { class: "note" });
  private readonly strideSlider = new Slider({
    id: "task-stride", label: "Your stride", hint: "The angle between your legs: longer steps turn faster, shorter ones are safer (arrow keys up and down)",
    low: -1, high: 1, step: STRIDE_CHANGE, value: 0, show: (value) => units.angle(0.3 + 0.15 * value), onInput: () => {},
  }); // prettier-ignore
  private readonly scoring = h("p", { class: "note", id: "task-scoring" });
  private readonly choices = h("div", { class: "row wrap", role: "group", "aria-label": "Who walks" });
  private readonly rows = h("tbody");
  private readonly facts = new Facts();
  private readonly measures = section("Measures", false, this.facts.element);
  private panels: Node[] = [];

  constructor(private readonly app: App) {}

  enter(settings: Settings): void {
    this.isHere = true;
    if (settings.task in TASKS) this.task = settings.task;
    if (Number.isInteger(Number(settings.seed))) this.seed = Number(settings.seed ?? this.seed);
    if (settings.walkers) this.asked = this.chosen = settings.walkers.split(",").slice(0, MOST_WALKERS);
    if (settings.policy) this.own = settings.policy;
    if (!this.panels.length) this.panels = this.build();
    this.app.panel.replaceChildren(...this.panels);
    this.app.stage.world.add(this.marks.group);
    this.app.stage.floor.setLines(1, true);
    this.app.stage.setScale(1.25);
    this.app.setView("follow");
    if (!settings.rate) this.app.setRate(RATE);
    this.app.hud.replaceChildren();
    void this.load();
  }

  leave(): void {
    this.isHere = false;
    this.clear();
    this.marks.group.removeFromParent();
    this.app.stage.setScale(1);
    this.app.setView("free");
    this.app.setRate(OTHER_RATE);
  }

  private async load(): Promise<void> {
    try {
      if (!this.module) [this.module, this.index] = await Promise.all([TaskModule.load(this.app.kernel), agentIndex()]);
      if (this.isHere) await this.start();
    } catch (error) {
      this.complain(error);
    }
  }

  private complain(error: unknown): void {
    const words = error instanceof Error ? error.message : String(error);
    this.app.notice(h("div", { class: "card fall", id: "task-error" }, h("strong", {}, "This agent cannot walk here. "), words));
  }

  private open(task: string): void {
    this.task = task;
    this.chosen = this.chosen.filter((name) => name !== OWN);
    void this.restart();
  }

  private offered(): string[] {
    const law = this.index.laws[this.task] ? [LINEAR] : [];
    return [YOU, "fixed", ...law, ...Object.keys(this.shipped()), ...(this.own ? [OWN] : [])];
  }

  /** Trained agents that see what this task shows here. */
  private shipped(): Record<string, AgentEntry> {
    const seen = TASKS[this.task].observation.join();
    const entries = Object.entries(this.index.agents[TASKS[this.task].id] ?? {});
    return Object.fromEntries(entries.filter(([, { observation }]) => observation.join() === seen));
  }

  private async agent(name: string): Promise<Agent> {
    if (name === YOU) return { act: () => this.action() };
    if (name === "fixed") return FIXED;
    if (name === LINEAR) return new LinearAgent(this.index.laws[this.task]);
    const { id, observation } = TASKS[this.task];
    const place = name === OWN ? this.own! : `agents/${id}/${name}/seed${this.index.agents[id]?.[name]?.seeds[0] ?? 0}/policy`;
    if (!this.policies.has(place)) this.policies.set(place, await loadPolicy(place, observation));
    return this.policies.get(place)!.fresh();
  }

  /** The visitor's action: keys steer to the right or left in space; a gait of pumping goes on by itself. */
  private action(): number[] {
    const side = this.runners.find(({ name }) => name === YOU)?.episode.side ?? 1;
    return [this.strideSlider.value, side * this.steering + TASKS[this.task].pump];
  }

  /** Put all chosen walkers at the start of the episode. */
  private async start(): Promise<void> {
    const turn = ++this.started;
    const { task } = this;
    const offered = this.offered();
    this.chosen = this.chosen.filter((name) => offered.includes(name) || name === OWN);
    if (!this.chosen.length) this.chosen = [YOU];
    const key = BigInt.asUintN(64, BigInt(this.seed) * GOLDEN);
    let agents: [string, Agent][];
    try {
      agents = await Promise.all(this.chosen.map(async (name): Promise<[string, Agent]> => [name, await this.agent(name)]));
    } catch (error) {
      this.clear();
      this.showTask();
      this.complain(error);
      return;
    }
    if (turn !== this.started || !this.isHere || !this.module) return; // another one was asked for meanwhile
    this.clear();
    this.strideSlider.value = 0;
    for (const [k, [name, agent]] of agents.entries()) {
      this.runners.push(new Runner(this.app, name, this.module.episode(task, key), agent, TINTS[k], () => this.ended()));
    }
    const missing = this.asked.filter((name) => !offered.includes(name));
    this.asked = [];
    this.app.notice(null);
    if (missing.length) this.complain(new Error(`There is no agent ${missing.join(", ")} for what ${task} shows.`));
    this.showTask();
    this.place(0, true);
    this.show();
    this.app.changed();
  }

  private async restart(): Promise<void> {
    await this.start();
    this.app.play(true);
  }

  private clear(): void {
    for (const { staged } of this.runners) staged.dispose();
    this.runners = [];
    this.marks.clear();
    this.pathFrom = NaN;
  }

  /** The walker that is looked at, and whose goals are shown: the first that is still on its way. */
  private get leader(): Runner {
    return this.runners.find(({ isOver }) => !isOver) ?? this.runners[0];
  }

  frame(duration: number, real: number): void {
    if (!this.runners.length) return;
    for (const runner of this.runners) runner.advance(duration);
    this.place(real, false);
    if (duration > 0) this.show();
  }

  private place(real: number, jump: boolean): void {
    for (const { staged } of this.runners) staged.place();
    const { leader } = this;
    const { centre } = leader.staged.shape();
    const sway = jump ? 1 : 1 - Math.exp(-real / 0.4);
    this.aside += sway * (centre[2] - this.aside);
    const { shown } = leader;
    this.app.stage.setSlope(shown.slope);
    this.app.stage.follow(new THREE.Vector3(centre[0], 0.5, this.aside), leader.walk.current.state[0], real, jump);
    const { radius } = leader.episode.task;
    if (shown.laterGate) this.marks.setGates([shown.goal, shown.laterGate], radius);
    else this.marks.setGoal(shown.goal, radius);
    const { goal } = shown;
    const toGoal = goal && Math.atan2(this.aside - goal[1], goal[0] - centre[0]);
    this.marks.setHeading(shown.heading ?? toGoal, [centre[0], this.aside]);
    const { path } = leader.episode;
    if (path && !(Math.abs(centre[0] - this.pathFrom) < 0.5 * PATH_BEHIND)) {
      this.pathFrom = centre[0];
      this.marks.setPath(path, centre[0] - PATH_BEHIND, centre[0] + PATH_AHEAD);
    }
  }

  private ended(): void {
    const first = this.runners[0];
    if (!this.runners.every(({ isOver }) => isOver)) {
      if (first.fall) this.app.notice(h("div", { class: "card fall", id: "fall" }, h("strong", {}, `${called(first.name)} fell: ${first.fall.name}. `), first.fall.why));
      return;
    }
    const ranked = [...this.runners].sort((a, b) => b.score - a.score);
    const list = ranked.map((runner) => h("li", {}, `${called(runner.name)}: ${number(runner.score, 1)} (${runner.state})`));
    this.app.notice(
      h("div", { class: "card", id: "result" }, h("strong", {}, "The episode is over."), h("ol", {}, ...list),
        h("div", { class: "row" }, h("button", { type: "button", class: "primary", onclick: () => this.another() }, "Another one"),
          h("button", { type: "button", onclick: () => this.reset() }, "Again (R)"))),
    );
    this.show();
  }

  private another(): void {
    this.seed += 1;
    void this.restart();
  }

  reset(): void {
    void this.start();
  }

  /** An episode has its own pushes. */
  push(): void {}

  stepOnce(): void {
    this.app.play(false);
    for (const runner of this.runners) if (!runner.isOver) runner.walk.finishStep();
    if (!this.runners.length) return;
    this.place(0.2, false);
    this.show();
  }

  steer(direction: number): void {
    this.steering = direction;
  }

  stride(direction: number): void {
    this.strideSlider.value = Math.min(Math.max(this.strideSlider.value + STRIDE_CHANGE * direction, -1), 1);
  }

  get isMoving(): boolean {
    return false;
  }

  settings(): Settings {
    return {
      task: this.task, seed: String(this.seed), walkers: this.chosen.join(","), ...(this.own ? { policy: this.own } : {}),
    }; // prettier-ignore
  }

  timeScale(): number {
    return 1 / units.timeUnit();
  }

  refresh(): void {
    this.show();
  }

  resize(): void {
    for (const { staged } of this.runners) staged.resize();
  }

  table(): string {
    return asTable(this.runners[0]?.walk.records ?? []);
  }

  names(): Name[] {
    return this.runners.map(({ name, staged }): Name => {
      const { masses, axle } = staged.shape();
      return [called(name), add(masses[1], axle, 0.09)];
    });
  }

  // The panel

  private build(): Node[] {
    return [
      this.summary,
      section("Task", true,
        h("div", { class: "row wrap" }, ...CHALLENGES.map(([words, task]) =>
          h("button", { type: "button", class: "small", "data-task": task, onclick: () => this.open(task) }, words))),
        h("div", { class: "row" }, h("label", { for: "task" }, "All tasks"), this.taskMenu,
          h("button", { type: "button", class: "small", id: "another", onclick: () => this.another() }, "Another episode")),
        this.reward),
      section("Who walks", true, this.choices,
        h("table", { class: "modes", id: "scores" },
          h("thead", {}, h("tr", {}, ...["Walker", "", "Score", "Mean score"].map((name) => h("th", { scope: "col" }, name)))), this.rows),
        this.scoring, this.strideSlider.element),
      this.measures,
    ]; // prettier-ignore
  }

  private showTask(): void {
    const task = TASKS[this.task];
    this.taskMenu.value = this.task;
    this.summary.textContent = task.summary;
    this.reward.textContent = `Reward per unit of time: ${task.reward}.`;
    const measure = { return: "sum of rewards", time_per_fall: "time walked before a fall" }[task.headline] ?? task.headline.replaceAll("_", " ");
    const best = this.index.references[this.task];
    this.scoring.textContent = `Score: ${measure}. Mean score: over held-out episodes and all trainings of an agent.` +
      (best ? ` The best that a search has found: ${number(best.value, 1)} on average.` : "");
    this.choices.replaceChildren(...this.offered().map((name) => {
      const box = h("input", { type: "checkbox", id: `walker-${name}`, checked: this.chosen.includes(name), onchange: () => this.choose(name, box.checked) });
      return h("label", { class: "check" }, box, called(name));
    }));
    this.showLimits();
    this.facts.clear();
  }

  private showLimits(): void {
    for (const box of this.choices.querySelectorAll("input")) {
      box.disabled = box.checked ? this.chosen.length === 1 : this.chosen.length === MOST_WALKERS;
    }
  }

  private choose(name: string, isChosen: boolean): void {
    this.chosen = this.offered().filter((each) => (each === name ? isChosen : this.chosen.includes(each)));
    this.showLimits();
    void this.restart();
  }

  private show(): void {
    if (!this.runners.length) return;
    const { shown, walk, episode } = this.leader;
    this.app.hud.replaceChildren(
      episode.task.horizon > LONG ? fact("time", units.time(shown.time, 0)) : fact("time left", units.time(Math.max(episode.task.horizon - shown.time, 0), 0)),
      ...this.runners.map(({ name, score }) => fact(called(name), number(score, 1))),
      steeringBar(walk.pose().offset),
    );
    this.rows.replaceChildren(...this.runners.map((runner, k) => this.row(runner, k)));
    for (const [name, value] of Object.entries(shown.metrics)) this.facts.set(name.replaceAll("_", " "), number(value, 3), episode.task.metrics[name][2]);
  }

  private row(runner: Runner, k: number): HTMLElement {
    const known = this.shipped()[runner.name];
    const fixed = this.index.references[this.task];
    const mean = runner.name === "fixed" ? fixed?.fixed : known?.means[TASKS[this.task].headline];
    return h("tr", { "data-walker": runner.name, "data-score": runner.score, "data-state": runner.state },
      h("td", {}, h("span", { class: "mark", style: `background:${COLOURS[k]}` }), called(runner.name)),
      h("td", { class: "num" }, runner.state),
      h("td", { class: "num" }, number(runner.score, 1)),
      h("td", { class: "num", title: known ? `${known.seeds.length} trainings` : "" }, mean === undefined ? "–" : number(mean, 1)));
  }
}

function called(name: string): string {
  return { [YOU]: "You", fixed: "Fixed", [LINEAR]: "Linear law", [OWN]: "Your policy" }[name] ?? name.toUpperCase();
}

import "./style.css";
import type { App, Exhibit } from "./app";
import { BicycleExhibit, SkateboardExhibit } from "./exhibits/vehicle_exhibit";
import { TaskExhibit } from "./exhibits/task_exhibit";
import { WalkExhibit } from "./exhibits/walk_exhibit";
import { Kernel } from "./kernel/kernel";
import { Labels } from "./scene/labels";
import { Stage, type View } from "./scene/stage";
import { makeGif } from "./share/film";
import { FrameTimes } from "./share/frame_times";
import { readLink, writeLink, type Settings } from "./share/link";
import { agentIndex, LinearAgent, loadPolicy } from "./tasks/agents";
import { TaskModule } from "./tasks/episode";
import { units } from "./share/units";
import { parseWalk, type SavedWalk } from "./share/files";
import { byId, h } from "./ui/dom";
import { SharePanel } from "./ui/share_panel";
import { Transport } from "./ui/transport";
import { UnitsSwitch } from "./ui/units_switch";

const LONGEST_FRAME = 0.1; // s; a tab that was away does not catch up

async function main(): Promise<void> {
  const began = performance.now();
  const kernel = await Kernel.load();
  const canvas = byId<HTMLCanvasElement>("stage");
  const stage = new Stage(canvas);
  const notice = byId("notice");
  const labels = new Labels(byId("labels"), stage);
  let playing = true;
  let rate = 0.4;
  let held = false;
  let active: Exhibit;

  const app: App = {
    kernel,
    stage,
    panel: byId("panel-body"),
    hud: byId("hud"),
    notice: (content) => notice.replaceChildren(...(content ? [content] : [])),
    changed: () => writeLink(settings),
    play(value) {
      playing = value;
      transport.showPlaying(value);
    },
    setRate(value) {
      rate = value;
      transport.showRate(value);
    },
    setView(view) {
      stage.setView(view);
      transport.showView(view);
    },
  };
  const exhibits: Exhibit[] = [
    new SkateboardExhibit(app), new BicycleExhibit(app), new WalkExhibit(app, "planar"), new WalkExhibit(app, "passive"),
    new WalkExhibit(app, "steered"), new TaskExhibit(app),
  ]; // prettier-ignore
  const frames = new FrameTimes(byId("frames"));
  const switcher = new UnitsSwitch(byId("units"), () => {
    active.refresh();
    app.changed();
  });
  const share = new SharePanel(canvas, {
    table: () => (active instanceof WalkExhibit || active instanceof TaskExhibit ? active.table() : null),
    open: openWalk,
    next(duration) {
      active.frame(duration * rate * active.timeScale(), duration);
      stage.render();
    },
    hold: (value) => (held = value),
  });
  byId("share").append(share.element);
  const transport = new Transport(byId("transport"), canvas, {
    play: () => app.play(!playing),
    step: () => active.stepOnce(),
    reset: () => active.reset(),
    push: (strong) => active.push(strong),
    rate: (value) => {
      rate = value;
      app.changed();
    },
    view: (view: View) => stage.setView(view),
    names(shown) {
      labels.shown = shown;
      labels.update(active.names());
    },
    steer: (direction) => active.steer(direction),
    stride: (direction) => active.stride(direction),
  });

  function settings(): Settings {
    return { tab: active.id, ...active.settings(), ...switcher.settings(), ...(rate === 0.4 ? {} : { rate: String(rate) }) };
  }

  function open(exhibit: Exhibit, from: Settings): void {
    if (exhibit === active) return;
    active?.leave();
    active = exhibit;
    app.notice(null);
    labels.clear();
    tabs.forEach((tab, each) => {
      tab.setAttribute("aria-selected", String(each === exhibit));
      tab.tabIndex = each === exhibit ? 0 : -1;
    });
    tabs.get(exhibit)!.scrollIntoView({ block: "nearest", inline: "center" });
    byId("panel-title").textContent = exhibit.title;
    byId("panel-subtitle").textContent = exhibit.subtitle;
    transport.setKind(exhibit);
    share.setWalk(exhibit.isWalk);
    exhibit.enter(from);
    if (!playing) exhibit.frame(0, 0);
    app.changed();
  }

  function openWalk(walk: SavedWalk): void {
    const steered = exhibits.find((exhibit) => exhibit.id === "steered") as WalkExhibit;
    open(steered, {});
    steered.open(walk);
    app.play(true);
  }

  const tabs = new Map<Exhibit, HTMLButtonElement>();
  for (const exhibit of exhibits) {
    const tab = h("button", { type: "button", role: "tab", id: `tab-${exhibit.id}`, "aria-controls": "main", onclick: () => open(exhibit, {}) }, exhibit.title);
    tabs.set(exhibit, tab);
    byId("tabs").append(tab);
  }
  byId("tabs").addEventListener("keydown", (event) => {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (!step) return;
    event.stopPropagation();
    const next = exhibits[(exhibits.indexOf(active) + step + exhibits.length) % exhibits.length];
    open(next, {});
    tabs.get(next)!.focus();
  });

  const link = readLink();
  switcher.restore(link);
  if (link.quality) stage.setQuality(Number(link.quality));
  if (Number(link.rate) > 0) app.setRate(Number(link.rate));
  open(exhibits.find((exhibit) => exhibit.id === link.tab) ?? exhibits.find((exhibit) => exhibit.id === "steered")!, link);
  // `lean-yaw view --walk FILE` serves the file beside the page
  if (link.walk) {
    const address = new URL(link.walk, location.href);
    const response = address.origin === location.origin ? await fetch(address) : Response.error();
    if (!response.ok) throw new Error(`The walk ${link.walk} could not be read.`);
    openWalk(parseWalk(await response.text()));
  }

  const observer = new ResizeObserver(() => {
    stage.resize();
    active.resize();
  });
  observer.observe(canvas);

  let last = performance.now();
  function frame(now: number): void {
    const real = Math.min(Math.max(now - last, 0) / 1000, LONGEST_FRAME);
    if (!document.hidden && !held) stage.adapt(now - last);
    last = now;
    requestAnimationFrame(frame);
    if (held) return;
    frames.begin();
    if (playing || active.isMoving || stage.isTurning) active.frame(playing ? real * rate * active.timeScale() : 0, real);
    if (stage.renderIfStale()) labels.update(active.names());
    frames.end();
  }
  requestAnimationFrame(frame);
  document.documentElement.dataset.ready = "true";
  // For tests, and for whoever wants to look closer from the console
  const tasks = { load: () => TaskModule.load(kernel), loadPolicy, agentIndex, LinearAgent };
  const look = { kernel, stage, tasks, exhibits, active: () => active, frames, units, makeGif, ready: performance.now() - began };
  Object.assign(window, { leanYaw: look });
}

main().catch((error: Error) => {
  byId("notice").replaceChildren(h("div", { class: "card fall" }, h("strong", {}, "The page could not start. "), error.message));
  throw error;
});

// Links, tables and films to take away, and walks from files to look at.

import { download, parseWalk, type SavedWalk } from "../share/files";
import { makeGif, VideoRecorder } from "../share/film";
import { copyLink } from "../share/link";
import { h, section } from "./dom";

const GIF_SECONDS = 4;

export interface ShareActions {
  /** The steps of the walk as a table; null where there is no walk. */
  table(): string | null;
  open(walk: SavedWalk): void;
  /** Let a duration pass and draw, apart from the page's own clock. */
  next(duration: number): void;
  /** Stop and start the page's own clock. */
  hold(held: boolean): void;
}

export class SharePanel {
  private readonly words = h("p", { class: "note", role: "status", id: "share-status" });
  private readonly tableButton = this.button("Steps as a table (CSV)", "share-csv", () => this.saveTable());
  private readonly filmButton = this.button("Record a film", "share-film", () => this.film());
  private readonly file = h("input", { type: "file", accept: ".json,application/json", id: "share-file", class: "hidden", onchange: () => this.open() });
  private readonly recorder: VideoRecorder;
  readonly element: HTMLElement;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly actions: ShareActions) {
    this.recorder = new VideoRecorder(canvas);
    this.filmButton.disabled = !VideoRecorder.isSupported;
    this.element = section("Take it with you", false,
      h("div", { class: "row wrap" },
        this.button("Copy a link to these settings", "share-link", () => this.link()), this.tableButton, this.filmButton,
        this.button(`GIF of the next ${GIF_SECONDS} seconds`, "share-gif", () => this.gif()),
        h("label", { class: "button small", for: "share-file", tabindex: 0 }, "Open a walk saved by Python"), this.file),
      this.words,
      h("p", { class: "note" }, "In Python: ", h("code", {}, 'walker.walk(100, state=gait.state).save("walk.json")')));
  }

  private button(name: string, id: string, act: () => void): HTMLButtonElement {
    return h("button", { type: "button", class: "small", id, onclick: act }, name);
  }

  setWalk(isWalk: boolean): void {
    this.tableButton.disabled = !isWalk;
  }

  private say(words: string): void {
    this.words.textContent = words;
  }

  private async link(): Promise<void> {
    this.say((await copyLink()) ? "Copied." : "Copy the page's address: it holds all settings.");
  }

  private saveTable(): void {
    const table = this.actions.table();
    if (table) download("walk.csv", new Blob([table], { type: "text/csv" }));
  }

  private async film(): Promise<void> {
    if (this.recorder.isRecording) {
      this.filmButton.textContent = "Record a film";
      const { name, film } = await this.recorder.stop();
      download(name, film);
      this.say("The film is saved.");
      return;
    }
    this.recorder.start();
    this.filmButton.textContent = "Stop and save the film";
    this.say("Recording what you see.");
  }

  private async gif(): Promise<void> {
    this.actions.hold(true);
    try {
      const film = await makeGif(this.canvas, GIF_SECONDS, this.actions.next, (share) => this.say(`GIF: ${Math.round(100 * share)} %`));
      download("walk.gif", film);
      this.say("The GIF is saved.");
    } finally {
      this.actions.hold(false);
    }
  }

  private async open(): Promise<void> {
    const file = this.file.files?.[0];
    if (!file) return;
    try {
      this.actions.open(parseWalk(await file.text()));
      this.say(`${file.name} is being walked.`);
    } catch (error) {
      this.say((error as Error).message);
    }
    this.file.value = "";
  }
}

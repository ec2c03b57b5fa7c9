// Films of the stage: a video of what is seen, or a GIF of the next seconds at even times.

import { applyPalette, GIFEncoder, quantize } from "gifenc";
import { h } from "../ui/dom";

const TYPES = ["video/mp4;codecs=avc1.42E01E", "video/webm;codecs=vp9", "video/webm"];
const GIF_WIDTH = 480;
const GIF_RATE = 20; // frames a second
const COLOURS = 128;

/** Records the canvas as it is seen. */
export class VideoRecorder {
  private recorder: MediaRecorder | null = null;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  static get isSupported(): boolean {
    return typeof MediaRecorder !== "undefined" && TYPES.some((type) => MediaRecorder.isTypeSupported(type));
  }

  get isRecording(): boolean {
    return this.recorder !== null;
  }

  start(): void {
    const type = TYPES.find((each) => MediaRecorder.isTypeSupported(each));
    this.recorder = new MediaRecorder(this.canvas.captureStream(60), { mimeType: type, videoBitsPerSecond: 8_000_000 });
    this.recorder.start(500);
  }

  /** The film, with its name. */
  stop(): Promise<{ name: string; film: Blob }> {
    const recorder = this.recorder!;
    this.recorder = null;
    const parts: Blob[] = [];
    return new Promise((resolve) => {
      recorder.ondataavailable = ({ data }) => parts.push(data);
      recorder.onstop = () => {
        const ending = recorder.mimeType.includes("mp4") ? "mp4" : "webm";
        recorder.stream.getTracks().forEach((track) => track.stop());
        resolve({ name: `walk.${ending}`, film: new Blob(parts, { type: recorder.mimeType }) });
      };
      recorder.stop();
    });
  }
}

/**
 * A GIF of `seconds`. `next` lets a duration pass and draws the canvas anew; `onProgress` hears of the share done.
 */
export async function makeGif(
  canvas: HTMLCanvasElement, seconds: number, next: (duration: number) => void, onProgress: (share: number) => void,
): Promise<Blob> {
  const width = Math.min(GIF_WIDTH, canvas.clientWidth);
  const height = Math.round((width * canvas.height) / canvas.width);
  const small = h("canvas", { width, height });
  const pen = small.getContext("2d", { willReadFrequently: true })!;
  pen.imageSmoothingQuality = "high";
  const encoder = GIFEncoder();
  const frames = Math.round(seconds * GIF_RATE);
  let palette: number[][] | null = null;
  for (let k = 0; k < frames; k++) {
    next(1 / GIF_RATE);
    pen.drawImage(canvas, 0, 0, width, height);
    const { data } = pen.getImageData(0, 0, width, height);
    palette ??= quantize(data, COLOURS); // one for all frames: colours do not flicker
    encoder.writeFrame(applyPalette(data, palette), width, height, { palette: k === 0 ? palette : undefined, delay: 1000 / GIF_RATE });
    onProgress((k + 1) / frames);
    await new Promise((resolve) => setTimeout(resolve, 0));
  }
  encoder.finish();
  return new Blob([encoder.bytes()], { type: "image/gif" });
}

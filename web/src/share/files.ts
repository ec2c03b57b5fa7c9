// Walks as files: tables out, and walks that Python has saved in.

import type { StepRecord } from "../physics/walk";
import { COORDINATES, type Parameters } from "../physics/walker";
import { h } from "../ui/dom";

export function download(name: string, content: Blob): void {
  const address = URL.createObjectURL(content);
  const link = h("a", { href: address, download: name });
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** A table of steps, one a line, in the package's units. */
export function asTable(records: StepRecord[]): string {
  const head = [
    "step", "start_time", "duration", "stance", "contact_downhill", "contact_right",
    ...COORDINATES, "inter_leg_angle", "previous_offset", "mass_offset",
    "gravity_work", "shift_work", "impact_loss", "ankle_loss", "least_normal_force", "greatest_friction", "fall",
  ]; // prettier-ignore
  const lines = records.map((r) =>
    [
      r.index, r.startTime, r.duration, r.side === 1 ? "left" : "right", ...r.contact, ...r.state.slice(0, 5), r.interLeg,
      r.offsetBefore, r.offset, r.energy.gravity, r.energy.shift, r.energy.impact, r.energy.ankle, r.normalForce, r.frictionDemand,
      r.fall?.name ?? "",
    ].join(","),
  );
  return [head.join(","), ...lines, ""].join("\n");
}

/** What `Walk.save` of the package writes. */
export interface SavedWalk {
  format: "lean-yaw-walk";
  version: 1;
  parameters: Record<string, number | boolean | string>;
  stances: ("left" | "right")[];
  states: number[][];
  inter_leg_angles: number[];
  commanded_offsets: number[];
  mass_offsets: number[];
}

/** Read a saved walk, or throw an error that says what is wrong with it. */
export function parseWalk(text: string): SavedWalk {
  let walk: SavedWalk;
  try {
    walk = JSON.parse(text) as SavedWalk;
  } catch {
    throw new Error("This file is not JSON. Save a walk in Python with walk.save(\"walk.json\").");
  }
  if (walk?.format !== "lean-yaw-walk" || walk.version !== 1) {
    throw new Error("This file is not a walk saved by lean_yaw_env.");
  }
  const n = walk.inter_leg_angles.length;
  const isWhole = walk.states.length >= n && walk.commanded_offsets.length === n && walk.mass_offsets.length >= n;
  if (!n || !isWhole) throw new Error("This walk has no steps, or some of its numbers are missing.");
  return walk;
}

/** The parameters of a saved walk. */
export function parametersOf(walk: SavedWalk): Parameters {
  const saved = walk.parameters;
  const number = (name: string) => (saved[name] === "inf" ? Infinity : Number(saved[name]));
  return {
    hip_width: number("hip_width"),
    foot_radius: number("foot_radius"),
    ankle_tilt: number("ankle_tilt"),
    slope: number("slope"),
    ankle_stiffness: number("ankle_stiffness"),
    ankle_damping: number("ankle_damping"),
    slope_turns: saved.slope_turns === true,
    inter_leg_angle: walk.inter_leg_angles[0],
    mass_offset: 0,
    more: {
      shift_time: number("shift_time"),
      friction_limit: number("friction_limit"),
      max_step_duration: number("max_step_duration"),
      strike_at_start: saved.early_contact === "strike" ? 1 : 0,
    },
  };
}

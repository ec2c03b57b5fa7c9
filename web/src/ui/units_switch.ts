// Dimensionless numbers, or SI for a leg length and a gravity of choice.

import type { Settings } from "../share/link";
import { EARTH, units, WORLDS } from "../share/units";
import { h } from "./dom";

export class UnitsSwitch {
  private readonly system: HTMLSelectElement;
  private readonly leg: HTMLInputElement;
  private readonly legBox: HTMLElement;

  constructor(place: HTMLElement, private readonly onChange: () => void) {
    this.system = h(
      "select", { id: "units-system", "aria-label": "Units of all numbers", onchange: () => this.take() },
      h("option", { value: "none" }, "No units (leg, gravity, mass = 1)"),
      ...Object.keys(WORLDS).map((world) => h("option", { value: world }, `SI, on ${world === "moon" ? "the moon" : world === "earth" ? "earth" : "Mars"}`)),
    );
    this.leg = h("input", { type: "number", id: "units-leg", min: 0.05, max: 10, step: 0.05, value: 1, oninput: () => this.take() });
    this.legBox = h("label", { for: "units-leg", hidden: true }, "leg ", this.leg, " m");
    place.append(this.system, this.legBox);
  }

  private take(): void {
    units.si = this.system.value !== "none";
    units.gravity = WORLDS[this.system.value] ?? EARTH;
    const leg = Number(this.leg.value);
    units.leg = units.si && leg >= 0.05 && leg <= 10 ? leg : 1;
    this.legBox.hidden = !units.si;
    this.onChange();
  }

  settings(): Settings {
    return units.si ? { units: this.system.value, leg: String(units.leg) } : {};
  }

  restore(settings: Settings): void {
    if (!(settings.units in WORLDS)) return;
    this.system.value = settings.units;
    if (Number(settings.leg) > 0) this.leg.value = settings.leg;
    units.si = true;
    units.gravity = WORLDS[settings.units];
    units.leg = Number(this.leg.value);
    this.legBox.hidden = false;
  }
}

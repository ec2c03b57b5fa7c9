// Numbers in words: dimensionless (leg length, gravity and mass one), or SI for a leg length and a gravity of choice.

import { number } from "../ui/plot";

export interface Units {
  si: boolean;
  /** m. */
  leg: number;
  /** m / s^2. */
  gravity: number;
}

export const EARTH = 9.81;
export const WORLDS: Record<string, number> = { earth: EARTH, moon: 1.62, mars: 3.71 };

export const units: Units = { si: false, leg: 1, gravity: EARTH };

/** Seconds in a unit of time. */
export function timeUnit(): number {
  return Math.sqrt(units.leg / units.gravity);
}

export function length(value: number, digits = 3): string {
  return units.si ? `${number(value * units.leg, digits)} m` : number(value, digits);
}

export function time(value: number, digits = 3): string {
  return units.si ? `${number(value * timeUnit(), digits)} s` : number(value, digits);
}

export function speed(value: number, digits = 3): string {
  return units.si ? `${number((value * units.leg) / timeUnit(), digits)} m/s` : number(value, digits);
}

/** Of weight times leg length; in SI per kilogram. */
export function energy(value: number): string {
  return units.si ? `${number(value * units.gravity * units.leg * 1000, 2)} mJ/kg` : `${number(value * 1000, 3)} × 10⁻³`;
}

export function angle(value: number, digits = 3): string {
  return units.si ? `${number((value * 180) / Math.PI, Math.max(digits - 1, 1))}°` : `${number(value, digits)} rad`;
}

// An arrow that shows a push for a moment.

import * as THREE from "three";
import { PALETTE } from "./palette";

const DURATION = 0.9;

export class PushArrow {
  readonly mesh = new THREE.Group();
  private readonly material = new THREE.MeshStandardMaterial({ color: PALETTE.goal, roughness: 0.5, transparent: true, emissive: PALETTE.goal, emissiveIntensity: 0.25 });
  private left = 0;
  private direction = new THREE.Vector3();

  constructor() {
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.013, 0.013, 0.2, 20), this.material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.036, 0.09, 28), this.material);
    shaft.position.y = -0.19;
    head.position.y = -0.045;
    this.mesh.add(shaft, head);
    this.mesh.visible = false;
  }

  get isShown(): boolean {
    return this.left > 0;
  }

  /** A push to the right (or left, negative) and ahead, in the walker's own directions. */
  show(right: number, ahead: number, strength: number): void {
    this.left = DURATION;
    this.direction.set(ahead, 0, right).normalize();
    this.mesh.scale.setScalar(0.8 + 0.3 * strength);
  }

  place([x, y, z]: [number, number, number], heading: number): void {
    if (this.left <= 0) return;
    const along = this.direction.clone().applyAxisAngle(new THREE.Vector3(0, 1, 0), heading);
    const away = 0.09 + 0.12 * Math.max(this.left / DURATION - 0.75, 0) * 4;
    this.mesh.position.set(x, y, z).addScaledVector(along, -away);
    this.mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
  }

  advance(real: number): void {
    this.left = Math.max(this.left - real, 0);
    this.mesh.visible = this.left > 0;
    this.material.opacity = Math.min(1, (2 * this.left) / DURATION);
  }
}

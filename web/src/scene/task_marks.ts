// What a task asks for, on the floor: a goal, a path, a heading.

import * as THREE from "three";
import { PALETTE } from "./palette";

const PATH_STEP = 0.25;
const PATH_WIDTH = 0.06;
const ARROW_AWAY = 0.55;
const POST = 0.7; // height of a gate's posts

export class TaskMarks {
  readonly group = new THREE.Group();
  private readonly goal = new THREE.Group();
  private readonly arrow: THREE.Mesh;
  private path: THREE.Mesh | null = null;
  private readonly gates = [gate(1), gate(0.45)];
  private goalRadius = 0;

  constructor() {
    this.arrow = new THREE.Mesh(arrowShape(), new THREE.MeshStandardMaterial({ color: PALETTE.command, roughness: 0.6 }));
    this.arrow.castShadow = true;
    this.group.add(this.goal, this.arrow, ...this.gates);
    this.clear();
  }

  setGoal(place: [number, number] | null, radius: number): void {
    this.goal.visible = place !== null;
    if (!place) return;
    if (radius !== this.goalRadius) this.buildGoal(radius);
    this.goal.position.set(place[0], 0, place[1]);
  }

  /** Gates of a race: the next one and the one after it, as wide as walkers must be right. */
  setGates(places: ([number, number] | null)[], halfWidth: number): void {
    this.gates.forEach((mark, k) => {
      const place = places[k];
      mark.visible = Boolean(place);
      if (!place) return;
      mark.position.set(place[0], 0, place[1]);
      mark.scale.set(1, 1, halfWidth);
    });
  }

  private buildGoal(radius: number): void {
    this.goalRadius = radius;
    this.goal.clear();
    const gold = new THREE.MeshStandardMaterial({ color: PALETTE.goal, roughness: 0.4, metalness: 0.2, emissive: PALETTE.goal, emissiveIntensity: 0.15 });
    const ring = new THREE.Mesh(new THREE.TorusGeometry(radius, 0.022, 16, 96).rotateX(0.5 * Math.PI), gold);
    ring.position.y = 0.02;
    ring.castShadow = true;
    const disk = new THREE.Mesh(
      new THREE.CircleGeometry(radius, 64).rotateX(-0.5 * Math.PI),
      new THREE.MeshBasicMaterial({ color: PALETTE.goal, transparent: true, opacity: 0.22, depthWrite: false }),
    );
    disk.position.y = 0.004;
    // a beam that is seen from afar
    const beam = new THREE.Mesh(
      new THREE.CylinderGeometry(0.03, 0.03, 7, 20, 1, true).translate(0, 3.5, 0),
      new THREE.MeshBasicMaterial({ color: PALETTE.goal, transparent: true, opacity: 0.35, depthWrite: false, side: THREE.DoubleSide }),
    );
    this.goal.add(ring, disk, beam);
  }

  /** The heading asked for, as an arrow before the walker; null for none. */
  setHeading(heading: number | null, at: [number, number]): void {
    this.arrow.visible = heading !== null;
    if (heading === null) return;
    this.arrow.position.set(at[0] + ARROW_AWAY * Math.cos(heading), 0.012, at[1] - ARROW_AWAY * Math.sin(heading));
    this.arrow.rotation.y = heading;
  }

  /** A path from `first` to `last` downhill; `right` tells how far to the right it is. */
  setPath(right: ((downhill: number) => number) | null, first = 0, last = 0): void {
    this.path?.geometry.dispose();
    this.path?.removeFromParent();
    this.path = null;
    if (!right) return;
    const n = Math.ceil((last - first) / PATH_STEP) + 1;
    const points = new Float32Array(n * 6);
    const index: number[] = [];
    for (let k = 0; k < n; k++) {
      const x = first + k * PATH_STEP;
      const z = right(x);
      const slope = (right(x + 1e-3) - right(x - 1e-3)) / 2e-3;
      const [nx, nz] = [-slope, 1].map((value) => (PATH_WIDTH * value) / Math.hypot(slope, 1));
      points.set([x - nx, 0.003, z - nz, x + nx, 0.003, z + nz], 6 * k);
      if (k < n - 1) index.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 2, 2 * k + 1, 2 * k + 3);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    geometry.setIndex(index);
    const material = new THREE.MeshBasicMaterial({ color: PALETTE.reference, transparent: true, opacity: 0.5, depthWrite: false, side: THREE.DoubleSide });
    this.path = new THREE.Mesh(geometry, material);
    this.path.frustumCulled = false;
    this.path.renderOrder = 1;
    this.group.add(this.path);
  }

  clear(): void {
    this.setGoal(null, 0);
    this.setGates([], 1);
    this.setHeading(null, [0, 0]);
    this.setPath(null);
  }
}

/** Two posts, 1 to either side, and a stripe between them on the floor. */
function gate(opacity: number): THREE.Group {
  const group = new THREE.Group();
  const material = new THREE.MeshStandardMaterial({ color: PALETTE.goal, roughness: 0.4, emissive: PALETTE.goal, emissiveIntensity: 0.2, transparent: opacity < 1, opacity });
  for (const side of [-1, 1]) {
    const post = new THREE.Mesh(new THREE.CylinderGeometry(0.025, 0.025, POST, 20).translate(0, 0.5 * POST, side), material);
    post.castShadow = opacity === 1;
    group.add(post);
  }
  const stripe = new THREE.Mesh(
    new THREE.PlaneGeometry(0.05, 2).rotateX(-0.5 * Math.PI).translate(0, 0.004, 0),
    new THREE.MeshBasicMaterial({ color: PALETTE.goal, transparent: true, opacity: 0.6 * opacity, depthWrite: false }),
  );
  const flag = new THREE.Mesh(
    new THREE.PlaneGeometry(2, 0.12).rotateY(0.5 * Math.PI).translate(0, POST - 0.06, 0),
    new THREE.MeshBasicMaterial({ color: PALETTE.goal, transparent: true, opacity: 0.55 * opacity, depthWrite: false, side: THREE.DoubleSide }),
  );
  group.add(stripe, flag);
  return group;
}

/** A flat arrow along x. */
function arrowShape(): THREE.BufferGeometry {
  const shape = new THREE.Shape();
  shape.moveTo(0, -0.02);
  for (const [x, y] of [[0.22, -0.02], [0.22, -0.065], [0.36, 0], [0.22, 0.065], [0.22, 0.02], [0, 0.02]]) shape.lineTo(x, y);
  return new THREE.ExtrudeGeometry(shape, { depth: 0.012, bevelEnabled: false }).rotateX(-0.5 * Math.PI);
}

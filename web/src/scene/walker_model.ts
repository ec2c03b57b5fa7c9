// The walker in three dimensions: telescopic legs, cylinder feet on tilted ankle axes, and masses that slide on the axle.

import * as THREE from "three";
import { halfArc, type Frame, type LegShape, type Vector, type WalkerShape } from "../physics/geometry";
import type { Parameters } from "../physics/walker";
import { PALETTE } from "./palette";

const FOOT_WIDTH = 0.08;
const BAND = 0.02;
const AXIS_ABOVE = 0.25;
const AXIS_BELOW = 0.035;
const UPPER = 0.5;
const MASS = 0.051;
const AXLE_END = 0.115;
const GHOST = 0.42; // opacity

interface LegParts {
  upper: THREE.Group;
  lower: THREE.Group;
  foot: THREE.Group;
}

export class WalkerModel {
  readonly group = new THREE.Group();
  private readonly left: LegParts;
  private readonly right: LegParts;
  private readonly axle = new THREE.Group();
  private readonly masses: THREE.Mesh[];
  private readonly centre = centreMark();
  private readonly materials = makeMaterials();
  private built = "";

  /** `tint` paints both legs, to tell several walkers apart; a ghost is seen through, and casts no shadow. */
  constructor(tint?: string, private readonly isGhost = false) {
    if (isGhost) for (const material of Object.values(this.materials)) [material.transparent, material.opacity] = [true, GHOST];
    if (tint) {
      this.materials.left.color.set(tint);
      this.materials.right.color.set(tint).offsetHSL(0, 0, 0.12);
    }
    this.left = emptyLeg();
    this.right = emptyLeg();
    const ball = new THREE.SphereGeometry(MASS, 40, 28);
    const band = new THREE.TorusGeometry(MASS * 0.985, 0.0045, 12, 48).rotateY(0.5 * Math.PI).rotateY(0.5 * Math.PI);
    this.masses = [0, 1].map(() => {
      const mass = new THREE.Mesh(ball, this.materials.mass);
      mass.add(new THREE.Mesh(band, this.materials.brass));
      return mass;
    });
    for (const leg of [this.left, this.right]) this.group.add(leg.upper, leg.lower, leg.foot);
    this.group.add(this.axle, ...this.masses);
    if (!isGhost) this.group.add(this.centre);
  }

  update(p: Parameters, shape: WalkerShape): void {
    const key = `${p.hip_width} ${p.foot_radius} ${p.ankle_tilt}`;
    if (key !== this.built) {
      this.built = key;
      this.build(p);
    }
    place(this.left, shape.left);
    place(this.right, shape.right);
    setFrame(this.axle, shape.left.leg, mid(shape.left.hip, shape.right.hip));
    shape.masses.forEach((mass, k) => setFrame(this.masses[k], shape.left.leg, mass));
    setFrame(this.centre, shape.left.leg, shape.centre);
    this.centre.visible = p.hip_width > 2.6 * MASS;
  }

  dispose(): void {
    this.group.removeFromParent();
    this.group.traverse((object) => object instanceof THREE.Mesh && object.geometry.dispose());
    Object.values(this.materials).forEach((material) => material.dispose());
  }

  private build(p: Parameters): void {
    buildLeg(this.left, p, this.materials.left, this.materials);
    buildLeg(this.right, p, this.materials.right, this.materials);
    clear(this.axle);
    const length = p.hip_width + 2 * AXLE_END;
    const rod = tube(0.0105, length, this.materials.steel).rotateX(0.5 * Math.PI);
    this.axle.add(rod);
    for (const side of [-1, 1]) {
      const cap = new THREE.Mesh(new THREE.SphereGeometry(0.0165, 20, 14), this.materials.dark);
      cap.position.z = 0.5 * side * length;
      this.axle.add(cap);
    }
    if (!this.isGhost) shadowed(this.group);
  }
}

type Materials = ReturnType<typeof makeMaterials>;

function makeMaterials() {
  const paint = (color: string) =>
    new THREE.MeshPhysicalMaterial({ color, roughness: 0.38, metalness: 0.05, clearcoat: 0.7, clearcoatRoughness: 0.22 });
  return {
    left: paint(PALETTE.left),
    right: paint(PALETTE.right),
    axis: paint(PALETTE.axis),
    steel: new THREE.MeshStandardMaterial({ color: PALETTE.steel, roughness: 0.24, metalness: 0.95 }),
    dark: new THREE.MeshStandardMaterial({ color: PALETTE.ink, roughness: 0.5, metalness: 0.35 }),
    rubber: new THREE.MeshStandardMaterial({ color: "#33343a", roughness: 0.92 }),
    mass: new THREE.MeshPhysicalMaterial({ color: "#4a4e59", roughness: 0.28, metalness: 0.65, clearcoat: 0.9, clearcoatRoughness: 0.12 }),
    brass: new THREE.MeshStandardMaterial({ color: "#c9a35b", roughness: 0.3, metalness: 1 }),
  };
}

function emptyLeg(): LegParts {
  return { upper: new THREE.Group(), lower: new THREE.Group(), foot: new THREE.Group() };
}

function mid(a: Vector, b: Vector): Vector {
  return [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])];
}

export function setFrame(object: THREE.Object3D, [x, y, z]: Frame, at: Vector): void {
  object.matrixAutoUpdate = false;
  object.matrix.set(x[0], y[0], z[0], at[0], x[1], y[1], z[1], at[1], x[2], y[2], z[2], at[2], 0, 0, 0, 1);
  object.matrixWorldNeedsUpdate = true;
}

function place(parts: LegParts, shape: LegShape): void {
  setFrame(parts.upper, shape.leg, shape.hip);
  setFrame(parts.lower, shape.leg, shape.ankle);
  setFrame(parts.foot, shape.foot, shape.ankle);
}

function clear(group: THREE.Group): void {
  for (const child of [...group.children]) {
    child.traverse((object) => object instanceof THREE.Mesh && object.geometry.dispose());
    child.removeFromParent();
  }
}

function shadowed(group: THREE.Group): void {
  group.traverse((object) => {
    if (object instanceof THREE.Mesh) object.castShadow = object.receiveShadow = true;
  });
}

function tube(radius: number, length: number, material: THREE.Material, top = radius): THREE.Mesh {
  return new THREE.Mesh(new THREE.CylinderGeometry(top, radius, length, 28), material);
}

/** A rod between two points. */
export function strut(from: THREE.Vector3, to: THREE.Vector3, radius: number, material: THREE.Material): THREE.Mesh {
  const along = to.clone().sub(from);
  const mesh = tube(radius, along.length(), material);
  mesh.position.copy(from).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.normalize());
  return mesh;
}

function buildLeg(parts: LegParts, p: Parameters, paint: THREE.Material, m: Materials): void {
  [parts.upper, parts.lower, parts.foot].forEach(clear);
  // Upper leg: a turned shell, from the hip's bearing down to the collar
  const profile = [
    [0.0, 0.036], [0.024, 0.034], [0.036, 0.02], [0.037, -0.03], [0.0345, -0.12], [0.0275, -0.34], [0.0235, -UPPER + 0.02],
    [0.0225, -UPPER], [0.0, -UPPER],
  ].map(([x, y]) => new THREE.Vector2(x, y)); // prettier-ignore
  const shell = new THREE.Mesh(new THREE.LatheGeometry(profile.reverse(), 36), paint);
  const bearing = tube(0.031, 0.088, m.dark).rotateX(0.5 * Math.PI);
  const ring = tube(0.035, 0.05, paint).rotateX(0.5 * Math.PI);
  const collar = tube(0.0245, 0.022, m.steel);
  collar.position.y = -UPPER - 0.004;
  parts.upper.add(shell, bearing, ring, collar);

  // Lower leg: a steel tube that slides in it, painted where it ends at the ankle
  const shin = tube(0.0135, 1 - UPPER + 0.12, m.steel);
  shin.position.y = 0.5 * (1 - UPPER + 0.12) + 0.05;
  const boot = tube(0.0135, 0.15, paint, 0.021);
  boot.position.y = 0.1;
  const tip = new THREE.Mesh(new THREE.SphereGeometry(0.0165, 20, 16), m.dark);
  tip.position.y = 0.024;
  parts.lower.add(shin, boot, tip);

  // The ankle axis: a rod fixed to the foot, in two eyes of the leg
  const axis = new THREE.Vector3(Math.sin(p.ankle_tilt), -Math.cos(p.ankle_tilt), 0);
  const origin = new THREE.Vector3(0, 0.012, 0);
  const top = origin.clone().addScaledVector(axis, -AXIS_ABOVE);
  const bottom = origin.clone().addScaledVector(axis, AXIS_BELOW);
  const knob = () => new THREE.Mesh(new THREE.SphereGeometry(0.0135, 20, 14), m.axis);
  const upperKnob = knob();
  upperKnob.position.copy(top);
  parts.foot.add(strut(bottom, top, 0.0072, m.axis), upperKnob);
  const eye = origin.clone().addScaledVector(axis, -0.8 * AXIS_ABOVE);
  const arm = strut(new THREE.Vector3(0, Math.max(eye.y, 0.06) + 0.02, 0), eye, 0.0062, paint);
  const sleeve = strut(
    eye.clone().addScaledVector(axis, -0.016), eye.clone().addScaledVector(axis, 0.016), 0.0125, m.dark,
  );
  parts.lower.add(arm, sleeve);
  buildFoot(parts.foot, p, top, paint, m);
}

function buildFoot(foot: THREE.Group, p: Parameters, axisTop: THREE.Vector3, paint: THREE.Material, m: Materials): void {
  const r = p.foot_radius;
  const reach = halfArc(r);
  if (r < 0.035) {
    const nub = new THREE.Mesh(new THREE.CylinderGeometry(Math.max(r, 0.012), Math.max(r, 0.012), 0.05, 24).rotateX(0.5 * Math.PI), m.rubber);
    nub.position.y = Math.max(r, 0.012);
    foot.add(nub);
    return;
  }
  const thick = Math.min(BAND, 0.6 * r);
  const tread = Math.min(0.007, 0.3 * thick);
  const sole = band(r, r - tread, reach, FOOT_WIDTH, m.rubber);
  const shell = band(r - tread, r - thick, reach - 0.004 / r, FOOT_WIDTH - 0.008, paint);
  for (const part of [sole, shell]) part.position.y = r;
  foot.add(sole, shell);
  // A block under the leg, and struts from the heel to the axis' upper end
  const block = new THREE.Mesh(new THREE.BoxGeometry(0.052, 0.03, 0.05), m.dark);
  block.position.y = thick + 0.006;
  foot.add(block);
  const angle = -0.86 * reach;
  const heel = new THREE.Vector3((r - thick) * Math.sin(angle), r - (r - thick) * Math.cos(angle), 0);
  if (axisTop.y > heel.y + 0.03) {
    for (const z of [-0.024, 0.024]) foot.add(strut(heel.clone().setZ(z), axisTop, 0.0048, m.steel));
  }
}

/** A piece of a cylinder's shell about its own axis, the lowest line in the middle. */
function band(outer: number, inner: number, reach: number, width: number, material: THREE.Material): THREE.Mesh {
  const shape = new THREE.Shape();
  const down = -0.5 * Math.PI;
  shape.absarc(0, 0, outer, down - reach, down + reach, false);
  shape.absarc(0, 0, inner, down + reach, down - reach, true);
  shape.closePath();
  const geometry = new THREE.ExtrudeGeometry(shape, { depth: width, bevelEnabled: false, curveSegments: 40 });
  geometry.translate(0, 0, -0.5 * width);
  return new THREE.Mesh(geometry, material);
}

/** The mark of a centre of mass: a ball in quarters. */
function centreMark(): THREE.Mesh {
  const geometry = new THREE.SphereGeometry(0.027, 32, 24).toNonIndexed();
  const position = geometry.getAttribute("position");
  const colours = new Float32Array(position.count * 3);
  const light = new THREE.Color("#f7f4ea");
  const dark = new THREE.Color(PALETTE.ink);
  for (let i = 0; i < position.count; i += 3) {
    const sum = [0, 1, 2].map((k) => [position.getX(i + k), position.getY(i + k), position.getZ(i + k)]);
    const [x, y, z] = [0, 1, 2].map((k) => sum[0][k] + sum[1][k] + sum[2][k]);
    const colour = x * y * z > 0 ? light : dark;
    for (let k = 0; k < 3; k++) colour.toArray(colours, 3 * (i + k));
  }
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  return new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.4 }));
}

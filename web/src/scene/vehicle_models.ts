// A bicycle and a skateboard with their riders, in metres; x ahead, y up, z to the right.

import * as THREE from "three";
import type { BicycleParameters, SkateboardParameters } from "../physics/vehicles";
import { PALETTE } from "./palette";
import { strut } from "./walker_model";

const V = (x: number, y: number, z = 0) => new THREE.Vector3(x, y, z);

function materials() {
  const paint = (color: string) => new THREE.MeshPhysicalMaterial({ color, roughness: 0.36, metalness: 0.05, clearcoat: 0.7, clearcoatRoughness: 0.2 });
  return {
    frame: paint(PALETTE.left),
    front: paint(PALETTE.right),
    axis: paint(PALETTE.axis),
    rider: new THREE.MeshStandardMaterial({ color: "#e3ddd0", roughness: 0.75 }),
    riderDark: new THREE.MeshStandardMaterial({ color: "#b9b2a3", roughness: 0.8 }),
    rubber: new THREE.MeshStandardMaterial({ color: "#2f3035", roughness: 0.9 }),
    steel: new THREE.MeshStandardMaterial({ color: PALETTE.steel, roughness: 0.28, metalness: 0.95 }),
    dark: new THREE.MeshStandardMaterial({ color: PALETTE.ink, roughness: 0.5, metalness: 0.3 }),
    deck: new THREE.MeshPhysicalMaterial({ color: "#c79b63", roughness: 0.5, clearcoat: 0.4 }),
    wheel: paint("#f2efe6"),
  };
}

type Materials = ReturnType<typeof materials>;

function shadowed<Thing extends THREE.Object3D>(thing: Thing): Thing {
  thing.traverse((object) => {
    if (object instanceof THREE.Mesh) object.castShadow = object.receiveShadow = true;
  });
  return thing;
}

export function disposeModel(group: THREE.Object3D): void {
  group.removeFromParent();
  group.traverse((object) => (object instanceof THREE.Mesh || object instanceof THREE.LineSegments) && object.geometry.dispose());
}

/** A limb with round ends. */
function limb(from: THREE.Vector3, to: THREE.Vector3, radius: number, material: THREE.Material): THREE.Mesh {
  const along = to.clone().sub(from);
  const mesh = new THREE.Mesh(new THREE.CapsuleGeometry(radius, along.length(), 10, 24), material);
  mesh.position.copy(from).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(V(0, 1, 0), along.normalize());
  return mesh;
}

function ball(at: THREE.Vector3, radius: number, material: THREE.Material): THREE.Mesh {
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(radius, 32, 24), material);
  mesh.position.copy(at);
  return mesh;
}

/** A spoked wheel that turns about z. */
function spokedWheel(radius: number, m: Materials): THREE.Group {
  const wheel = new THREE.Group();
  const tyre = new THREE.Mesh(new THREE.TorusGeometry(radius - 0.016, 0.016, 16, 96), m.rubber);
  const rim = new THREE.Mesh(new THREE.TorusGeometry(radius - 0.04, 0.009, 10, 96), m.steel);
  const hub = new THREE.Mesh(new THREE.CylinderGeometry(0.02, 0.02, 0.07, 24).rotateX(0.5 * Math.PI), m.dark);
  wheel.add(tyre, rim, hub);
  for (let k = 0; k < 24; k++) {
    const angle = (2 * Math.PI * k) / 24;
    const side = k % 2 ? 0.022 : -0.022;
    const lean = angle + (k % 4 < 2 ? 0.22 : -0.22);
    const from = V(0.018 * Math.cos(lean), 0.018 * Math.sin(lean), side);
    const to = V((radius - 0.045) * Math.cos(angle), (radius - 0.045) * Math.sin(angle), 0);
    wheel.add(strut(from, to, 0.0013, m.steel));
  }
  return wheel;
}

export class BicycleModel {
  readonly group = new THREE.Group();
  private readonly leaning = new THREE.Group();
  private readonly front = new THREE.Group();
  private readonly turned = new THREE.Group();
  private readonly rear: THREE.Group;
  private readonly ahead: THREE.Group;

  constructor(readonly p: BicycleParameters) {
    const m = materials();
    const { wheelbase: w, trail: c, steer_axis_tilt: tilt } = p;
    const [rr, rf] = [p.rear_wheel.radius, p.front_wheel.radius];
    this.rear = spokedWheel(rr, m);
    this.rear.position.set(0, rr, 0);
    // The steer axis meets the floor a trail ahead of the front contact
    const foot = V(w + c, 0);
    const up = V(-Math.sin(tilt), Math.cos(tilt));
    const along = (s: number) => foot.clone().addScaledVector(up, s);
    const [headLow, headHigh] = [along(0.72), along(0.9)];
    const crank = V(0.43, 0.27);
    const seat = V(0.2, 0.86);
    const tubes: [THREE.Vector3, THREE.Vector3, number][] = [
      [crank, seat.clone().lerp(crank, -0.02), 0.016], [seat.clone().lerp(crank, 0.08), along(0.87), 0.015],
      [crank, along(0.75), 0.019], [headLow, headHigh, 0.021],
    ]; // prettier-ignore
    for (const z of [-0.045, 0.045]) {
      tubes.push([V(0, rr, z), crank, 0.009], [V(0, rr, z), seat.clone().lerp(crank, 0.12), 0.008]);
    }
    this.leaning.add(this.rear, ...tubes.map(([from, to, radius]) => strut(from, to, radius, m.frame)));
    this.leaning.add(saddle(seat, m), cranks(crank, m), bicycleRider(seat, crank, along(1.06).add(V(0.02, 0.02)), m));
    // the axis itself, to be seen
    this.leaning.add(strut(along(-0.02), along(0.7), 0.0042, m.axis), strut(along(0.92), along(1.3), 0.0042, m.axis));

    // Front frame: everything that the handlebar turns, about an origin on the axis
    this.turned.position.copy(foot);
    this.turned.quaternion.setFromUnitVectors(V(0, 1, 0), up);
    const inverse = this.turned.quaternion.clone().invert();
    const local = (point: THREE.Vector3) => point.clone().sub(foot).applyQuaternion(inverse);
    this.ahead = spokedWheel(rf, m);
    const axle = V(w, rf);
    const wheel = new THREE.Group();
    wheel.position.copy(local(axle));
    wheel.quaternion.copy(inverse);
    wheel.add(this.ahead);
    this.front.add(wheel);
    const crown = along(0.7);
    for (const z of [-0.05, 0.05]) this.front.add(strut(local(V(w, rf, z)), local(crown.clone().setZ(0.8 * z)), 0.011, m.front));
    this.front.add(strut(local(crown.clone().setZ(-0.05)), local(crown.clone().setZ(0.05)), 0.014, m.front));
    const stem = along(1.0);
    this.front.add(strut(local(headHigh), local(stem), 0.013, m.steel));
    const bar = stem.clone().add(V(0.05, 0.03));
    this.front.add(strut(local(stem), local(bar), 0.013, m.steel));
    for (const z of [-1, 1]) {
      const bend = bar.clone().add(V(0.0, 0.0, 0.14 * z));
      const grip = bar.clone().add(V(-0.11, 0.02, 0.25 * z));
      this.front.add(strut(local(bar), local(bend), 0.011, m.steel), strut(local(bend), local(grip), 0.011, m.steel));
      this.front.add(strut(local(grip), local(grip.clone().add(V(-0.1, 0.0, 0.015 * z))), 0.017, m.rubber));
    }
    this.turned.add(this.front);
    this.leaning.add(this.turned);
    this.group.add(this.leaning);
    shadowed(this.group);
  }

  /** Rear contact on the floor, heading to the left, lean and steer to the right, and the way rolled. */
  update(x: number, z: number, heading: number, lean: number, steer: number, rolled: number): void {
    this.group.position.set(x, 0, z);
    this.group.rotation.y = heading;
    this.leaning.rotation.x = lean;
    this.front.rotation.y = -steer;
    this.rear.rotation.z = -rolled / this.p.rear_wheel.radius;
    this.ahead.rotation.z = -rolled / this.p.front_wheel.radius;
  }
}

function saddle(seat: THREE.Vector3, m: Materials): THREE.Object3D {
  const top = new THREE.Mesh(new THREE.CapsuleGeometry(0.045, 0.16, 8, 20), m.dark);
  top.rotation.z = 0.5 * Math.PI;
  top.scale.set(0.55, 1, 1.1);
  top.position.copy(seat).add(V(0.0, 0.055));
  return top;
}

function cranks(at: THREE.Vector3, m: Materials): THREE.Object3D {
  const group = new THREE.Group();
  const ring = new THREE.Mesh(new THREE.TorusGeometry(0.085, 0.007, 10, 48), m.dark);
  ring.position.copy(at).setZ(0.055);
  group.add(ring);
  for (const side of [-1, 1]) {
    const from = at.clone().setZ(0.075 * side);
    const to = from.clone().add(V(0.12 * side, -0.11 * side, 0));
    group.add(strut(from, to, 0.009, m.steel));
    const pedal = new THREE.Mesh(new THREE.BoxGeometry(0.09, 0.018, 0.08), m.dark);
    pedal.position.copy(to).add(V(0, 0, 0.045 * side));
    group.add(pedal);
  }
  return group;
}

/** A rider who sits still: the model's rear frame carries him. */
function bicycleRider(seat: THREE.Vector3, crank: THREE.Vector3, hands: THREE.Vector3, m: Materials): THREE.Object3D {
  const group = new THREE.Group();
  const hip = seat.clone().add(V(0.0, 0.13));
  const chest = V(0.42, 1.34);
  const neck = V(0.49, 1.47);
  group.add(limb(hip, chest, 0.105, m.rider), ball(V(0.55, 1.62), 0.098, m.rider), limb(chest, neck, 0.05, m.rider));
  for (const side of [-1, 1]) {
    const shoulder = V(0.45, 1.38, 0.17 * side);
    const hand = V(hands.x - 0.04, hands.y + 0.0, 0.255 * side);
    const elbow = shoulder.clone().lerp(hand, 0.5).add(V(-0.05, -0.05, 0.05 * side));
    group.add(limb(chest.clone().setZ(0.06 * side), shoulder, 0.06, m.rider));
    group.add(limb(shoulder, elbow, 0.043, m.rider), limb(elbow, hand, 0.035, m.riderDark));
    const foot = crank.clone().add(V(0.12 * side, -0.11 * side + 0.05, 0.12 * side));
    const thigh = hip.clone().add(V(0.03, -0.02, 0.095 * side));
    const knee = thigh.clone().lerp(foot, 0.5).add(V(0.2 + 0.03 * side, 0.1));
    group.add(limb(thigh, knee, 0.068, m.riderDark), limb(knee, foot, 0.047, m.riderDark));
    group.add(limb(foot.clone().add(V(-0.05, -0.02)), foot.clone().add(V(0.12, -0.03)), 0.034, m.dark));
  }
  return group;
}

export class SkateboardModel {
  readonly group = new THREE.Group();
  private readonly leaning = new THREE.Group();
  private readonly trucks: THREE.Group[] = [];
  private readonly wheels: THREE.Mesh[] = [];

  constructor(readonly p: SkateboardParameters) {
    const m = materials();
    const radius = 0.034;
    const deckHeight = 0.105;
    const half = 0.5 * p.wheelbase;
    this.leaning.add(deck(half + 0.17, deckHeight, m), boardRider(deckHeight + 0.012, p.rider_height, m));
    // a belt at the height of the point mass
    const belt = new THREE.Mesh(new THREE.TorusGeometry(0.112, 0.012, 14, 48).rotateX(0.5 * Math.PI), m.axis);
    belt.position.y = p.rider_height;
    this.leaning.add(belt);
    for (const end of [1, -1]) {
      const truck = new THREE.Group();
      truck.position.set(end * half, radius, 0);
      truck.add(strut(V(0, 0, -0.12), V(0, 0, 0.12), 0.009, m.steel));
      for (const z of [-0.105, 0.105]) {
        const wheel = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, 0.045, 36).rotateX(0.5 * Math.PI), m.wheel);
        const core = new THREE.Mesh(new THREE.CylinderGeometry(0.014, 0.014, 0.05, 20).rotateX(0.5 * Math.PI), m.dark);
        wheel.position.z = z;
        wheel.add(core);
        const mark = new THREE.Mesh(new THREE.BoxGeometry(0.012, 0.012, 0.047), m.front);
        mark.position.x = 0.7 * radius;
        wheel.add(mark);
        this.wheels.push(wheel);
        truck.add(wheel);
      }
      this.trucks.push(truck);
      this.group.add(truck);
      // the tilted steering axis, leaning towards the board's middle
      const axis = V(-end * Math.sin(p.steering_tilt), Math.cos(p.steering_tilt)).multiplyScalar(0.12);
      const foot = V(end * half, radius);
      this.leaning.add(strut(foot, foot.clone().add(axis), 0.007, m.axis), strut(foot, V(end * half, deckHeight), 0.016, m.steel));
    }
    this.group.add(this.leaning);
    shadowed(this.group);
  }

  /** Middle of the board on the floor, heading to the left, lean to the right, and the way rolled. */
  update(x: number, z: number, heading: number, lean: number, rolled: number): void {
    this.group.position.set(x, 0, z);
    this.group.rotation.y = heading;
    this.leaning.rotation.x = lean;
    const turn = Math.max(-1, Math.min(1, lean / Math.tan(this.p.steering_tilt)));
    this.trucks.forEach((truck, k) => (truck.rotation.y = k === 0 ? -turn : turn));
    for (const wheel of this.wheels) wheel.rotation.z = -rolled / 0.034;
  }
}

function deck(half: number, height: number, m: Materials): THREE.Object3D {
  const shape = new THREE.Shape();
  const [w, r] = [0.1, 0.1];
  shape.moveTo(-half + r, -w);
  shape.lineTo(half - r, -w);
  shape.absarc(half - r, 0, r, -0.5 * Math.PI, 0.5 * Math.PI, false);
  shape.lineTo(-half + r, w);
  shape.absarc(-half + r, 0, r, 0.5 * Math.PI, 1.5 * Math.PI, false);
  const geometry = new THREE.ExtrudeGeometry(shape, { depth: 0.012, bevelEnabled: true, bevelSize: 0.004, bevelThickness: 0.003, curveSegments: 24 });
  geometry.rotateX(-0.5 * Math.PI);
  // turned-up ends
  const position = geometry.getAttribute("position");
  for (let i = 0; i < position.count; i++) {
    const beyond = Math.max(Math.abs(position.getX(i)) - (half - 0.15), 0);
    position.setY(i, position.getY(i) + 1.6 * beyond ** 1.6);
  }
  geometry.computeVertexNormals();
  const mesh = new THREE.Mesh(geometry, m.deck);
  mesh.position.y = height;
  return mesh;
}

/** A rider who stands stiffly; his mass is a point at its height. */
function boardRider(floor: number, height: number, m: Materials): THREE.Object3D {
  const group = new THREE.Group();
  const hip = V(0, Math.max(height - 0.02, floor + 0.4));
  const leg = hip.y - floor;
  const chest = hip.clone().add(V(0.0, 0.42 * Math.min(leg, 1)));
  for (const end of [-1, 1]) {
    const foot = V(0.15 * end, floor + 0.05);
    const knee = hip.clone().lerp(foot, 0.5).add(V(0.05 * end, 0, 0.05));
    group.add(limb(hip.clone().add(V(0.08 * end, 0)), knee, 0.068, m.riderDark), limb(knee, foot, 0.05, m.riderDark));
    group.add(limb(foot.clone().add(V(0, -0.015, -0.06)), foot.clone().add(V(0, -0.015, 0.09)), 0.036, m.dark));
    const shoulder = chest.clone().add(V(0.17 * end, 0.02));
    const elbow = shoulder.clone().add(V(0.17 * end, -0.16, 0.03));
    const hand = elbow.clone().add(V(0.19 * end, 0.0, 0.06));
    group.add(limb(shoulder, elbow, 0.043, m.rider), limb(elbow, hand, 0.034, m.rider), limb(chest, shoulder, 0.055, m.rider));
  }
  group.add(limb(hip, chest, 0.1, m.rider), ball(chest.clone().add(V(0, 0.27)), 0.1, m.rider));
  group.add(limb(chest, chest.clone().add(V(0, 0.15)), 0.045, m.rider));
  return group;
}

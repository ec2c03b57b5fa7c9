// The path of the centre of mass: a line in space, and its shadow on the floor.

import * as THREE from "three";
import { PALETTE } from "./palette";

const MOST = 3000;

export class Trail {
  readonly group = new THREE.Group();
  private readonly air: Ribbon;
  private readonly ground: Ribbon;

  constructor(colour: string = PALETTE.path) {
    this.air = new Ribbon(colour, 2.6, 0.95);
    this.ground = new Ribbon(colour, 1.6, 0.4);
    this.group.add(this.air.mesh, this.ground.mesh);
  }

  clear(): void {
    this.air.clear();
    this.ground.clear();
  }

  /** Points in the floor's frame, in order. */
  extend(points: [number, number, number][]): void {
    for (const [x, y, z] of points) {
      this.air.add(x, y, z);
      this.ground.add(x, 0.003, z);
    }
  }

  /** Width of the canvas over height, and height in pixels, for lines of even width. */
  resize(aspect: number, height: number): void {
    this.air.resize(aspect, height);
    this.ground.resize(aspect, height);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.air.mesh.geometry.dispose();
    this.ground.mesh.geometry.dispose();
  }
}

/** A line of even width on the screen through the last points, fading to its beginning. */
class Ribbon {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  private readonly here = new Float32Array(MOST * 6);
  private readonly next = new Float32Array(MOST * 6);
  private readonly number = new Float32Array(MOST * 2);
  private n = 0;

  constructor(colour: string, width: number, opacity: number) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(this.here, 3));
    geometry.setAttribute("next", new THREE.BufferAttribute(this.next, 3));
    geometry.setAttribute("number", new THREE.BufferAttribute(this.number, 1));
    const side = new Float32Array(MOST * 2).map((_, i) => (i % 2 ? 1 : -1));
    geometry.setAttribute("side", new THREE.BufferAttribute(side, 1));
    const index: number[] = [];
    for (let i = 0; i < MOST - 1; i++) index.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 2, 2 * i + 1, 2 * i + 3);
    geometry.setIndex(index);
    this.mesh = new THREE.Mesh(geometry, ribbonMaterial(colour, width, opacity));
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 3;
    this.clear();
  }

  clear(): void {
    this.n = 0;
    this.mesh.geometry.setDrawRange(0, 0);
  }

  add(x: number, y: number, z: number): void {
    if (this.n === MOST) {
      const kept = MOST / 2;
      for (const [array, size] of [[this.here, 6], [this.next, 6], [this.number, 2]] as const) {
        array.copyWithin(0, (MOST - kept) * size);
      }
      this.n = kept;
    }
    const at = 6 * this.n;
    this.here.set([x, y, z, x, y, z], at);
    if (this.n > 0) this.next.set([x, y, z, x, y, z], at - 6);
    const before = this.n > 0 ? this.here.slice(at - 6, at - 3) : [x - 1e-4, y, z];
    const ahead = [2 * x - before[0], 2 * y - before[1], 2 * z - before[2]];
    this.next.set([...ahead, ...ahead], at);
    const number = this.n > 0 ? this.number[2 * this.n - 1] + 1 : 0;
    this.number.set([number, number], 2 * this.n);
    this.n++;
    this.mesh.geometry.setDrawRange(0, 6 * (this.n - 1));
    this.mesh.material.uniforms.last.value = number;
    for (const name of ["position", "next", "number"]) this.mesh.geometry.getAttribute(name).needsUpdate = true;
  }

  resize(aspect: number, height: number): void {
    this.mesh.material.uniforms.aspect.value = aspect;
    this.mesh.material.uniforms.height.value = height;
  }
}

function ribbonMaterial(colour: string, width: number, opacity: number): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    transparent: true,
    depthWrite: false,
    side: THREE.DoubleSide,
    uniforms: {
      colour: { value: new THREE.Color(colour) },
      width: { value: width },
      opacity: { value: opacity },
      aspect: { value: 1 },
      height: { value: 800 },
      last: { value: 0 },
    },
    vertexShader: `attribute vec3 next; attribute float number; attribute float side;
      uniform float width; uniform float aspect; uniform float height; uniform float last; varying float age; varying float across; varying float far;
      void main() {
        vec4 a = modelViewMatrix * vec4(position, 1.0);
        vec4 pa = projectionMatrix * a;
        vec4 pb = projectionMatrix * modelViewMatrix * vec4(next, 1.0);
        vec2 along = (pb.xy / pb.w - pa.xy / pa.w) * vec2(aspect, 1.0);
        vec2 normal = normalize(vec2(-along.y, along.x) + vec2(1e-9, 0.0)) / vec2(aspect, 1.0);
        pa.xy += normal * side * (width + 1.0) / height * pa.w;
        age = last - number;
        across = side;
        far = -a.z;
        gl_Position = pa;
      }`,
    fragmentShader: `uniform vec3 colour; uniform float opacity; uniform float last; varying float age; varying float across; varying float far;
      void main() {
        float edge = 1.0 - smoothstep(0.55, 1.0, abs(across));
        float fade = 1.0 - smoothstep(0.15, 1.0, age / ${MOST.toFixed(1)});
        gl_FragColor = vec4(colour, opacity * edge * fade * exp(-far * far / 700.0));
        #include <colorspace_fragment>
      }`,
  });
}

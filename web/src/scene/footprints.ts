// Footprints on the floor, the older the fainter.

import * as THREE from "three";
import type { Side } from "../kernel/kernel";
import { PALETTE } from "./palette";

const MOST = 360;
const HEIGHT = 0.0014;

export class Footprints {
  readonly mesh: THREE.InstancedMesh<THREE.PlaneGeometry, THREE.ShaderMaterial>;
  private readonly born = new THREE.InstancedBufferAttribute(new Float32Array(MOST), 1);
  private count = 0;

  constructor() {
    const geometry = new THREE.PlaneGeometry(1, 1).rotateX(-0.5 * Math.PI);
    geometry.setAttribute("born", this.born);
    this.mesh = new THREE.InstancedMesh(geometry, printMaterial(), MOST);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 2;
    this.clear();
  }

  clear(): void {
    this.count = 0;
    this.mesh.count = 0;
  }

  /** `contact`: the contact reference point, about which the foot rolls over the length of a print. */
  add(contact: [number, number], heading: number, side: Side, length: number, tint?: string): void {
    const slot = this.count % MOST;
    const matrix = new THREE.Matrix4().makeRotationY(heading);
    matrix.scale(new THREE.Vector3(Math.max(length, 0.03), 1, 0.076));
    matrix.setPosition(contact[0], HEIGHT + 0.0002 * (this.count % 3), contact[1]);
    this.mesh.setMatrixAt(slot, matrix);
    this.mesh.setColorAt(slot, new THREE.Color(tint ?? (side === 1 ? PALETTE.left : PALETTE.right)));
    this.born.setX(slot, this.count);
    this.count++;
    this.mesh.count = Math.min(this.count, MOST);
    this.mesh.material.uniforms.now.value = this.count;
    this.born.needsUpdate = true;
    this.mesh.instanceMatrix.needsUpdate = true;
    if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
  }
}

function printMaterial(): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    transparent: true,
    depthWrite: false,
    uniforms: { now: { value: 0 }, most: { value: MOST } },
    vertexShader: `attribute float born; varying vec2 at; varying vec3 tint; varying vec2 size; uniform float now; varying float age; varying float far;
      void main() {
        at = uv - 0.5;
        tint = instanceColor;
        size = vec2(length(instanceMatrix[0].xyz), length(instanceMatrix[2].xyz));
        age = now - born;
        vec4 place = modelViewMatrix * instanceMatrix * vec4(position, 1.0);
        far = -place.z;
        gl_Position = projectionMatrix * place;
      }`,
    fragmentShader: `varying vec2 at; varying vec3 tint; varying vec2 size; varying float age; varying float far; uniform float most;
      void main() {
        vec2 half_size = 0.5 * size;
        vec2 p = abs(at * size) - half_size + 0.022;
        float edge = length(max(p, 0.0)) + min(max(p.x, p.y), 0.0) - 0.022;
        float spread = fwidth(edge) + 1e-5;
        float inside = 1.0 - smoothstep(-spread, 0.0, edge);
        float rim = 1.0 - smoothstep(0.0, spread, abs(edge + 0.004) - 0.0025);
        float tread = smoothstep(0.15, 0.35, abs(fract(at.x * size.x / 0.018) - 0.5));
        float fade = (1.0 - smoothstep(0.4 * most, most, age)) * (0.45 + 0.55 * exp(-age / 14.0)) * exp(-far * far / 700.0);
        float strength = inside * max(0.52 * mix(1.0, 0.72, tread), 0.85 * rim) * fade;
        gl_FragColor = vec4(tint, strength);
        #include <colorspace_fragment>
      }`,
  });
}

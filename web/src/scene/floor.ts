// The floor: a plane that goes along with what is looked at, and lines that stay where they are.

import * as THREE from "three";
import { PALETTE } from "./palette";

const SIZE = 240;

export class Floor {
  private readonly plane: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshStandardMaterial>;
  private readonly lines: THREE.Mesh<THREE.PlaneGeometry, THREE.ShaderMaterial>;

  constructor(world: THREE.Group) {
    const flat = new THREE.PlaneGeometry(SIZE, SIZE).rotateX(-0.5 * Math.PI);
    this.plane = new THREE.Mesh(flat, new THREE.MeshStandardMaterial({ color: PALETTE.floor, roughness: 0.95, envMapIntensity: 0.35 }));
    this.plane.receiveShadow = true;
    this.lines = new THREE.Mesh(flat, lineMaterial());
    this.lines.position.y = 0.0006;
    this.lines.renderOrder = 1;
    world.add(this.plane, this.lines);
  }

  /** How far apart the strong lines are; and whether marks point downhill. */
  setLines(distance: number, pointsDownhill: boolean): void {
    this.lines.material.uniforms.distance.value = distance;
    this.lines.material.uniforms.downhill.value = pointsDownhill ? 1 : 0;
  }

  centre(point: THREE.Vector3): void {
    this.plane.position.set(point.x, 0, point.z);
    this.lines.position.set(point.x, 0.0006, point.z);
    this.lines.material.uniforms.focus.value.set(point.x, point.z);
  }
}

function lineMaterial(): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    transparent: true,
    depthWrite: false,
    uniforms: {
      focus: { value: new THREE.Vector2() },
      distance: { value: 1 },
      downhill: { value: 1 },
      ink: { value: new THREE.Color(PALETTE.ink) },
    },
    vertexShader: `uniform vec2 focus; varying vec2 place;
      void main() {
        place = position.xz + focus;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `uniform vec2 focus; uniform float distance; uniform float downhill; uniform vec3 ink; varying vec2 place;
      float lines(vec2 at, float width) {
        vec2 spread = fwidth(at);
        vec2 off = abs(fract(at - 0.5) - 0.5);
        vec2 hit = 1.0 - smoothstep(vec2(0.0), spread * width, off);
        vec2 shown = hit * min(vec2(1.0), 0.22 / max(spread, vec2(1e-5)));
        return max(shown.x, shown.y);
      }
      float chevron(vec2 at) {
        vec2 local = fract(at) - 0.5;
        float edge = abs(local.x + 0.9 * abs(local.y) - 0.05);
        float inside = step(abs(local.y), 0.055);
        float spread = fwidth(at.x) + 0.004;
        return inside * (1.0 - smoothstep(0.006, 0.006 + spread, edge));
      }
      void main() {
        vec2 at = place / distance;
        float fade = exp(-pow(length(place - focus) / (7.0 * distance), 2.0));
        float strength = 0.17 * lines(at, 1.4) + 0.055 * lines(at * 4.0, 1.2);
        strength = max(strength, 0.34 * downhill * chevron(at));
        gl_FragColor = vec4(ink, strength * fade);
        #include <colorspace_fragment>
      }`,
  });
}

// The floor: a plane that goes along with what is looked at, with lines that stay where they are.

import * as THREE from "three";
import { PALETTE } from "./palette";

const SIZE = 240;

export class Floor {
  private readonly plane: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshStandardMaterial>;
  private readonly uniforms = {
    focus: { value: new THREE.Vector2() },
    distance: { value: 1 },
    downhill: { value: 1 },
    ink: { value: new THREE.Color(PALETTE.ink) },
  };

  constructor(world: THREE.Group) {
    // pushed back a little, so that footprints and shadows of lines lie on it and not in it
    const material = new THREE.MeshStandardMaterial({
      color: PALETTE.floor, roughness: 0.95, envMapIntensity: 0.35, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4,
    });
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nuniform vec2 focus; varying vec2 place;")
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nplace = position.xz + focus;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>\n${LINES}`)
        .replace("#include <color_fragment>", "#include <color_fragment>\ndiffuseColor.rgb = mix(diffuseColor.rgb, ink, inked());");
    };
    this.plane = new THREE.Mesh(new THREE.PlaneGeometry(SIZE, SIZE).rotateX(-0.5 * Math.PI), material);
    this.plane.receiveShadow = true;
    world.add(this.plane);
  }

  /** How far apart the strong lines are; and whether marks point downhill. */
  setLines(distance: number, pointsDownhill: boolean): void {
    this.uniforms.distance.value = distance;
    this.uniforms.downhill.value = pointsDownhill ? 1 : 0;
  }

  centre(point: THREE.Vector3): void {
    this.plane.position.set(point.x, 0, point.z);
    this.uniforms.focus.value.set(point.x, point.z);
  }
}

const LINES = `
uniform vec2 focus; uniform float distance; uniform float downhill; uniform vec3 ink; varying vec2 place;

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

float inked() {
  vec2 at = place / distance;
  float fade = exp(-pow(length(place - focus) / (7.0 * distance), 2.0));
  float strength = max(0.5 * lines(at, 1.4) + 0.2 * lines(at * 4.0, 1.2), 0.72 * downhill * chevron(at));
  return strength * fade;
}
`;

// The 3-D stage: renderer, light, sky, floor and cameras. The floor's frame is `world`, tilted by the slope.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { RoomEnvironment } from "three/examples/jsm/environments/RoomEnvironment.js";
import { Floor } from "./floor";
import { PALETTE } from "./palette";

export type View = "free" | "follow" | "side" | "behind" | "above";

/** Camera places relative to what is looked at, before the turn by the heading: ahead, up, right; and how far up to look. */
const VIEWS: Record<Exclude<View, "free">, [number, number, number]> = {
  follow: [-1.75, 1.0, 1.35],
  side: [0.0, 0.35, 2.6],
  behind: [-2.3, 0.55, 0.0],
  above: [-0.02, 3.4, 0.0],
};
const START: [number, number, number] = [1.6, 0.62, 2.25];
const SHADOW_REACH = 1.9;
const SETTLING_TIME = 0.5;

/** What a slower machine does without: pixels for a CSS pixel at most, and the size of the shadow map (0: no shadow). */
const QUALITIES = [
  { pixels: 2, shadow: 2048 },
  { pixels: 1, shadow: 1024 },
  { pixels: 0.75, shadow: 1024 },
  { pixels: 0.5, shadow: 512 },
  { pixels: 0.2, shadow: 0 }, // taken only when asked for
];
/** ms between frames above which the next lower quality is taken, and how many frames are looked at. */
const SLOW = 42;
const LOOKED_AT = 12;

export class Stage {
  readonly scene = new THREE.Scene();
  readonly world = new THREE.Group();
  readonly camera = new THREE.PerspectiveCamera(36, 1, 0.05, 120);
  readonly renderer: THREE.WebGLRenderer;
  readonly controls: OrbitControls;
  readonly floor: Floor;
  view: View = "free";
  private readonly sun = new THREE.DirectionalLight("#fff3e2", 3.2);
  private readonly target = new THREE.Vector3(0, 0.5, 0);
  private heading = 0;
  private tween: { from: THREE.Vector3; share: number } | null = null;
  private shift = new THREE.Vector2();
  private slowFrames = 0;
  private isStale = true;
  private scale = 1;
  quality = 0;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene.fog = new THREE.Fog(PALETTE.horizon, 5, 30);
    this.scene.background = new THREE.Color(PALETTE.horizon);
    this.scene.add(this.world, sky());
    this.light();
    this.floor = new Floor(this.world);
    this.camera.position.copy(this.target).add(new THREE.Vector3(...START));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.08;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 14;
    this.controls.maxPolarAngle = 0.5 * Math.PI - 0.02;
    this.controls.target.copy(this.target);
    this.controls.addEventListener("start", () => (this.tween = null));
    this.resize();
  }

  private light(): void {
    const generator = new THREE.PMREMGenerator(this.renderer);
    this.scene.environment = generator.fromScene(new RoomEnvironment(), 0.04).texture;
    this.scene.environmentIntensity = 0.4;
    generator.dispose();
    this.scene.add(new THREE.HemisphereLight("#f2f6fb", "#d3c9b8", 0.5));
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.radius = 5;
    this.sun.shadow.bias = -0.0004;
    this.sun.shadow.normalBias = 0.012;
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -SHADOW_REACH;
    camera.right = camera.top = SHADOW_REACH;
    camera.near = 0.5;
    camera.far = 9;
    this.scene.add(this.sun, this.sun.target);
  }

  /** How much larger than a walker is what stands on the stage: distances of cameras, and the reach of shadows. */
  setScale(scale: number): void {
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -scale * SHADOW_REACH;
    camera.right = camera.top = scale * SHADOW_REACH;
    camera.far = 9 * scale;
    camera.updateProjectionMatrix();
    const offset = this.offset().multiplyScalar(scale / this.scale);
    this.scale = scale;
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.minDistance = 0.5 * scale;
    this.controls.maxDistance = 14 * scale;
    (this.scene.fog as THREE.Fog).near = 5 * scale;
    (this.scene.fog as THREE.Fog).far = 30 * scale;
  }

  setSlope(slope: number): void {
    this.world.rotation.z = -slope;
    this.world.updateMatrixWorld();
  }

  /** Shares of the canvas that panels cover on the right and below: what is looked at moves to the middle of the rest. */
  setCovered(right: number, below: number): void {
    this.shift.set(right, below);
    this.resize();
  }

  /** Look from one of the places; the walker's heading turns them, but for a free camera. */
  setView(view: View): void {
    this.view = view;
    if (view !== "free") this.tween = { from: this.offset(), share: 0 };
  }

  private offset(): THREE.Vector3 {
    return this.camera.position.clone().sub(this.controls.target);
  }

  /** Follow a point of the floor's frame, and with some delay a heading; `jump`: without. */
  follow(point: THREE.Vector3Like, heading: number, duration: number, jump = false): void {
    this.invalidate();
    const wanted = this.world.localToWorld(new THREE.Vector3(point.x, point.y, point.z));
    const share = jump ? 1 : 1 - Math.exp(-duration / SETTLING_TIME);
    const turn = (heading - this.heading) * share;
    const moved = wanted.sub(this.target);
    this.heading += turn;
    this.target.add(moved);
    this.camera.position.add(moved);
    this.controls.target.add(moved);
    if (this.view === "free") return;
    const offset = this.offset();
    if (this.tween) {
      this.tween.share = Math.min(this.tween.share + duration / 0.9, 1);
      const s = this.tween.share;
      const eased = s * s * (3 - 2 * s);
      const goal = new THREE.Vector3(...VIEWS[this.view]).multiplyScalar(this.scale).applyAxisAngle(new THREE.Vector3(0, 1, 0), this.heading);
      const length = THREE.MathUtils.lerp(this.tween.from.length(), goal.length(), eased);
      offset.copy(this.tween.from).lerp(goal, eased).setLength(length);
      if (s >= 1) this.tween = null;
    } else {
      offset.applyAxisAngle(new THREE.Vector3(0, 1, 0), turn);
    }
    this.camera.position.copy(this.controls.target).add(offset);
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, QUALITIES[this.quality].pixels));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = width < height ? 46 : 36;
    this.camera.setViewOffset(width, height, 0.5 * this.shift.x * width, 0.5 * this.shift.y * height, width, height);
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  setQuality(quality: number): void {
    this.quality = Math.min(Math.max(quality, 0), QUALITIES.length - 1);
    const { shadow } = QUALITIES[this.quality];
    this.sun.castShadow = shadow > 0;
    this.sun.shadow.mapSize.set(shadow || 1, shadow || 1);
    this.sun.shadow.map?.dispose();
    this.sun.shadow.map = null;
    this.resize();
  }

  /** Tell how long it is since the last frame; where that stays long the picture gets coarser. */
  adapt(milliseconds: number): void {
    this.slowFrames = milliseconds > SLOW ? this.slowFrames + 1 : Math.max(this.slowFrames - 1, 0);
    if (this.slowFrames < LOOKED_AT || this.quality >= QUALITIES.length - 2) return;
    this.slowFrames = 0;
    this.setQuality(this.quality + 1);
  }

  /** Something has moved: the next frame is to be drawn. */
  invalidate(): void {
    this.isStale = true;
  }

  /** Draw if anything has moved since the last picture, the camera included; whether it has. */
  renderIfStale(): boolean {
    const moves = this.controls.update() || this.isStale;
    if (moves) this.render();
    return moves;
  }

  /** Whether the camera is on its way to another place. */
  get isTurning(): boolean {
    return this.tween !== null;
  }

  render(): void {
    this.isStale = false;
    const { target } = this.controls;
    this.sun.target.position.copy(target).setY(target.y - 0.4);
    this.sun.position.copy(this.sun.target.position).add(new THREE.Vector3(-1.7, 4.1, 2.3).multiplyScalar(this.scale));
    this.floor.centre(this.world.worldToLocal(target.clone()));
    this.renderer.render(this.scene, this.camera);
  }
}

/** A dome from the horizon's colour to the zenith's. */
function sky(): THREE.Mesh {
  const material = new THREE.ShaderMaterial({
    side: THREE.BackSide,
    depthWrite: false,
    fog: false,
    toneMapped: false, // as fog, which has the horizon's colour too
    uniforms: {
      horizon: { value: new THREE.Color(PALETTE.horizon) },
      zenith: { value: new THREE.Color(PALETTE.zenith) },
    },
    vertexShader: `varying vec3 direction;
      void main() {
        direction = position;
        vec4 place = projectionMatrix * mat4(mat3(modelViewMatrix)) * vec4(position, 1.0);
        gl_Position = place.xyww;
      }`,
    fragmentShader: `varying vec3 direction; uniform vec3 horizon; uniform vec3 zenith;
      void main() {
        float height = max(normalize(direction).y, 0.0);
        gl_FragColor = vec4(mix(horizon, zenith, smoothstep(0.0, 0.5, height)), 1.0);
        #include <colorspace_fragment>
      }`,
  });
  const dome = new THREE.Mesh(new THREE.SphereGeometry(50, 32, 16), material);
  dome.frustumCulled = false;
  dome.renderOrder = -1;
  return dome;
}

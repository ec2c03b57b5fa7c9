// A walk on the stage: the walker's model, the path of its centre, and its footprints.

import { halfArc, shapeOf, type Vector, type WalkerShape } from "../physics/geometry";
import type { Walk } from "../physics/walk";
import type { Parameters } from "../physics/walker";
import { Footprints } from "./footprints";
import { PALETTE } from "./palette";
import type { Stage } from "./stage";
import { Trail } from "./trail";
import { WalkerModel } from "./walker_model";

const PATH_POINTS = 14;
/** A walker in the plane has no hip width; it is drawn with one, so that its legs can be told apart. */
const DRAWN_WIDTH = 0.17;

export class StagedWalk {
  private readonly model: WalkerModel;
  private readonly trail: Trail;
  private readonly prints = new Footprints();
  /** The centre's path in the step on the way, and how many of its points are drawn. */
  private path: Vector[] = [];
  private drawn = 0;

  /** `tint` tells several walkers apart; without one, left and right have their own colours. A ghost is seen through. */
  constructor(readonly walk: Walk, private readonly stage: Stage, private readonly tint = "", isGhost = false) {
    this.model = new WalkerModel(tint || undefined, isGhost);
    this.trail = new Trail(tint || PALETTE.path);
    stage.world.add(this.model.group, this.trail.group, this.prints.mesh);
    this.resize();
  }

  /** Footprint and centre's path of the step that begins. */
  begin(): void {
    const { current } = this.walk;
    this.trail.extend(this.path.slice(this.drawn));
    this.path = this.walk.centrePath(PATH_POINTS);
    this.drawn = 0;
    const { foot_radius: radius } = current.parameters;
    const rolled = Math.min(radius * Math.abs(current.interLeg) * 1.15, 2 * halfArc(radius) * radius);
    this.prints.add(this.apart(current).contact, current.state[0], current.side, rolled, this.tint || undefined);
  }

  /** Show the walker where it is now. */
  place(): void {
    this.model.update(this.parameters, this.shape());
    const reached = Math.floor(this.walk.share * (PATH_POINTS - 1)) + 1;
    if (reached > this.drawn) this.trail.extend(this.path.slice(this.drawn, reached));
    this.drawn = Math.max(this.drawn, reached);
  }

  shape(): WalkerShape {
    return shapeOf(this.parameters, this.apart(this.walk.pose()));
  }

  /** Those of the walker as drawn. */
  get parameters(): Parameters {
    const { parameters } = this.walk.current;
    return this.walk.kind === "planar" ? { ...parameters, hip_width: DRAWN_WIDTH } : parameters;
  }

  private apart<Placed extends { contact: [number, number]; side: number }>(placed: Placed): Placed {
    if (this.walk.kind !== "planar") return placed;
    const [x, z] = placed.contact;
    return { ...placed, contact: [x, z - 0.5 * placed.side * DRAWN_WIDTH] };
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.stage.canvas;
    this.trail.resize(clientWidth / Math.max(clientHeight, 1), clientHeight);
  }

  dispose(): void {
    this.model.dispose();
    this.trail.dispose();
    this.prints.mesh.removeFromParent();
    this.prints.mesh.dispose();
  }
}

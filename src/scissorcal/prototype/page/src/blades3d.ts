// The blades of the 3-D view: each extruded from its edge, with a shank and a ring for the hand.

import {
  BufferGeometry, CylinderGeometry, ExtrudeGeometry, Float32BufferAttribute, Group, Line, LineBasicMaterial, Mesh,
  MeshPhongMaterial, Shape, TorusGeometry, Vector2,
} from "three";
import { heldValue } from "./law";
import { Table } from "./kernel";

const POINTS = 120;
const BLADE_mm = 2.2;
const BEVEL_mm = 0.35;

export interface BladeMaterials {
  steel: MeshPhongMaterial;
  handle: MeshPhongMaterial;
  ghost: MeshPhongMaterial;
  upperEdge: LineBasicMaterial;
  lowerEdge: LineBasicMaterial;
}

/** Both blades about the pivot at the origin: x along the cut, y to its left, z up. Lengths in mm. */
export class Blades {
  readonly group = new Group();
  private readonly turning: { part: Group; side: 1 | -1; isGhost: boolean }[] = [];

  constructor(edge: Table, private readonly length: number, private readonly movingBlades: number, materials: BladeMaterials) {
    for (const side of [1, -1] as const) {
      const isStraight = side === -1 && movingBlades === 1;
      const points = edgePoints(edge, length, isStraight);
      this.add(side, false, this.blade(points, side, materials), this.handle(side, materials.handle));
      if (side === 1 || movingBlades === 2) this.add(side, true, this.handle(side, materials.ghost));
    }
    const screw = new Mesh(new CylinderGeometry(0.045 * length, 0.045 * length, 2 * BLADE_mm + 1.4, 28), materials.handle);
    this.group.add(screw);
  }

  /** Turn them to an opening; the hand's own place shows where the blades stay behind it. */
  turn(opening: number, wanted: number): void {
    for (const { part, side, isGhost } of this.turning) {
      const isFixed = side === -1 && this.movingBlades === 1;
      part.rotation.y = isFixed ? 0 : (-side * (isGhost ? wanted : opening)) / this.movingBlades;
      if (isGhost) part.visible = Math.abs(wanted - opening) > 0.003;
    }
  }

  dispose(): void {
    this.group.traverse((one) => {
      if (one instanceof Mesh || one instanceof Line) (one.geometry as BufferGeometry).dispose();
    });
    this.group.removeFromParent();
  }

  private add(side: 1 | -1, isGhost: boolean, ...parts: Group[]): void {
    const part = new Group();
    part.add(...parts);
    this.group.add(part);
    this.turning.push({ part, side, isGhost });
  }

  private blade(edge: Vector2[], side: 1 | -1, materials: BladeMaterials): Group {
    const { length } = this;
    const root = Math.max(Math.abs(edge[0].y), 0.06 * length);
    const back = edge.map(({ x, y }) => new Vector2(x, y + 2 * root * (1 - 0.85 * (x / length) ** 1.4))).reverse();
    const heel = [new Vector2(-0.09 * length, back[back.length - 1].y - 0.5 * root), new Vector2(-0.09 * length, edge[0].y + 0.5 * root)];
    const group = this.extruded([...edge, ...back, ...heel], side, materials.steel);
    const line = new BufferGeometry();
    line.setAttribute("position", new Float32BufferAttribute(edge.flatMap(({ x, y }) => [x, side * 0.02, side * y]), 3));
    group.add(new Line(line, side === 1 ? materials.upperEdge : materials.lowerEdge));
    return group;
  }

  /** Behind the pivot, on the other side of the centreline. */
  private handle(side: 1 | -1, material: MeshPhongMaterial): Group {
    const reach = 0.5 * this.length;
    const [radius, width] = [0.15 * this.length, 0.034 * this.length];
    const drop = 0.1 * this.length;
    const far = new Vector2(-reach + 0.75 * radius, -drop);
    const shank = [
      new Vector2(0, 0.05 * this.length), new Vector2(0, -0.05 * this.length),
      new Vector2(far.x, far.y - 0.03 * this.length), new Vector2(far.x, far.y + 0.03 * this.length),
    ];
    const group = this.extruded(shank, side, material);
    const ring = new Mesh(new TorusGeometry(radius, width, 14, 40), material);
    ring.rotation.x = 0.5 * Math.PI;
    ring.scale.set(1.25, 1, 0.9);
    ring.position.set(-reach, side * 0.5 * BLADE_mm, -side * drop);
    group.add(ring);
    return group;
  }

  /** A profile in the blade's plane, thick away from the other blade. */
  private extruded(profile: Vector2[], side: 1 | -1, material: MeshPhongMaterial): Group {
    const shape = new Shape(profile.map(({ x, y }) => new Vector2(x, side * y)));
    const geometry = new ExtrudeGeometry(shape, {
      depth: BLADE_mm - 2 * BEVEL_mm, bevelEnabled: true, bevelSegments: 2, bevelSize: BEVEL_mm, bevelThickness: BEVEL_mm,
      bevelOffset: -BEVEL_mm, steps: 1,
    });
    geometry.rotateX(0.5 * Math.PI); // x, y, z of the extrusion become x, -z, y
    geometry.translate(0, side === 1 ? BLADE_mm - BEVEL_mm : -BEVEL_mm, 0);
    const group = new Group();
    group.add(new Mesh(geometry, material));
    return group;
  }
}

function edgePoints(edge: Table, length: number, isStraight: boolean): Vector2[] {
  return Array.from({ length: POINTS + 1 }, (_, i) => {
    const s = (length * i) / POINTS;
    return new Vector2(s, isStraight ? 0 : 1e3 * heldValue(edge, 1e-3 * s));
  });
}

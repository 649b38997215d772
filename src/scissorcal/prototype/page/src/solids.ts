// Plates as solids that bend along the cut: outlines as triangles, split at the cut and in columns.

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, ShapeUtils, Vector2 } from "three";
import { areaOf, Outline, Point, stretches, without } from "./outline";

/** An outline with holes (mm) between two heights (mm). */
export interface Slab {
  outline: Outline;
  holes: Outline[];
  low: number;
  high: number;
}

/** Vertices that stand somewhere at rest, and move up and down from there. */
class Bending {
  readonly geometry = new BufferGeometry();
  private readonly rest: number[] = []; // x, y, z of each vertex
  private readonly sides: (1 | -1)[] = [];
  private places: BufferAttribute | null = null;

  bend(by: Bend): void {
    const { rest, sides } = this;
    if (!this.places) {
      this.places = new BufferAttribute(new Float32Array(rest), 3);
      this.places.setUsage(DynamicDrawUsage);
      this.geometry.setAttribute("position", this.places);
      this.geometry.computeBoundingSphere();
      if (this.geometry.boundingSphere) this.geometry.boundingSphere.radius += MOST_BENT_mm;
    }
    const array = this.places.array;
    for (let i = 0; i < sides.length; i++) array[3 * i + 2] = rest[3 * i + 2] + by(rest[3 * i], rest[3 * i + 1], sides[i]);
    this.places.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
  }

  protected vertex(x: number, y: number, z: number, side: 1 | -1): void {
    this.rest.push(x, y, z);
    this.sides.push(side);
  }
}

/** Lines every 10 mm on the upper face of a slab: they show its size and how it bends. */
export class Grid extends Bending {
  constructor(slab: Slab, cut: number) {
    super();
    const turned = (outline: Outline): Outline => outline.map(([x, y]): Point => [y, x]);
    const lines = (outline: Outline, holes: Outline[], draw: (at: number, from: number, to: number) => void): void => {
      const ys = outline.map(([, y]) => y);
      const step = GRID_mm * Math.ceil((Math.max(...ys) - Math.min(...ys)) / (GRID_mm * MOST_LINES));
      for (let y = step * Math.ceil(Math.min(...ys) / step); y <= Math.max(...ys); y += step) {
        const material = without(stretches(outline, y), holes.flatMap((hole) => stretches(hole, y)));
        for (const [from, to] of material) draw(y, from, to);
      }
    };
    const z = slab.high + 0.08;
    const step = (from: number, to: number): number => (to - from) / Math.max(Math.ceil((to - from) / COLUMN_mm), 1);
    lines(slab.outline, slab.holes, (y, from, to) => {
      if (Math.abs(y - cut) < 1e-6) return; // where the cut itself is drawn
      const d = step(from, to);
      for (let x = from; x < to - 0.5 * d; x += d) {
        for (const at of [x, x + d]) this.vertex(at, y, z, y > cut ? 1 : -1);
      }
    });
    lines(turned(slab.outline), slab.holes.map(turned), (x, from, to) => {
      for (const [low, high] of [[from, Math.min(to, cut)], [Math.max(from, cut), to]]) {
        const d = step(low, high);
        for (let y = low; y < high - 0.5 * d; y += d) {
          for (const at of [y, y + d]) this.vertex(x, at, z, high > cut ? 1 : -1);
        }
      }
    });
  }
}

/** How far (mm) the plate stands off at a place, on the left of the cut (side 1) or right (-1). */
export type Bend = (x: number, y: number, side: 1 | -1) => number;

const GRID_mm = 10;
const COLUMN_mm = 2;
const MOST_COLUMNS = 160;
const MOST_LINES = 40;
const MOST_BENT_mm = 40;

export class Solid extends Bending {
  constructor(slab: Slab, private readonly cut: number) {
    super();
    const turned = (outline: Outline, way: 1 | -1): Outline => (way * areaOf(outline) < 0 ? [...outline].reverse() : outline);
    const rings = [turned(slab.outline, 1), ...slab.holes.map((hole) => turned(hole, -1))];
    const columns = columnsOf(slab.outline);
    this.faces(rings, columns, slab);
    for (const ring of rings) ring.forEach((from, i) => this.wall(from, ring[(i + 1) % ring.length], columns, slab));
    this.cutFaces(slab, columns);
  }

  private faces(rings: Outline[], columns: number[], { low, high }: Slab): void {
    const points = rings.flat();
    const [contour, ...holes] = rings.map((ring) => ring.map(([x, y]) => new Vector2(x, y)));
    for (const triangle of ShapeUtils.triangulateShape(contour, holes)) {
      const corners = triangle.map((i) => points[i]);
      for (const side of [1, -1] as const) {
        const half = clipped(corners, 1, this.cut, side);
        for (const part of half.length ? inColumns(half, columns) : []) {
          for (let i = 1; i + 1 < part.length; i++) {
            this.triangle([part[0], part[i], part[i + 1]], high, side);
            this.triangle([part[0], part[i + 1], part[i]], low, side);
          }
        }
      }
    }
  }

  private triangle(corners: Point[], z: number, side: 1 | -1): void {
    for (const [x, y] of corners) this.vertex(x, y, z, side);
  }

  /** The wall under one side of an outline, which runs with the material on its left. */
  private wall(from: Point, to: Point, columns: number[], { low, high }: Slab): void {
    const along = (axis: 0 | 1, at: number): number => (at - from[axis]) / (to[axis] - from[axis]);
    const shares = [...columns.map((x) => along(0, x)), along(1, this.cut)].filter((share) => share > 0 && share < 1);
    const places = [0, ...shares.sort((a, b) => a - b), 1];
    for (let i = 0; i + 1 < places.length; i++) {
      const [a, b] = [places[i], places[i + 1]].map((t): Point => [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
      this.quad(a, b, low, high, 0.5 * (a[1] + b[1]) >= this.cut ? 1 : -1);
    }
  }

  private quad(a: Point, b: Point, low: number, high: number, side: 1 | -1): void {
    for (const [[x, y], z] of [[a, low], [b, low], [b, high], [a, low], [b, high], [a, high]] as [Point, number][]) {
      this.vertex(x, y, z, side);
    }
  }

  /** What the cut lays open, on both of its sides. */
  private cutFaces({ outline, holes, low, high }: Slab, columns: number[]): void {
    const material = without(stretches(outline, this.cut), holes.flatMap((hole) => stretches(hole, this.cut)));
    for (const [from, to] of material) {
      const places = [from, ...columns.filter((x) => x > from && x < to), to];
      for (let i = 0; i + 1 < places.length; i++) {
        const [a, b]: Point[] = [[places[i], this.cut], [places[i + 1], this.cut]];
        this.quad(a, b, low, high, 1);
        this.quad(b, a, low, high, -1);
      }
    }
  }
}

function columnsOf(outline: Outline): number[] {
  const xs = outline.map(([x]) => x);
  const [low, high] = [Math.min(...xs), Math.max(...xs)];
  const step = Math.max(COLUMN_mm, (high - low) / MOST_COLUMNS);
  const found: number[] = [];
  for (let x = step * (Math.floor(low / step) + 1); x < high; x += step) found.push(x);
  return found;
}

/** The part of a convex polygon with side * (coordinate - at) >= 0. */
function clipped(polygon: Point[], axis: 0 | 1, at: number, side: 1 | -1): Point[] {
  const found: Point[] = [];
  polygon.forEach((point, i) => {
    const next = polygon[(i + 1) % polygon.length];
    const [a, b] = [side * (point[axis] - at), side * (next[axis] - at)];
    if (a >= 0) found.push(point);
    if ((a > 0 && b < 0) || (a < 0 && b > 0)) {
      const share = a / (a - b);
      found.push([point[0] + share * (next[0] - point[0]), point[1] + share * (next[1] - point[1])]);
    }
  });
  return found.length >= 3 ? found : [];
}

function inColumns(polygon: Point[], columns: number[]): Point[][] {
  const xs = polygon.map(([x]) => x);
  const [low, high] = [Math.min(...xs), Math.max(...xs)];
  const found: Point[][] = [];
  let rest = polygon;
  for (const x of columns) {
    if (x <= low || x >= high) continue;
    const left = clipped(rest, 0, x, -1);
    if (left.length) found.push(left);
    rest = clipped(rest, 0, x, 1);
    if (!rest.length) break;
  }
  if (rest.length) found.push(rest);
  return found;
}

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

/** Depth (mm) to which a flap is pressed at a place x (mm) of the cut; 0 ahead of the crack. */
export type Depth = (x: number) => number;

/** Vertices that stand somewhere at rest, and move up and down from there. */
class Bending {
  readonly geometry = new BufferGeometry();
  private readonly rest: number[] = []; // x, y, z of each vertex
  private readonly facing: number[] = []; // its normal at rest
  private readonly columns = new Map<number, number>(); // x of the vertices, each once
  private readonly column: number[] = [];
  private readonly shares: number[] = []; // of the depth, below 0 on the side that is pressed down
  private readonly falls: number[] = []; // and its derivative along y
  private made: [BufferAttribute, BufferAttribute] | null = null;

  constructor(protected readonly cut: number) {}

  /** Bend both flaps, or only the one on the left of the cut. */
  bend(depth: Depth, isBoth: boolean): void {
    const { rest, facing, shares, falls, column } = this;
    this.made ??= this.attributes();
    const [places, normals] = this.made.map((one) => one.array);
    const xs = [...this.columns.keys()];
    const depths = xs.map(depth);
    const slopes = xs.map((x, i) => (depths[i] ? (depth(x + STEP_mm) - depth(x - STEP_mm)) / (2 * STEP_mm) : 0));
    for (let i = 0; i < shares.length; i++) {
      const share = isBoth || shares[i] < 0 ? shares[i] : 0;
      const down = depths[column[i]];
      places[3 * i + 2] = rest[3 * i + 2] + share * down;
      const up = facing[3 * i + 2];
      if (up) {
        const [x, y] = [share * slopes[column[i]], (share ? falls[i] : 0) * down];
        const size = up / Math.sqrt(1 + x * x + y * y);
        normals[3 * i] = -x * size;
        normals[3 * i + 1] = -y * size;
        normals[3 * i + 2] = size;
      }
    }
    for (const one of this.made) one.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
  }

  protected vertex(x: number, y: number, z: number, side: 1 | -1, normal: readonly [number, number, number]): void {
    this.rest.push(x, y, z);
    this.facing.push(...normal);
    const known = this.columns.get(x);
    this.column.push(known ?? this.columns.size);
    if (known === undefined) this.columns.set(x, this.columns.size);
    const away = (Math.abs(y - this.cut) - BESIDE_mm) / (BENT_mm - BESIDE_mm);
    const isBetween = away > 0 && away < 1;
    this.shares.push(-side * (0.5 + 0.5 * Math.cos(Math.PI * Math.min(Math.max(away, 0), 1))));
    this.falls.push(isBetween ? (0.5 * Math.PI * Math.sin(Math.PI * away)) / (BENT_mm - BESIDE_mm) : 0);
  }

  private attributes(): [BufferAttribute, BufferAttribute] {
    const made: [BufferAttribute, BufferAttribute] = [
      new BufferAttribute(new Float32Array(this.rest), 3), new BufferAttribute(new Float32Array(this.facing), 3),
    ];
    ["position", "normal"].forEach((name, i) => {
      made[i].setUsage(DynamicDrawUsage);
      this.geometry.setAttribute(name, made[i]);
    });
    this.geometry.computeBoundingSphere();
    if (this.geometry.boundingSphere) this.geometry.boundingSphere.radius += BENT_mm;
    return made;
  }
}

/** Lines every 10 mm on the upper face of a slab: they show its size and how it bends. */
export class Grid extends Bending {
  constructor(slab: Slab, cut: number) {
    super(cut);
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
        for (const at of [x, x + d]) this.vertex(at, y, z, y > cut ? 1 : -1, UP);
      }
    });
    lines(turned(slab.outline), slab.holes.map(turned), (x, from, to) => {
      for (const [low, high] of [[from, Math.min(to, cut)], [Math.max(from, cut), to]]) {
        const d = step(low, high);
        for (let y = low; y < high - 0.5 * d; y += d) {
          for (const at of [y, y + d]) this.vertex(x, at, z, high > cut ? 1 : -1, UP);
        }
      }
    });
  }
}

const GRID_mm = 10;
const COLUMN_mm = 2;
const MOST_COLUMNS = 100;
/** Distances from the cut (mm) between which a flap is straight. */
const ROWS_mm = [2.6, 6, 11, 17, 23, 30];
const MOST_LINES = 40;
const STEP_mm = 0.5;
/** A flap lies on the blade so far from the cut, and comes back to the plate out here. */
const BESIDE_mm = 2.6;
const BENT_mm = 30;
const UP = [0, 0, 1] as const;
const DOWN = [0, 0, -1] as const;

export class Solid extends Bending {
  constructor(slab: Slab, cut: number) {
    super(cut);
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
        const rows = ROWS_mm.map((row) => this.cut + side * row).sort((a, b) => a - b);
        const parts = half.length ? split(half, 0, columns).flatMap((part) => split(part, 1, rows)) : [];
        for (const part of parts) {
          for (let i = 1; i + 1 < part.length; i++) {
            this.triangle([part[0], part[i], part[i + 1]], high, side, UP);
            this.triangle([part[0], part[i + 1], part[i]], low, side, DOWN);
          }
        }
      }
    }
  }

  private triangle(corners: Point[], z: number, side: 1 | -1, normal: typeof UP | typeof DOWN): void {
    for (const [x, y] of corners) this.vertex(x, y, z, side, normal);
  }

  /** The wall under one side of an outline, which runs with the material on its left. */
  private wall(from: Point, to: Point, columns: number[], { low, high }: Slab): void {
    const along = (axis: 0 | 1, at: number): number => (at - from[axis]) / (to[axis] - from[axis]);
    const rows = [0, ...ROWS_mm, ...ROWS_mm.map((row) => -row)].map((row) => this.cut + row);
    const shares = [...columns.map((x) => along(0, x)), ...rows.map((y) => along(1, y))].filter((share) => share > 0 && share < 1);
    const places = [0, ...shares.sort((a, b) => a - b), 1];
    for (let i = 0; i + 1 < places.length; i++) {
      const [a, b] = [places[i], places[i + 1]].map((t): Point => [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
      this.quad(a, b, low, high, 0.5 * (a[1] + b[1]) >= this.cut ? 1 : -1);
    }
  }

  private quad(a: Point, b: Point, low: number, high: number, side: 1 | -1): void {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const normal = [(b[1] - a[1]) / length, (a[0] - b[0]) / length, 0] as const;
    for (const [[x, y], z] of [[a, low], [b, low], [b, high], [a, low], [b, high], [a, high]] as [Point, number][]) {
      this.vertex(x, y, z, side, normal);
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

/** A convex polygon in parts, between ascending places along an axis. */
function split(polygon: Point[], axis: 0 | 1, places: readonly number[]): Point[][] {
  const along = polygon.map((point) => point[axis]);
  const [low, high] = [Math.min(...along), Math.max(...along)];
  const found: Point[][] = [];
  let rest = polygon;
  for (const at of places) {
    if (at <= low || at >= high) continue;
    const before = clipped(rest, axis, at, -1);
    if (before.length) found.push(before);
    rest = clipped(rest, axis, at, 1);
    if (!rest.length) break;
  }
  if (rest.length) found.push(rest);
  return found;
}

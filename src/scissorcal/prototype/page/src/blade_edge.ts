// A blade's edge from drawn points: what a recipe holds of it, and the kernel's table of it.

import { splineKnots, splineSlope, splineThrough, splineValue } from "./edge_points";
import { Table } from "./kernel";
import { heldValue } from "./law";
import { boundsOf, Outline, Point } from "./outline";
import { Edge, Family, FAMILIES, PlainEdge } from "./pieces";

/** A family whose edge leaves the points by more is not the one to begin with, mm. */
const NEAR_mm = 0.02;
const FARTHEST_mm = 1000; // as a recipe takes it
const KNOTS = 9;
const SAMPLED = 16;
const DENSE = 256;
const FEWEST: Record<Family, number> = { line: 2, arc: 3, points: 3 };

/**
 * The edge of a family through points of station and offset, in mm. An Error, a sentence, where there is none.
 *
 * A line or an arc is e(s) = offset + s tan(taper) + curvature s^2 / 2 by least squares over the points'
 * lengths along the blade, so that a curve drawn with many points in one place is not pulled there.
 */
export function edgeThrough(points: Outline, family: Family): Edge {
  if (points.flat().some((value) => Math.abs(value) > FARTHEST_mm)) {
    throw new Error(`points of an edge lie within ${FARTHEST_mm} mm of the pivot`);
  }
  if (family !== "points") return plainThrough(points, family);
  const spline = splineThrough(points.map(([s, e]) => [1e-3 * s, 1e-3 * e]));
  return { family, points_mm: points, length_mm: points[points.length - 1][0], spline };
}

function plainThrough(points: Outline, family: PlainEdge["family"]): PlainEdge {
  const sorted = [...points].sort((a, b) => a[0] - b[0]);
  const unknowns = FEWEST[family];
  const stations = new Set(points.map(([s]) => s));
  if (stations.size < unknowns || !(Math.max(...stations) > 0)) {
    throw new Error(`An edge that is ${family === "arc" ? "an arc" : "a line"} needs ${unknowns} points at different stations, reaching beyond the pivot.`);
  }
  const scale = sorted[sorted.length - 1][0];
  const normal = Array.from({ length: unknowns }, () => new Array<number>(unknowns + 1).fill(0));
  sorted.forEach(([s, e], i) => {
    const before = sorted[Math.max(i - 1, 0)][0];
    const after = sorted[Math.min(i + 1, sorted.length - 1)][0];
    const weight = after - before || 1e-9 * scale;
    const row = Array.from({ length: unknowns }, (_, k) => (s / scale) ** k);
    row.forEach((a, j) => {
      row.forEach((b, k) => (normal[j][k] += weight * a * b));
      normal[j][unknowns] += weight * a * e;
    });
  });
  const [offset, rise, bend = 0] = solved(normal);
  return {
    family,
    offset_mm: rounded(offset, 4),
    taper_deg: rounded((180 / Math.PI) * Math.atan(rise / scale), 4),
    curvature_per_m: rounded((2e3 * bend) / scale ** 2, 4),
    length_mm: rounded(scale, 3),
  };
}

/** The plainest family whose edge stays within 0.02 mm of the points; the curve where none does. */
export function nearestFamily(points: Outline): Family {
  if (points.length < FEWEST.points) return "line";
  return FAMILIES.find((family) => family === "points" || leaves(points, family) <= NEAR_mm) ?? "points";
}

function leaves(points: Outline, family: Family): number {
  try {
    return misfit(points, edgeThrough(points, family));
  } catch {
    return Infinity; // it is no such edge, which the caller asks
  }
}

/** Largest distance (mm, along e) of the points from the edge. */
export function misfit(points: Outline, edge: Edge): number {
  return points.reduce((most, [s, e]) => Math.max(most, Math.abs(e - offsetAt(edge, s))), 0);
}

/** Offset in mm at a station in mm. */
export function offsetAt(edge: Edge, station: number): number {
  if (edge.family === "points") return 1e3 * splineValue(edge.spline, 1e-3 * station);
  return edge.offset_mm + station * Math.tan((edge.taper_deg * Math.PI) / 180) + 0.5e-3 * edge.curvature_per_m * station ** 2;
}

/** Slope e'(s) at a station in mm. */
export function slopeAt(edge: Edge, station: number): number {
  if (edge.family === "points") return splineSlope(edge.spline, 1e-3 * station);
  return Math.tan((edge.taper_deg * Math.PI) / 180) + 1e-3 * edge.curvature_per_m * station;
}

/**
 * The edge as the kernel's table, in place of another edge's.
 *
 * A piece between two knots is a cubic, and so are those of a curve: on the curve's own knots the table is the
 * curve, and goes straight on beyond both ends as it does. A parabola is one on any knots: these reach where the
 * other table does, and beyond the tip.
 */
export function edgeTable(edge: Edge, others: Float32Array): Table {
  const x = Float32Array.from(edge.family === "points" ? splineKnots(edge.spline) : knotsOver(edge, others));
  return { x, y: x.map((s) => 1e-3 * offsetAt(edge, 1e3 * s)), slope: x.map((s) => slopeAt(edge, 1e3 * s)) };
}

function knotsOver(edge: PlainEdge, others: Float32Array): number[] {
  const low = Math.min(0, others[0]);
  const high = Math.max(others[others.length - 1], 1.1e-3 * edge.length_mm);
  return Array.from({ length: KNOTS }, (_, i) => low + ((high - low) * i) / (KNOTS - 1));
}

/** The edge that a table shows, as the plainest family that follows it. */
export function edgeOfTable(table: Table, length_m: number): Edge {
  const points = sampled(table, length_m, DENSE);
  const family = nearestFamily(points);
  if (family === "points") return edgeThrough(sampledPoints(table, length_m), family);
  return { ...plainThrough(points, family), length_mm: rounded(1e3 * length_m, 3) };
}

/** Points on the edge of a table, some to be moved by hand: even from the pivot to the tip. */
export function sampledPoints(table: Table, length_m: number): Outline {
  return sampled(table, length_m, SAMPLED).map(([s, e]): Point => [rounded(s, 3), rounded(e, 4)]);
}

/** How far an edge leaves a table's on the blade, mm. */
export function leavesTable(edge: Edge, table: Table, length_m: number): number {
  return misfit(sampled(table, length_m, DENSE), edge);
}

function sampled(table: Table, length_m: number, count: number): Outline {
  return Array.from({ length: count }, (_, i): Point => {
    const s = (length_m * i) / (count - 1);
    return [1e3 * s, 1e3 * heldValue(table, s)];
  });
}

/** Points on an edge to be moved by hand: those of a curve, else five from the pivot to the tip. */
export function pointsOf(edge: Edge): Outline {
  if (edge.family === "points") return edge.points_mm;
  return [0, 0.25, 0.5, 0.75, 1].map((share): Point => {
    const station = share * edge.length_mm;
    return [rounded(station, 3), rounded(offsetAt(edge, station), 4)];
  });
}

/** The edge as a line of many points, to be seen. */
export function traced(edge: Edge, points: Outline, count = 160): Outline {
  const start = points.length ? Math.min(boundsOf(points).low[0], 0) : 0;
  return Array.from({ length: count + 1 }, (_, i): Point => {
    const station = start + ((edge.length_mm - start) * i) / count;
    return [station, offsetAt(edge, station)];
  });
}

/** Gaussian elimination with pivots; rows hold the right-hand side last. */
function solved(rows: number[][]): number[] {
  const n = rows.length;
  for (let i = 0; i < n; i++) {
    const best = rows.slice(i).reduce((at, row, k) => (Math.abs(row[i]) > Math.abs(rows[at][i]) ? i + k : at), i);
    [rows[i], rows[best]] = [rows[best], rows[i]];
    for (let j = i + 1; j < n; j++) {
      const share = rows[j][i] / rows[i][i];
      for (let k = i; k <= n; k++) rows[j][k] -= share * rows[i][k];
    }
  }
  const found = new Array<number>(n).fill(0);
  for (let i = n - 1; i >= 0; i--) {
    const known = found.reduce((sum, value, k) => (k > i ? sum + rows[i][k] * value : sum), 0);
    found[i] = (rows[i][n] - known) / rows[i][i];
  }
  return found;
}

export function rounded(value: number, decimals: number): number {
  return Number(value.toFixed(decimals)) + 0;
}

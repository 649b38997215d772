// A blade's edge from drawn points: the line or arc that a recipe holds, and the kernel's table of it.

import { Table } from "./kernel";
import { Outline } from "./outline";
import { Edge } from "./pieces";

/**
 * Offset, taper and curvature of e(s) = offset + s tan(taper) + curvature s^2 / 2 through points.
 *
 * Least squares over the points' lengths along the blade, so that a curve drawn with many points in
 * one place is not pulled there. Points are station and offset in mm. An Error where there are too few.
 */
export function edgeThrough(points: Outline, family: Edge["family"]): Edge {
  const sorted = [...points].sort((a, b) => a[0] - b[0]);
  const unknowns = family === "arc" ? 3 : 2;
  if (!canFit(points, family)) {
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

/** Whether points determine an edge that ends beyond the pivot. */
export function canFit(points: Outline, family: Edge["family"]): boolean {
  const stations = new Set(points.map(([s]) => s));
  return stations.size >= (family === "arc" ? 3 : 2) && Math.max(...stations) > 0;
}

/** Largest distance (mm, along e) of the points from the edge. */
export function misfit(points: Outline, edge: Edge): number {
  return points.reduce((most, [s, e]) => Math.max(most, Math.abs(e - offsetAt(edge, s))), 0);
}

/** Offset in mm at a station in mm. */
export function offsetAt(edge: Edge, station: number): number {
  const taper = Math.tan((edge.taper_deg * Math.PI) / 180);
  return edge.offset_mm + station * taper + 0.5e-3 * edge.curvature_per_m * station ** 2;
}

/** The edge as the kernel's table, on the knots (m) of another. */
export function edgeTable(edge: Edge, knots: Float32Array): Table {
  const taper = Math.tan((edge.taper_deg * Math.PI) / 180);
  return {
    x: knots,
    y: knots.map((s) => 1e-3 * offsetAt(edge, 1e3 * s)),
    slope: knots.map((s) => taper + edge.curvature_per_m * s),
  };
}

/** The edge that a table shows, nearest as a line or an arc. */
export function edgeOfTable(table: Table, length_m: number): Edge {
  const points: Outline = [...table.x].map((s, i) => [1e3 * s, 1e3 * table.y[i]]);
  const line = { ...edgeThrough(points, "line"), length_mm: rounded(1e3 * length_m, 3) };
  if (table.x.length < 3 || misfit(points, line) < 0.01) return line;
  return { ...edgeThrough(points, "arc"), length_mm: line.length_mm };
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

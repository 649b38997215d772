// Outlines: closed polygons in mm. Where a line crosses them, what lies inside, curves as points.

export type Point = [number, number];
export type Outline = Point[];
/** From and to along a line. */
export type Interval = [number, number];

/**
 * The stretches of the line y = const inside an outline, ascending.
 *
 * A side counts where one end lies at or below the line and the other above it: a side along the
 * line counts as below it, so each stretch is the one just above the line.
 */
export function stretches(outline: Outline, y: number): Interval[] {
  const at: number[] = [];
  outline.forEach(([x1, y1], i) => {
    const [x2, y2] = outline[(i + 1) % outline.length];
    if (y1 <= y !== y2 <= y) at.push(x1 + ((y - y1) / (y2 - y1)) * (x2 - x1));
  });
  at.sort((a, b) => a - b);
  const found: Interval[] = [];
  for (let i = 0; i + 1 < at.length; i += 2) if (at[i + 1] > at[i]) found.push([at[i], at[i + 1]]);
  return found;
}

/** Stretches without what is taken away from them. */
export function without(kept: readonly Interval[], taken: readonly Interval[]): Interval[] {
  let left = [...kept];
  for (const [from, to] of taken) {
    left = left.flatMap(([begin, end]): Interval[] => {
      if (to <= begin || from >= end) return [[begin, end]];
      const parts: Interval[] = [[begin, Math.min(from, end)], [Math.max(to, begin), end]];
      return parts.filter(([a, b]) => b > a);
    });
  }
  return left;
}

/** Whether a point lies inside, by the even-odd rule. */
export function inside(outline: Outline, [x, y]: Point): boolean {
  return stretches(outline, y).some(([from, to]) => from <= x && x < to);
}

/** Signed area in mm^2, above 0 where the points go round against the clock (y up). */
export function areaOf(outline: Outline): number {
  return 0.5 * outline.reduce((sum, [x1, y1], i) => {
    const [x2, y2] = outline[(i + 1) % outline.length];
    return sum + x1 * y2 - x2 * y1;
  }, 0);
}

export function boundsOf(points: readonly Point[]): { low: Point; high: Point } {
  const low: Point = [Infinity, Infinity];
  const high: Point = [-Infinity, -Infinity];
  for (const point of points) {
    for (const k of [0, 1] as const) {
      low[k] = Math.min(low[k], point[k]);
      high[k] = Math.max(high[k], point[k]);
    }
  }
  return { low, high };
}

export function rectangle([x1, y1]: Point, [x2, y2]: Point): Outline {
  return [[x1, y1], [x2, y1], [x2, y2], [x1, y2]];
}

/** A circle as a polygon whose sides leave it by no more than the tolerance. */
export function circle([x, y]: Point, radius: number, tolerance = 0.02): Outline {
  const count = Math.min(Math.max(Math.ceil(Math.PI / Math.sqrt((2 * tolerance) / radius)), 12), 180);
  return Array.from({ length: count }, (_, i): Point => {
    const angle = (2 * Math.PI * i) / count;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  });
}

export function middle([x1, y1]: Point, [x2, y2]: Point): Point {
  return [0.5 * (x1 + x2), 0.5 * (y1 + y2)];
}

export function moved(outline: Outline, dx: number, dy: number): Outline {
  return outline.map(([x, y]): Point => [x + dx, y + dy]);
}

/** Stretched about its lower left corner. */
export function resized(outline: Outline, width: number, height: number): Outline {
  const { low, high } = boundsOf(outline);
  const factors = [width / (high[0] - low[0]), height / (high[1] - low[1])];
  return outline.map(([x, y]): Point => [
    low[0] + (x - low[0]) * factors[0], low[1] + (y - low[1]) * factors[1],
  ]);
}

/** Points of a cubic curve behind its begin, no farther from it than the tolerance. */
export function flattened(from: Point, c1: Point, c2: Point, to: Point, tolerance: number): Point[] {
  const bend = (a: Point, b: Point, c: Point): number => Math.hypot(a[0] - 2 * b[0] + c[0], a[1] - 2 * b[1] + c[1]);
  const most = Math.max(bend(from, c1, c2), bend(c1, c2, to));
  const count = Math.min(Math.max(Math.ceil(Math.sqrt((6 * most) / (8 * tolerance))), 1), 200);
  return Array.from({ length: count }, (_, i): Point => {
    const t = (i + 1) / count;
    const u = 1 - t;
    const [a, b, c, d] = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t];
    return [
      a * from[0] + b * c1[0] + c * c2[0] + d * to[0], a * from[1] + b * c1[1] + c * c2[1] + d * to[1],
    ];
  });
}

/** Outlines with those directly inside them as their holes; what lies in a hole is a plate again. */
export function nested(outlines: readonly Outline[]): { outline: Outline; holes: Outline[] }[] {
  const sorted = [...outlines].sort((a, b) => Math.abs(areaOf(b)) - Math.abs(areaOf(a)));
  const depths = sorted.map((outline, i) => sorted.slice(0, i).filter((larger) => inside(larger, outline[0])).length);
  return sorted.flatMap((outline, i) => {
    if (depths[i] % 2) return [];
    const holes = sorted.filter((other, j) => j > i && depths[j] === depths[i] + 1 && inside(outline, other[0]));
    return [{ outline, holes }];
  });
}

/** Whether two sides of an outline cross each other: what is inside it is then not clear. */
export function crossesItself(outline: Outline): boolean {
  const count = outline.length;
  const side = (a: Point, b: Point, c: Point): number => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  for (let i = 0; i < count; i++) {
    const [a, b] = [outline[i], outline[(i + 1) % count]];
    for (let j = i + 2; j < count; j++) {
      if (i === 0 && j === count - 1) continue;
      const [c, d] = [outline[j], outline[(j + 1) % count]];
      if (side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0) return true;
    }
  }
  return false;
}

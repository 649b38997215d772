// The blade's edge out of an SVG file: an open line as it is drawn, of a closed outline the lower side.

import { edgeThrough, misfit, rounded } from "./blade_edge";
import { boundsOf, moved, Outline, Point } from "./outline";
import { Shape } from "./svg_file";

const MOST_POINTS = 200; // as a recipe takes them
const SIDE_mm = 1.5; // a piece of a curve is some 5 mm long
const STEEP = Math.tan((60 * Math.PI) / 180);

/** Points of station and offset in mm, and what was done to get them. */
export interface FoundEdge {
  points: Outline;
  sentence: string;
}

/**
 * The edge that shapes hold, y up: the one with the id "edge", else the widest.
 *
 * The pivot is the middle of the shape with the id "pivot", else the upper left corner of the page. An open
 * line is taken as it is. A closed outline is that of the upper blade, its handle to the left: its edge is the
 * lower side, from the leftmost corner to the rightmost, without what lies behind the pivot and without ends
 * that are steeper than 60 deg. Raises Error with a sentence where nothing is left.
 */
export function edgeIn(name: string, shapes: readonly Shape[]): FoundEdge {
  const pivot = shapes.find(({ id }) => id === "pivot");
  const others = shapes.filter((shape) => shape !== pivot);
  const named = others.filter(({ id }) => id === "edge");
  const all = (named.length ? named : others).flatMap(({ outlines, closed }) =>
    outlines.map((outline, i) => ({ outline, isClosed: closed[i] })));
  const widest = all.reduce((best, one) => (widthOf(one.outline) > widthOf(best.outline) ? one : best), all[0]);
  if (!widest || !(widthOf(widest.outline) > 0)) throw new Error(`${name} has no line or outline that could be an edge.`);
  const [dx, dy] = pivot ? middleOf(pivot.outlines.flat()) : [0, 0];
  const placed = moved(widest.outline, -dx, -dy);
  const whole = rising(widest.isClosed ? filled(trimmed(fromPivotOn(lowerSide(placed)))) : placed);
  if (whole.length < 2) throw new Error(`${name} has no edge in front of the pivot.`);
  const points = thinned(whole).map(([s, e]): Point => [rounded(s, 4), rounded(e, 4)]);
  return { points, sentence: told(widest.isClosed, pivot !== undefined, points, whole) };
}

function told(isClosed: boolean, hasPivot: boolean, points: Outline, whole: Outline): string {
  const what = isClosed ? "the lower side of an outline" : "a line";
  const from = `Stations count to the right from ${hasPivot ? 'the shape "pivot"' : "the page's upper left corner"}, offsets up from it`;
  const fewer = points.length < whole.length ? ` of ${whole.length}` : "";
  return `${what} as an edge, ${points.length} points${fewer} from ${points[0][0]} to ${points[points.length - 1][0]} mm${left(points, whole)}. ${from}.`;
}

/** How far the curve leaves the points of the file that were left out. */
function left(points: Outline, whole: Outline): string {
  if (points.length === whole.length) return "";
  try {
    return `; the curve through them leaves those left out by up to ${(1e3 * misfit(whole, edgeThrough(points, "points"))).toPrecision(2)} µm`;
  } catch {
    return ""; // the panel says why it is no edge
  }
}

function widthOf(outline: Outline): number {
  const { low, high } = boundsOf(outline);
  return high[0] - low[0];
}

function middleOf(points: Outline): Point {
  const { low, high } = boundsOf(points);
  return [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
}

/** From the leftmost corner to the rightmost, the lower where there are two, on the side that runs lower. */
function lowerSide(outline: Outline): Outline {
  const end = (sign: 1 | -1): number => outline.reduce((found, [x, y], i) => {
    const [bestX, bestY] = outline[found];
    return sign * x > sign * bestX || (x === bestX && y < bestY) ? i : found;
  }, 0);
  const [near, far] = [end(-1), end(1)];
  const walk = (step: 1 | -1): Outline => {
    const points: Outline = [outline[near]];
    for (let i = near; i !== far;) {
      i = (i + step + outline.length) % outline.length;
      points.push(outline[i]);
    }
    return points;
  };
  const [one, other] = [walk(1), walk(-1)];
  return areaUnder(one) <= areaUnder(other) ? one : other;
}

function areaUnder(points: Outline): number {
  return points.slice(1).reduce((sum, [x, y], i) => sum + 0.5 * (x - points[i][0]) * (y + points[i][1]), 0);
}

/** Without what lies behind the pivot; the edge then begins at it. */
function fromPivotOn(points: Outline): Outline {
  const first = points.findIndex(([s], i) => s >= 0 && points.slice(i).every(([other]) => other >= 0));
  if (first <= 0) return first < 0 ? [] : points;
  const [[s0, e0], [s1, e1]] = [points[first - 1], points[first]];
  const kept = points.slice(first);
  return s1 > 0 ? [[0, e0 - (s0 * (e1 - e0)) / (s1 - s0)], ...kept] : kept;
}

/** Without ends that are steeper than 60 deg: a heel, a rounded tip. */
function trimmed(points: Outline): Outline {
  const isSteep = ([s0, e0]: Point, [s1, e1]: Point): boolean => Math.abs(e1 - e0) > STEEP * Math.abs(s1 - s0);
  let [from, to] = [0, points.length - 1];
  while (from < to && isSteep(points[from], points[from + 1])) from++;
  while (to > from && isSteep(points[to - 1], points[to])) to--;
  return points.slice(from, to + 1);
}

/** With points on long sides: an outline is its sides, and an edge that leaves them is another one. */
function filled(points: Outline): Outline {
  const reach = Math.max(SIDE_mm, widthOf(points) / (MOST_POINTS - 20));
  return points.flatMap((point, i): Outline => {
    const next = points[i + 1];
    if (!next) return [point];
    const parts = Math.max(1, Math.ceil((next[0] - point[0]) / reach));
    return Array.from({ length: parts }, (_, k): Point => [
      point[0] + (k / parts) * (next[0] - point[0]), point[1] + (k / parts) * (next[1] - point[1]),
    ]);
  });
}

function rising(points: Outline): Outline {
  return points.length > 1 && points[0][0] > points[points.length - 1][0] ? [...points].reverse() : points;
}

/** Even by their order, both ends among them. */
function thinned(points: Outline): Outline {
  const count = Math.min(points.length, MOST_POINTS - 1); // one more may lead to the pivot
  if (count === points.length) return points;
  return Array.from({ length: count }, (_, i) => points[Math.round((i * (points.length - 1)) / (count - 1))]);
}

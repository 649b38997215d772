// An edge through points, as one cubic spline: the rule of scissorcal.model.edge_points.

/** Station and offset, m. */
type Place = readonly [number, number];

/** Cubic pieces between even knots from start to end, straight on beyond both; weights in m. */
export interface Spline {
  start_m: number;
  end_m: number;
  weights_m: number[];
  /** Largest distance, along the offset, of the points that it was made of. */
  misfit_m: number;
}

const FEWEST_POINTS = 3;
const MOST_POINTS = 200;
const MOST_PIECES = 16;
const ORDER = 4; // weights that act on one piece
const WANTED_MISFIT_m = 5e-6;
const LARGEST_MISFIT_m = 2e-5;
const SMOOTHING = 1e-3;
const STEEPEST = Math.tan((80 * Math.PI) / 180);
const THIRD_DIFFERENCE = [-1, 3, -3, 1];

/**
 * The spline through points, of the fewest pieces (1 to 16) that leave no point by more than 0.005 mm,
 * else of those that leave them least. Of n points at most n - 3 pieces: with more weights than points the
 * misfit would say nothing.
 *
 * Least squares of the points, with the weights' third differences held small, which leaves parabolas
 * as they are. An Error, a sentence, where it is more than 0.02 mm or the edge is steeper than 80 deg.
 */
export function splineThrough(points: readonly Place[]): Spline {
  refuseUnfit(points);
  const [start_m, end_m] = [points[0][0], points[points.length - 1][0]];
  const most = Math.min(MOST_PIECES, Math.max(1, points.length - ORDER + 1));
  let best: Spline | null = null;
  for (let pieces = 1; pieces <= most && !(best && best.misfit_m <= WANTED_MISFIT_m); pieces++) {
    const spline = { start_m, end_m, weights_m: weightsOf(points, pieces + ORDER - 1), misfit_m: Infinity };
    spline.misfit_m = points.reduce((most, [s, e]) => Math.max(most, Math.abs(splineValue(spline, s) - e)), 0);
    if (!best || spline.misfit_m < best.misfit_m) best = spline;
  }
  if (!best || !(best.misfit_m <= LARGEST_MISFIT_m)) {
    throw new Error(
      `a smooth edge of up to ${most} pieces leaves the points by ${Number((1e3 * (best?.misfit_m ?? NaN)).toPrecision(3))} mm, `
      + `more than ${1e3 * LARGEST_MISFIT_m} mm: smooth corners, notches and short waves out, or give more points where it bends`);
  }
  const falling = { ...best, weights_m: best.weights_m.map((weight) => -weight) };
  if (Math.max(steepestOf(best), steepestOf(falling)) > STEEPEST) throw new Error("the edge is steeper than 80 deg on the blade: check its points");
  return best;
}

export function splineValue(spline: Spline, station: number): number {
  const { zeroth, first, second, third, t, beyond } = pieceAt(spline, station);
  const value = zeroth + t * (first + t * (second + t * third));
  return beyond ? value + beyond * (first + t * (2 * second + 3 * third * t)) : value;
}

export function splineSlope(spline: Spline, station: number): number {
  const { first, second, third, t } = pieceAt(spline, station);
  return (first + t * (2 * second + 3 * third * t)) / widthOf(spline);
}

/** Knots from start to end, m. */
export function splineKnots(spline: Spline): number[] {
  const pieces = spline.weights_m.length - ORDER + 1;
  return Array.from({ length: pieces + 1 }, (_, i) => (i === pieces ? spline.end_m : spline.start_m + i * widthOf(spline)));
}

function refuseUnfit(points: readonly Place[]): void {
  if (points.length < FEWEST_POINTS || points.length > MOST_POINTS) {
    throw new Error(`an edge needs ${FEWEST_POINTS} to ${MOST_POINTS} points, and these are ${points.length}`);
  }
  if (!points.every((point) => point.every(Number.isFinite))) throw new Error("points of an edge must be finite numbers");
  if (points.some(([s], i) => i > 0 && s <= points[i - 1][0])) {
    throw new Error("stations of an edge's points must rise strictly, from pivot to tip");
  }
  if (points[0][0] > 0 || points[points.length - 1][0] <= 0) {
    throw new Error("an edge's first station must be 0 (the pivot) or less, its last above 0");
  }
}

function widthOf({ start_m, end_m, weights_m }: Spline): number {
  return (end_m - start_m) / (weights_m.length - ORDER + 1);
}

/** The cubic over a station, in t from 0 to 1 along its piece, and how far beyond its ends that is. */
function pieceAt(spline: Spline, station: number) {
  const { start_m, weights_m } = spline;
  const pieces = weights_m.length - ORDER + 1;
  const along = (station - start_m) / widthOf(spline);
  const place = Math.min(Math.max(along, 0), pieces);
  const piece = Math.min(Math.floor(place), pieces - 1);
  const [a, b, c, d] = weights_m.slice(piece, piece + ORDER);
  return {
    zeroth: (a + 4 * b + c) / 6, first: (c - a) / 2, second: (a - 2 * b + c) / 2, third: (d - 3 * c + 3 * b - a) / 6,
    t: place - piece, beyond: along - place,
  };
}

/** Largest slope from the pivot to the tip; a slope is one parabola on each piece. */
function steepestOf(spline: Spline): number {
  const ends = [0, ...splineKnots(spline).filter((knot) => knot > 0)];
  return ends.slice(1).reduce((most, end, i) => {
    const [first, middle, last] = [ends[i], 0.5 * (ends[i] + end), end].map((s) => splineSlope(spline, s));
    const bend = 2 * (first + last - 2 * middle);
    const top = 0.5 * (1 - (last - first) / bend);
    const inner = bend < 0 && top > 0 && top < 1 ? first - bend * top ** 2 : first;
    return Math.max(most, first, last, inner);
  }, -Infinity);
}

/** Weights by least squares: a row for each point, and one for each third difference. */
function weightsOf(points: readonly Place[], count: number): number[] {
  const [start_m, end_m] = [points[0][0], points[points.length - 1][0]];
  const rows = points.map(([station, offset]) => {
    const row = new Float64Array(count + 1);
    for (let k = 0; k < count; k++) {
      const weights_m = Array.from({ length: count }, (_, i) => Number(i === k));
      row[k] = splineValue({ start_m, end_m, weights_m, misfit_m: 0 }, station);
    }
    row[count] = offset;
    return row;
  });
  for (let k = 0; k + ORDER <= count; k++) {
    const row = new Float64Array(count + 1);
    THIRD_DIFFERENCE.forEach((share, i) => (row[k + i] = SMOOTHING * share));
    rows.push(row);
  }
  return leastSquares(rows, count);
}

/** Householder's reflections; each row holds what it shall be last. */
function leastSquares(rows: Float64Array[], count: number): number[] {
  for (let k = 0; k < count; k++) {
    const length = Math.hypot(...rows.slice(k).map((row) => row[k]));
    if (!length) continue;
    const head = rows[k][k] > 0 ? -length : length;
    const mirror = rows.map((row, i) => (i < k ? 0 : row[k]));
    mirror[k] -= head;
    const norm = mirror.reduce((sum, value) => sum + value * value, 0);
    for (let j = k; j <= count; j++) {
      const share = (2 * rows.reduce((sum, row, i) => sum + mirror[i] * row[j], 0)) / norm;
      rows.forEach((row, i) => (row[j] -= share * mirror[i]));
    }
  }
  const found = new Array<number>(count).fill(0);
  for (let k = count - 1; k >= 0; k--) {
    const known = found.reduce((sum, value, j) => (j > k ? sum + rows[k][j] * value : sum), 0);
    found[k] = (rows[k][count] - known) / rows[k][k];
  }
  return found;
}

// What a person drew, and what the kernel meets of it along the line of the cut: pieces.

import { Spline } from "./edge_points";
import { Interval, Outline, stretches, without } from "./outline";

/** Material that is bonded to the one before it; it ends at a place along the cut. */
export interface Strip {
  end_m: number;
  fracture_energy_J_per_m: number;
}

/** A stretch without a gap (scissorcal.kernel.plate): its crack begins at its near edge. */
export interface Piece {
  begin_m: number;
  upper_face_m: number;
  scale: number;
  strips: Strip[];
}

/** A part of a layer that is tougher or weaker; its ratio takes the place of the layer's. */
export interface Region {
  toughness_ratio: number;
  outline: Outline;
}

/** Lengths in mm: x along the cut from the near edge, y across it. */
export interface Layer {
  name: string;
  thickness_mm: number;
  toughness_ratio: number;
  outline: Outline;
  holes: Outline[];
  regions: Region[];
}

/** From the plainest on. */
export const FAMILIES = ["line", "arc", "points"] as const;
export type Family = (typeof FAMILIES)[number];

/** e(s) = offset + s tan(taper) + curvature s^2 / 2. */
export interface PlainEdge {
  family: "line" | "arc";
  offset_mm: number;
  taper_deg: number;
  curvature_per_m: number;
  length_mm: number;
}

/** A smooth curve through points, which are all that a recipe holds of it; the last station is its length. */
export interface CurvedEdge {
  family: "points";
  points_mm: Outline;
  length_mm: number;
  spline: Spline;
}

export type Edge = PlainEdge | CurvedEdge;

/** A whole drawing. `edge` is null where the blades stay as they are. */
export interface Drawn {
  cut_line_mm: number;
  layers: Layer[];
  edge: Edge | null;
  /** Points of the drawn edge: station and offset in mm, from the pivot. */
  edge_points: Outline;
  /** Why the points as they stand are no edge of a family; the edge then is the last that they were. */
  edge_refused?: { family: Family; sentence: string };
}

/** The material that was calibrated, and which blades move. */
export interface Calibrated {
  thickness_m: number;
  fracture_energy_J_per_m: number;
  moving_blades: number;
}

/** A stretch of a layer on the line of the cut, in mm: its ends and their toughness ratios. */
export interface LayerPiece {
  layer: number;
  begin: number;
  end: number;
  /** Of its upper face above the lowest face of the plate. */
  top: number;
  thickness: number;
  strips: { end: number; ratio: number }[];
}

export const MOST_PIECES = 16;
export const MOST_STRIPS = 64;
/** Gaps and stretches below this are neither: as scissorcal.model.plate_pieces has it. */
export const SMALLEST_mm = 0.01;

/** The pieces that the kernel takes, by layer and then by place; an Error where it takes none such. */
export function piecesOf(drawn: Drawn, calibrated: Calibrated): Piece[] {
  const found = layerPieces(drawn);
  const first = found.reduce((least, one) => Math.min(least, one.begin), 0);
  if (first < -SMALLEST_mm) {
    throw new Error(`A layer begins at x = ${first.toFixed(2)} mm; the cut begins at x = 0, so move the drawing to x of 0 and more.`);
  }
  const strips = found.reduce((sum, piece) => sum + piece.strips.length, 0);
  if (found.length > MOST_PIECES || strips > MOST_STRIPS) {
    throw new Error(
      `On the line of the cut there are ${found.length} pieces with ${strips} stretches of toughness, and a plate holds `
      + `${MOST_PIECES} and ${MOST_STRIPS}: draw fewer holes and parts.`);
  }
  return found.map((piece): Piece => {
    const scale = (1e-3 * piece.thickness) / calibrated.thickness_m;
    return {
      begin_m: 1e-3 * piece.begin,
      upper_face_m: (1e-3 * piece.top) / calibrated.moving_blades,
      scale,
      strips: piece.strips.map(({ end, ratio }) => ({
        end_m: 1e-3 * end, fracture_energy_J_per_m: calibrated.fracture_energy_J_per_m * scale * ratio,
      })),
    };
  });
}

/**
 * The pieces of a plate along its line of the cut, by layer from below, then along x.
 *
 * The rules are those of scissorcal.model.plate_pieces: a layer lies flat on the highest top of
 * those below it that it overlaps along the line; stretches of one layer that touch are one piece.
 * An Error, a sentence, for a layer that the line misses and for regions that overlap on it.
 */
export function layerPieces(drawn: Drawn): LayerPiece[] {
  const line = drawn.cut_line_mm;
  if (!drawn.layers.length) throw new Error("There is no plate to cut: draw one or load one.");
  const found: LayerPiece[] = [];
  drawn.layers.forEach((layer, i) => {
    const material = materialOf(layer, line);
    if (!material.length) throw new Error(`The line of the cut (y = ${line} mm) misses the layer "${layer.name}".`);
    const regions = regionsOn(layer, line);
    const below = [...found];
    for (const [begin, end] of material) {
      const under = below.filter((one) => Math.min(one.end, end) - Math.max(one.begin, begin) >= SMALLEST_mm);
      const top = under.reduce((most, one) => Math.max(most, one.top), 0) + layer.thickness_mm;
      const strips = stripsOf(begin, end, layer.toughness_ratio, regions);
      found.push({ layer: i, begin, end, top, thickness: layer.thickness_mm, strips });
    }
  });
  return found;
}

/** Where a layer has material along the line of the cut, in mm. */
export function materialOf(layer: Layer, cut_line_mm: number): Interval[] {
  const holes = layer.holes.flatMap((hole) => stretches(hole, cut_line_mm));
  const joined: Interval[] = [];
  for (const [begin, end] of without(stretches(layer.outline, cut_line_mm), holes)) {
    const last = joined[joined.length - 1];
    if (last && begin - last[1] < SMALLEST_mm) joined[joined.length - 1] = [last[0], end];
    else joined.push([begin, end]);
  }
  return joined.filter(([begin, end]) => end - begin >= SMALLEST_mm);
}

type Tough = { from: number; to: number; ratio: number };

function regionsOn(layer: Layer, line: number): Tough[] {
  const found = layer.regions.flatMap((region) =>
    stretches(region.outline, line).map(([from, to]): Tough => ({ from, to, ratio: region.toughness_ratio })));
  found.sort((a, b) => a.from - b.from || a.to - b.to || a.ratio - b.ratio);
  found.slice(1).forEach(({ from }, i) => {
    if (from < found[i].to - SMALLEST_mm) {
      throw new Error(`Parts of the layer "${layer.name}" overlap on the line of the cut, at x = ${from.toFixed(2)} mm: draw them apart.`);
    }
  });
  return found;
}

/** Neighbours of one toughness are one strip. */
function stripsOf(begin: number, end: number, ratio: number, regions: Tough[]): LayerPiece["strips"] {
  const borders = [begin];
  for (const border of regions.flatMap(({ from, to }) => [from, to]).sort((a, b) => a - b)) {
    if (border - borders[borders.length - 1] >= SMALLEST_mm && end - border >= SMALLEST_mm) borders.push(border);
  }
  const strips: LayerPiece["strips"] = [];
  borders.forEach((low, i) => {
    const high = borders[i + 1] ?? end;
    const middle = 0.5 * (low + high);
    const here = regions.find(({ from, to }) => from <= middle && middle < to)?.ratio ?? ratio;
    if (strips.length && strips[strips.length - 1].ratio === here) strips.pop();
    strips.push({ end: high, ratio: here });
  });
  return strips;
}

/** A name as a recipe takes it: letters of ASCII, digits, spaces, points and dashes, and no other's. */
export function layerName(wanted: string, others: readonly string[], otherwise: string): string {
  const plain = wanted.normalize("NFKD").replace(/[^A-Za-z0-9 ._-]+/g, "").replace(/^[^A-Za-z0-9]+/, "").trim().slice(0, 56) || otherwise;
  let found = plain;
  for (let i = 2; others.includes(found); i++) found = `${plain} ${i}`;
  return found;
}

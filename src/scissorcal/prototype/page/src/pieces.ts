// What a person drew, and what the kernel meets of it along the line of the cut: pieces.

import { Interval, Outline, inside, stretches, without } from "./outline";

/** Material that is bonded to the one before it; it ends at a place along the cut. */
export interface Strip {
  end_m: number;
  fracture_energy_J_per_m: number;
}

/** A stretch without a gap (scissorcal.kernel.pieces): its crack begins at its near edge. */
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

export interface Edge {
  family: "line" | "arc";
  offset_mm: number;
  taper_deg: number;
  curvature_per_m: number;
  length_mm: number;
}

/** A whole drawing. `edge` is null where the blades stay as they are. */
export interface Drawn {
  cut_line_mm: number;
  layers: Layer[];
  edge: Edge | null;
  /** Points of the drawn edge: station and offset in mm, from the pivot. */
  edge_points: Outline;
}

/** The material that was calibrated, and which blades move. */
export interface Calibrated {
  thickness_m: number;
  fracture_energy_J_per_m: number;
  moving_blades: number;
}

export const MOST_PIECES = 16;
export const MOST_STRIPS = 64;

/** The pieces of a drawing along its line of the cut, by place; an Error where there are too many. */
export function piecesOf(drawn: Drawn, calibrated: Calibrated): Piece[] {
  const pieces = drawn.layers.flatMap((layer, i) => {
    const top_m = 1e-3 * drawn.layers.slice(0, i + 1).reduce((sum, one) => sum + one.thickness_mm, 0);
    const share = (1e-3 * layer.thickness_mm) / calibrated.thickness_m;
    return materialOf(layer, drawn.cut_line_mm).map((stretch): Piece => ({
      begin_m: 1e-3 * stretch[0],
      upper_face_m: top_m / calibrated.moving_blades,
      scale: share,
      strips: strips(layer, drawn.cut_line_mm, stretch).map(([end, ratio]) => ({
        end_m: 1e-3 * end, fracture_energy_J_per_m: calibrated.fracture_energy_J_per_m * share * ratio,
      })),
    }));
  });
  pieces.sort((a, b) => a.begin_m - b.begin_m);
  const count = pieces.reduce((sum, piece) => sum + piece.strips.length, 0);
  if (pieces.length > MOST_PIECES) {
    throw new Error(`The line of the cut meets ${pieces.length} pieces; the kernel takes ${MOST_PIECES}.`);
  }
  if (count > MOST_STRIPS) {
    throw new Error(`The line of the cut meets ${count} changes of toughness; the kernel takes ${MOST_STRIPS}.`);
  }
  return pieces;
}

/** Where a layer has material along the line of the cut, in mm. */
export function materialOf(layer: Layer, cut_line_mm: number): Interval[] {
  const holes = layer.holes.flatMap((hole) => stretches(hole, cut_line_mm));
  return without(stretches(layer.outline, cut_line_mm), holes);
}

/** Ends in mm and toughness ratios along a stretch; of regions that overlap the last one counts. */
function strips(layer: Layer, y: number, [begin, end]: Interval): [number, number][] {
  const changes = layer.regions.flatMap((region) => stretches(region.outline, y).flat());
  const ends = [...new Set(changes.filter((x) => x > begin && x < end)), end].sort((a, b) => a - b);
  const found: [number, number][] = [];
  let from = begin;
  for (const to of ends) {
    const ratio = ratioAt(layer, 0.5 * (from + to), y);
    if (found.length && found[found.length - 1][1] === ratio) found.pop();
    found.push([to, ratio]);
    from = to;
  }
  return found;
}

function ratioAt(layer: Layer, x: number, y: number): number {
  const over = layer.regions.filter((region) => inside(region.outline, [x, y]));
  return over.length ? over[over.length - 1].toughness_ratio : layer.toughness_ratio;
}

// What the 3-D view shows of pieces: the drawn layers, or each piece as a strip as long as it is.

import { Outline, rectangle } from "./outline";
import { Drawn, Layer, materialOf, Piece, SMALLEST_mm } from "./pieces";
import { Scene } from "./scene";
import { Slab } from "./solids";

export type Tinted = Slab & { tint: "sheet" | "second" | "tougher" | "weaker" };

interface Shown {
  scene: Scene;
  pieces?: readonly Piece[] | null;
  drawn?: Drawn | null;
}

const THINNEST_mm = 0.25; // so that a sheet of paper is seen

/** Slabs from height 0 up; null for the uniform sheet. */
export function slabsOf({ scene, pieces, drawn }: Shown, halfWidth: number): Tinted[] | null {
  if (drawn) return ofLayers(drawn);
  if (pieces) return ofPieces(scene, pieces, halfWidth);
  return null;
}

function ofLayers(drawn: Drawn): Tinted[] {
  const found: Tinted[] = [];
  const tops: number[] = [];
  drawn.layers.forEach((layer, i) => {
    const own = materialOf(layer, drawn.cut_line_mm);
    const isOver = (below: Layer): boolean => materialOf(below, drawn.cut_line_mm)
      .some(([from, to]) => own.some(([begin, end]) => Math.min(to, end) - Math.max(from, begin) >= SMALLEST_mm));
    const low = drawn.layers.slice(0, i).reduce((most, below, k) => (isOver(below) ? Math.max(most, tops[k]) : most), 0);
    const high = low + Math.max(layer.thickness_mm, THINNEST_mm);
    tops.push(high);
    found.push({ outline: layer.outline, holes: layer.holes, low, high, tint: i % 2 ? "second" : "sheet" });
    found.push(...layer.regions.map((region) => coat(region.outline, high, region.toughness_ratio, layer.toughness_ratio)));
  });
  return found;
}

function ofPieces(scene: Scene, pieces: readonly Piece[], halfWidth: number): Tinted[] {
  const thickness = 1e3 * scene.upper_face_m * scene.moving_blades;
  return pieces.flatMap((piece) => {
    const high = 1e3 * piece.upper_face_m * scene.moving_blades;
    const own = Math.max(piece.scale * thickness, THINNEST_mm);
    const ends = piece.strips.map((strip) => 1e3 * strip.end_m);
    const begin = 1e3 * piece.begin_m;
    const across = (from: number, to: number): Outline => rectangle([from, -halfWidth], [to, halfWidth]);
    const slab: Tinted = {
      outline: across(begin, ends[ends.length - 1]), holes: [], low: high - own, high, tint: high > own + 1e-6 ? "second" : "sheet",
    };
    const first = piece.strips[0].fracture_energy_J_per_m;
    const coats = piece.strips.flatMap((strip, i) => (strip.fracture_energy_J_per_m === first ? []
      : [coat(across(ends[i - 1], ends[i]), high, strip.fracture_energy_J_per_m, first)]));
    return [slab, ...coats];
  });
}

/** A part of another toughness, as a thin coat on its layer. */
function coat(outline: Outline, high: number, ratio: number, other: number): Tinted {
  return { outline, holes: [], low: high - 0.02, high: high + 0.06, tint: ratio >= other ? "tougher" : "weaker" };
}

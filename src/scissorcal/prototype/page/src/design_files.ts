// Files of a drawing: what was loaded becomes a drawing, what is saved goes to the person's disk.

import { Kind, Part, withAdded } from "./design_state";
import { boundsOf, moved, nested, Outline, Point, stretches } from "./outline";
import { Drawn, Layer, layerName, materialOf } from "./pieces";
import { pointsOf } from "./design_tables";
import { drawnFromRecipe } from "./recipe_text";
import { Contours, DrawnPlate } from "./scene";
import { drawnFromSvg } from "./svg_file";

interface Wanted {
  /** What outlines of a foreign SVG file become. */
  kind: Kind;
  layer: number;
  /** The uniform sheet: what a recipe without layers is about, and how thick foreign outlines are. */
  sheet: Layer;
}

interface Opened {
  drawn: Drawn;
  part: Part;
  sentence: string;
  /** The recipe's text, which keeps all but the drawing. */
  base?: string;
  /** Nothing was drawn: the blades cut the uniform sheet. */
  isUniform?: boolean;
}

const FIRST: Part = { kind: "outline", layer: 0, index: 0 };

/** A recipe, a drawing of ours or any SVG file as a drawing. Raises Error with a sentence. */
export function openDrawing(name: string, text: string, present: Drawn, wanted: Wanted): Opened {
  if (/\.toml$/i.test(name)) {
    return { part: FIRST, base: text, ...recipeOf(name, drawnFromRecipe(text), wanted.sheet) };
  }
  const { thickness_mm } = wanted.sheet;
  const drawn = drawnFromSvg(text, thickness_mm);
  const { isOurs, ...found } = drawn;
  if (isOurs) return { drawn: found, part: FIRST, sentence: `${name}: the drawing as it was saved.` };
  if (wanted.kind === "outline") return placed(name, found);
  const outlines = found.layers.map((layer) => layer.outline);
  if (wanted.kind === "edge") {
    const points = lowerSide(outlines[0] ?? found.edge_points);
    const added = withAdded(present, "edge", 0, points, thickness_mm);
    return { ...added, sentence: `${name}: an edge through ${points.length} points.` };
  }
  if (!outlines.length) throw new Error(`${name} has no closed outline with an area.`);
  const line = present.cut_line_mm;
  const { low, high } = boundsOf(outlines.flat());
  const up = outlines.some((outline) => stretches(outline, line).length) ? 0 : line - 0.5 * (low[1] + high[1]);
  let [now, part] = [present, FIRST];
  for (const outline of outlines) {
    ({ drawn: now, part } = withAdded(now, wanted.kind, wanted.layer, moved(outline, 0, up), thickness_mm));
  }
  const added = `${name}: ${outlines.length} outline${outlines.length === 1 ? "" : "s"} added`;
  return { drawn: now, part, sentence: `${added}${up ? ", moved onto the line of the cut" : ""}.` };
}

/** A recipe without layers is about the uniform sheet, which is drawn and not cut as drawn. */
function recipeOf(name: string, drawn: Drawn, sheet: Layer): Pick<Opened, "drawn" | "sentence" | "isUniform"> {
  const edge_points = drawn.edge ? pointsOf(drawn.edge) : [];
  const count = drawn.layers.length;
  if (count) return { drawn: { ...drawn, edge_points }, sentence: `${name}: ${count} layer${count === 1 ? "" : "s"}.` };
  return {
    drawn: { ...drawn, cut_line_mm: 0, layers: [sheet], edge_points }, isUniform: true,
    sentence: `${name} draws no plate: it is about the uniform sheet, as it was calibrated. A piece of that is drawn here; tick the box to cut it.`,
  };
}

/** A plate whose outlines were read from files, as a drawing: each closed contour is an outline. */
export function drawnFromPlate({ cut_line_mm, layers }: DrawnPlate): Drawn {
  const drawn: Drawn = { cut_line_mm, layers: [], edge: null, edge_points: [] };
  for (const { outline, holes, regions, ...own } of layers) {
    const whole = (shape: Contours, what: string): Outline[] => nested(shape).map((one) => {
      if (one.holes.length) throw new Error(`${what} of its layer ${own.name} has a hole, which cannot be drawn here.`);
      return one.outline;
    });
    const taken = holes.flatMap((shape) => whole(shape, "a hole"));
    const parts = regions.flatMap(({ toughness_ratio, outline: shape }) =>
      whole(shape, "a part").map((one) => ({ toughness_ratio, outline: one })));
    for (const plate of nested(outline)) {
      const name = layerName(own.name, drawn.layers.map((one) => one.name), "plate");
      drawn.layers.push({ ...own, name, outline: plate.outline, holes: [...plate.holes, ...taken], regions: parts });
    }
  }
  return drawn;
}

/** Offer text as a file to save. */
export function savedFile(name: string, type: string, text: string): void {
  const address = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** Plates that do not meet the cut are moved onto it, their near edge at 0. */
function placed(name: string, drawn: Drawn): Opened {
  if (!drawn.layers.length) throw new Error(`${name} has no closed outline with an area.`);
  const { low, high } = boundsOf(drawn.layers.flatMap((layer) => layer.outline));
  const size = `${(high[0] - low[0]).toFixed(1)} by ${(high[1] - low[1]).toFixed(1)} mm`;
  const meets = drawn.layers.some((layer) => materialOf(layer, 0).some(([, to]) => to > 0)) && low[0] >= 0;
  const count = drawn.layers.length;
  const sentence = `${name}: ${count} plate${count === 1 ? "" : "s"}, ${size} in all`;
  if (meets) return { drawn, part: FIRST, sentence: `${sentence}.` };
  const [dx, dy] = [-low[0], -0.5 * (low[1] + high[1])];
  const shift = (outline: Outline): Outline => moved(outline, dx, dy);
  const layers = drawn.layers.map((layer) => ({ ...layer, outline: shift(layer.outline), holes: layer.holes.map(shift) }));
  return { drawn: { ...drawn, layers }, part: FIRST, sentence: `${sentence}, moved so that the cut begins at their edge and goes through their middle.` };
}

/** Of a closed outline the side that cuts: from its first to its last station, on the side of low offset. */
function lowerSide(outline: Outline): Outline {
  const at = (best: (a: number, b: number) => boolean): number =>
    outline.reduce((found, [x], i) => (best(x, outline[found][0]) ? i : found), 0);
  const [near, far] = [at((a, b) => a < b), at((a, b) => a > b)];
  const walk = (step: 1 | -1): Outline => {
    const points: Outline = [outline[near]];
    for (let i = near; i !== far;) {
      i = (i + step + outline.length) % outline.length;
      points.push(outline[i]);
    }
    return points;
  };
  const mean = (points: Outline): number => points.reduce((sum, [, y]: Point) => sum + y, 0) / points.length;
  const [one, other] = [walk(1), walk(-1)];
  return mean(one) <= mean(other) ? one : other;
}

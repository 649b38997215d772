// A drawing as tables of a recipe: [[plate.layers]] and [rig.edge] in recipe.toml, and back.

import { parse } from "smol-toml";
import { edgeOfTable } from "./blade_edge";
import { plainSheet } from "./design_state";
import { AT } from "./kernel";
import { tableOf } from "./law";
import { areaOf, Outline } from "./outline";
import { Calibrated, Drawn, Edge, Layer, layerName, Region } from "./pieces";
import { edgeOf, edgeText } from "./recipe_edge";
import { Scene, unpack } from "./scene";
import { list, numberOf, pointsOf, pointsText, positive, quoted, shown, table, Toml } from "./toml";

const MOST_CHARACTERS = 1_000_000;
// What scissorcal.recipe.plate_layers takes.
const MOST_CORNERS = 2000;
const MOST_OF_OUTLINE = 1000;
const MOST_PARTS = 64;
const SMALLEST_AREA_mm2 = 1e-4;
const EDGE_HEADER = /^\s*\[rig\.edge\]/m;
const ESTIMATED = /^(\s*plate_pose\s*=\s*)(?:"estimated"|'estimated')/m;

/** What was calibrated, as the pieces of a drawing are compared with it. */
export function calibratedOf(scene: Scene): Calibrated {
  return {
    thickness_m: scene.upper_face_m * scene.moving_blades,
    fracture_energy_J_per_m: scene.numbers[AT.fractureEnergy],
    moving_blades: scene.moving_blades,
  };
}

/**
 * A recipe with the drawing in it.
 *
 * All else stays as it stands in `base`, comments too; without one the recipe is made from what the
 * page knows of the scene. Raises Error where the base is a recipe in which nothing can be replaced.
 */
export function recipeText(drawn: Drawn, scene: Scene, base: string | null): string {
  refuseUnfit(drawn);
  let text = base ?? recipeOf(scene, drawn.edge);
  if (drawn.edge_refused) throw new Error(`The points of the blades are no edge yet, so no recipe can hold them: ${drawn.edge_refused.sentence}.`);
  if (base !== null) text = withEdgeTable(text, drawn.edge ?? (base === scene.recipe ? null : fittedEdge(scene)));
  text = withoutTables(text, (name) => name === "plate.layers" || name.startsWith("plate.layers."));
  const known = parsed(text);
  const plate = (known.plate ?? {}) as Toml;
  const line = drawn.layers.length ? drawn.cut_line_mm : 0;
  if (line !== Number(plate.cut_line_mm ?? 0)) text = withCutLine(text, line);
  const isPlain = base !== null && plate.layers === undefined && isPlainSheet(drawn, scene);
  const layers = isPlain ? "" : drawn.layers.map(layerText).join("\n");
  if (layers && (known.scene as Toml | undefined)?.plate_pose === "estimated") {
    throw new Error('This recipe estimates where the plate stands (scene.plate_pose = "estimated"), which does not go together with a drawn plate: set it to "known" in a copy of it, and load that.');
  }
  const whole = layers ? `${text.trimEnd()}\n\n${layers}` : text;
  if (known.plate && (known.plate as Toml).layers !== undefined) {
    throw new Error("This recipe has its plate on one line (inline tables), which cannot be replaced: write [plate] and [[plate.layers]].");
  }
  drawnFromRecipe(whole); // what is saved can be loaded
  return whole;
}

/** What keeps a drawing out of a recipe, and what would let it in: a sentence, a label, the other recipe. */
export interface Obstacle {
  sentence: string;
  offer: string;
  base: string | null;
}

/** Why no plate, or no edge, that is drawn could be saved into a recipe; null where any could. */
export function obstacleOf(base: string | null): Obstacle | null {
  if (base === null) return null;
  const { plate, scene, rig } = parsed(base) as { plate?: Toml; scene?: Toml; rig?: Toml };
  if (scene?.plate_pose === "estimated") {
    const text = base.replace(ESTIMATED, '$1"known"');
    if ((parsed(text).scene as Toml).plate_pose === "known") {
      return { sentence: "This recipe estimates where the plate stands; a drawn plate needs it known.", offer: "Set plate_pose to known in what is saved", base: text };
    }
  }
  const isInline = (plate?.layers !== undefined && !/^\s*\[\[\s*plate\.layers\s*\]\]/m.test(base)) || (rig?.edge !== undefined && !EDGE_HEADER.test(base));
  if (!isInline && scene?.plate_pose !== "estimated") return null;
  return { sentence: "This recipe has its plate, pose or edge in lines that cannot be replaced.", offer: "Save a new recipe, made from this page", base: null };
}

/** The recipe with another edge; as it stands where it has that edge already. */
function withEdgeTable(text: string, edge: Edge | null): string {
  const before = edgeIn(parsed(text));
  if (!edge || (before && JSON.stringify(edgeOf(before)) === JSON.stringify(edge))) return text;
  if (before && !EDGE_HEADER.test(text)) {
    throw new Error("This recipe has the blade's edge on one line (an inline table), which cannot be replaced: write [rig.edge].");
  }
  return withTable(text, "rig.edge", edgeText(edge, before));
}

function fittedEdge(scene: Scene): Edge {
  return edgeOfTable(tableOf(unpack(scene.tables.edge)), scene.blade_length_m);
}

/** Whether nothing is drawn: a plain sheet is what a recipe without layers has. */
function isPlainSheet({ layers }: Drawn, scene: Scene): boolean {
  return JSON.stringify(layers) === JSON.stringify(plainSheet(calibratedOf(scene), scene.blade_length_m).layers);
}

/** The drawing of a recipe; an Error with a sentence where it is none, or has outlines in files. */
export function drawnFromRecipe(text: string): Drawn {
  if (text.length > MOST_CHARACTERS) throw new Error("This recipe is larger than 1 MB.");
  const recipe = parsed(text);
  const plate = table(recipe.plate ?? {}, "plate");
  const layers = list(plate.layers ?? [], "plate.layers").map((one, i) => layerOf(one, `plate.layers[${i + 1}]`));
  const edge = edgeIn(recipe);
  return {
    cut_line_mm: numberOf(plate.cut_line_mm ?? 0, "plate.cut_line_mm"),
    layers,
    edge: edge && edgeOf(edge),
    edge_points: [],
  };
}

function edgeIn(recipe: Toml): Toml | null {
  const edge = (recipe.rig as Toml | undefined)?.edge;
  return edge === undefined ? null : table(edge, "rig.edge");
}

function refuseUnfit({ layers }: Drawn): void {
  const outlines = layers.flatMap((layer) => [layer.outline, ...layer.holes, ...layer.regions.map((region) => region.outline)]);
  const count = outlines.reduce((sum, outline) => sum + outline.length, 0);
  if (count > MOST_CORNERS || outlines.some((outline) => outline.length > MOST_OF_OUTLINE)) {
    throw new Error(
      `A recipe holds ${MOST_CORNERS} corners, ${MOST_OF_OUTLINE} of one outline, and this drawing has ${count}: save drawing.svg and name its `
      + 'shapes in the recipe, with outline = "drawing.svg" and id = "layer-1".');
  }
  if (outlines.some((outline) => Math.abs(areaOf(outline)) < SMALLEST_AREA_mm2)) {
    throw new Error("An outline of this drawing encloses no area, which no recipe takes: remove it or give it one.");
  }
  if (layers.some((layer) => layer.holes.length > MOST_PARTS || layer.regions.length > MOST_PARTS)) {
    throw new Error(`A layer of a recipe has up to ${MOST_PARTS} holes and ${MOST_PARTS} parts: draw fewer.`);
  }
}

function layerText(layer: Layer): string {
  return [
    "[[plate.layers]]",
    `name = ${quoted(layer.name)}`,
    `thickness_mm = ${shown(layer.thickness_mm)}`,
    `toughness_ratio = ${shown(layer.toughness_ratio)}`,
    `outline_mm = ${pointsText(layer.outline)}`,
    ...(layer.holes.length ? [`holes_mm = [\n${layer.holes.map((hole) => `${pointsText(hole)},`).join("\n")}\n]`] : []),
    ...layer.regions.map((region) => [
      "[[plate.layers.regions]]",
      `toughness_ratio = ${shown(region.toughness_ratio)}`,
      `outline_mm = ${pointsText(region.outline)}`,
    ].join("\n")),
    "",
  ].join("\n");
}

/** A recipe of the page's scene: what plan asks for, all else by default. */
function recipeOf(scene: Scene, edge: Edge | null): string {
  const { thickness_m, fracture_energy_J_per_m } = calibratedOf(scene);
  const range = (values: readonly number[], factor: number): string => `[${values.map((value) => shown(factor * value)).join(", ")}]`;
  const toughness = Math.max(fracture_energy_J_per_m, 1e-6) / thickness_m;
  const name = (scene.name.replace(/[^A-Za-z0-9._-]+/g, "-").replace(/^[^A-Za-z0-9]+/, "") || "scene").slice(0, 54);
  return `# Drawn on the page of ${oneLine(scene.name)}. Units stand in the names.

format = "scissorcal-recipe/1"
name = ${quoted(`${name}-drawn`)}
description = ${quoted(`Plate drawn on the page of ${oneLine(scene.name)}.`)}

[rig]
moving = ${quoted(scene.moving_blades === 2 ? "both" : "upper")}
handle_radius_mm = ${shown(1e3 * scene.handle_radius_m)}

${edgeText(edge ?? fittedEdge(scene))}
[material]                         # what is calibrated; layers are stated against it
name = ${quoted(oneLine(scene.name))}
thickness_mm = ${shown(1e3 * thickness_m)}

[scene]
opening_deg = ${range(scene.opening_rad, 180 / Math.PI)}
opening_rate_rad_per_s = ${range(scene.opening_rate_rad_per_s, 1)}
contact_mm = ${range(scene.contact_m, 1e3)}
loop_rate_Hz = ${shown(scene.loop_rate_Hz)}

[limits]
torque_Nm = ${shown(scene.torque_limit_Nm)}

[fit.cut]
toughness_J_per_m2 = { median = ${Number(toughness.toPrecision(3))}, factor_90 = 10 }
`;
}

/** Text in which the lines of a table are others; appended where there is no such table. */
function withTable(text: string, name: string, lines: string): string {
  const mark = "\u0000";
  let isFirst = true;
  const marked = withoutTables(text, (one) => one === name, () => {
    const put = isFirst ? mark : "";
    isFirst = false;
    return put;
  });
  return isFirst ? `${text.trimEnd()}\n\n${lines}` : marked.replace(mark, () => lines);
}

function withCutLine(text: string, cut_line_mm: number): string {
  const line = `cut_line_mm = ${shown(cut_line_mm)}`;
  const lines = text.split("\n").filter((one) => !/^\s*cut_line_mm\s*=/.test(one));
  const at = lines.findIndex((one) => /^\s*\[\s*plate\s*\]/.test(one));
  if (at >= 0) lines.splice(at + 1, 0, line);
  else lines.push("", "[plate]", line);
  return lines.join("\n");
}

/** Text without the tables that a test picks by name; comments right above their headers go too. */
function withoutTables(text: string, picks: (name: string) => boolean, put: () => string = () => ""): string {
  const kept: string[] = [];
  let isOut = false;
  for (const line of text.split("\n")) {
    const header = /^\s*\[\[?\s*([A-Za-z0-9_."' -]+?)\s*\]\]?\s*(#.*)?$/.exec(line);
    if (header) {
      isOut = picks(header[1].replace(/["'\s]/g, ""));
      if (isOut) {
        const instead = put();
        if (instead) kept.push(instead);
      }
    }
    if (!isOut) kept.push(line);
  }
  return kept.join("\n");
}

function parsed(text: string): Toml {
  try {
    return parse(text) as Toml;
  } catch (error) {
    throw new Error(`This is no recipe: ${(error as Error).message.split("\n")[0]}`);
  }
}

function layerOf(value: unknown, place: string): Layer {
  const layer = table(value, place);
  if (layer.outline !== undefined) {
    throw new Error(`${place} takes its outline from the file ${String(layer.outline)}: load that SVG file instead.`);
  }
  return {
    name: layerName(String(layer.name ?? ""), [], "plate"),
    thickness_mm: positive(layer.thickness_mm, `${place}.thickness_mm`),
    toughness_ratio: positive(layer.toughness_ratio ?? 1, `${place}.toughness_ratio`),
    outline: outlineOf(layer.outline_mm, `${place}.outline_mm`),
    holes: list(layer.holes_mm ?? [], `${place}.holes_mm`).map((one) => outlineOf(one, `${place}.holes_mm`)),
    regions: list(layer.regions ?? [], `${place}.regions`).map((one, i): Region => {
      const region = table(one, `${place}.regions[${i + 1}]`);
      return {
        toughness_ratio: positive(region.toughness_ratio, `${place}.regions[${i + 1}].toughness_ratio`),
        outline: outlineOf(region.outline_mm, `${place}.regions[${i + 1}].outline_mm`),
      };
    }),
  };
}

function outlineOf(value: unknown, place: string): Outline {
  const points = pointsOf(value, place);
  if (points.length < 3) throw new Error(`${place} needs three points or more.`);
  return points;
}

function oneLine(text: string): string {
  return text.replace(/[\u0000-\u001f\u007f\u0085\u2028\u2029]+/g, " ");
}

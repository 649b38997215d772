// The blade's edge as a recipe states it: [rig.edge], and back.

import { edgeThrough } from "./blade_edge";
import { Edge, FAMILIES, Family } from "./pieces";
import { exact, numberOf, pointsOf, pointsText, positive, quoted, Toml } from "./toml";

const SHAPE = ["family", "offset_mm", "taper_deg", "curvature_per_m", "length_mm", "points_mm"];

/** The lines of the table; what `before` states besides the shape stays, such as how well it is known. */
export function edgeText(edge: Edge, before: Toml | null = null): string {
  const numbers = edge.family === "points" ? [`points_mm = ${pointsText(edge.points_mm, exact)}`] : [
    `offset_mm = ${exact(edge.offset_mm)}`,
    `taper_deg = ${exact(edge.taper_deg)}`,
    ...(edge.family === "arc" ? [`curvature_per_m = ${exact(edge.curvature_per_m)}`] : []),
    `length_mm = ${exact(edge.length_mm)}`,
  ];
  const kept = Object.entries(before ?? {}).filter(([key]) => !SHAPE.includes(key)).flatMap(([key, value]) =>
    typeof value === "number" ? [`${key} = ${exact(value)}`] : typeof value === "string" ? [`${key} = ${quoted(value)}`] : []);
  return ["[rig.edge]", `family = ${quoted(edge.family)}`, ...numbers, ...kept, ""].join("\n");
}

/** An Error, a sentence, for a table that states no edge, or one that the page does not know. */
export function edgeOf(stated: Toml): Edge {
  const family = FAMILIES.find((one) => one === (stated.family ?? "line"));
  if (!family) throw new Error(`rig.edge.family is ${JSON.stringify(stated.family)}, and an edge is one of ${FAMILIES.map((one) => `"${one}"`).join(", ")}.`);
  if (family === "points") return curveOf(stated, family);
  if (stated.points_mm !== undefined) throw new Error('rig.edge.points_mm needs family = "points".');
  const curvature_per_m = numberOf(stated.curvature_per_m ?? 0, "rig.edge.curvature_per_m");
  if (family === "line" && curvature_per_m) throw new Error('rig.edge.curvature_per_m needs family = "arc".');
  return {
    family,
    offset_mm: numberOf(stated.offset_mm, "rig.edge.offset_mm"),
    taper_deg: numberOf(stated.taper_deg, "rig.edge.taper_deg"),
    curvature_per_m,
    length_mm: positive(stated.length_mm, "rig.edge.length_mm"),
  };
}

function curveOf(stated: Toml, family: Family): Edge {
  const other = ["offset_mm", "taper_deg", "curvature_per_m", "length_mm"].find((key) => stated[key] !== undefined);
  if (other) throw new Error(`rig.edge.${other} does not go with family = "points": leave it out.`);
  const points = pointsOf(stated.points_mm, "rig.edge.points_mm");
  try {
    return edgeThrough(points, family);
  } catch (error) {
    throw new Error(`rig.edge.points_mm cannot be an edge: ${(error as Error).message}.`);
  }
}

// The blades beside the drawing: the family of their edge, its numbers, what is wrong with its points.

import { edgeOfTable, leavesTable, misfit, pointsOf, sampledPoints } from "./blade_edge";
import { Design, familyOf, Part, withAdded, withEdge, withoutPart } from "./design_state";
import { html, numberField } from "./elements";
import { Table } from "./kernel";
import { Drawn, Edge, FAMILIES, Family, PlainEdge } from "./pieces";

const NAMES: Record<Family, string> = { line: "line", arc: "arc", points: "curve through the points" };
const THE_EDGE: Part = { kind: "edge", layer: 0, index: 0 };

/** The edge of the blades as they were fitted. */
export interface Blades {
  table: Table;
  length_m: number;
}

/** The blade's edge: as fitted, or a line, an arc or a curve through points; `unfelt` says why the model does not have it. */
export function edgePanel(design: Design, fitted: Blades, say: (sentence: string) => void, unfelt: string): HTMLElement {
  const { edge, edge_points } = design.drawn;
  const panel = (...children: (HTMLElement | null)[]): HTMLElement =>
    html("section", { class: "design-panel" }, html("h3", {}, "Blades"), ...children);
  if (!edge && !edge_points.length) {
    return panel(html("p", {}, "The blades are as fitted."), html("div", { class: "row" },
      html("button", { type: "button", "data-key": "blade", click: () => begin(design, fitted) }, "Draw another edge"),
      html("button", { type: "button", "data-key": "sampled", click: () => bend(design, fitted, say) }, "Points of the blades as fitted")));
  }
  const family = familyOf(design.drawn) ?? "line";
  const select = html("select", {
    "data-key": "family", "aria-label": "Family of the edge",
    change: (event) => {
      const chosen = (event.currentTarget as HTMLSelectElement).value as Family;
      design.replace(withEdge(design.drawn, design.drawn.edge_points, chosen));
    },
  }, ...FAMILIES.map((one) => html("option", { value: one, selected: one === family }, NAMES[one])));
  const isPlain = edge && edge.family !== "points" && edge.family === family;
  return panel(
    html("div", { class: "row" }, html("label", { class: "field" }, "Edge ", select), ...(isPlain ? numbers(design, edge) : [])),
    stateOf(design.drawn), unfelt ? html("p", { class: "note" }, unfelt) : null,
    html("p", {}, "Stations are mm from the pivot towards the tip. An offset below 0 lies on the side of the sheet."),
    html("div", { class: "row" },
      html("button", { type: "button", "data-key": "points", click: () => design.choose(THE_EDGE) }, "Choose its points"),
      html("button", { type: "button", "data-key": "blade", click: () => design.replace(withoutPart(design.drawn, THE_EDGE)) }, "As fitted again")));
}

/** An edge of the plainest family that follows the fitted one. */
function begin(design: Design, { table, length_m }: Blades): void {
  const edge = edgeOfTable(table, length_m);
  const added = withAdded(design.drawn, "edge", 0, pointsOf(edge), 1);
  design.part = added.part;
  design.replace({ ...added.drawn, edge });
}

/** The fitted edge as points, which a person then moves. */
function bend(design: Design, { table, length_m }: Blades, say: (sentence: string) => void): void {
  const points = sampledPoints(table, length_m);
  const drawn = withEdge(design.drawn, points, "points");
  design.part = THE_EDGE;
  design.corner = null;
  design.replace(drawn);
  if (!drawn.edge || drawn.edge_refused) return;
  say(`${points.length} points of the blades as fitted; the curve leaves these by up to ${micrometres(leavesTable(drawn.edge, table, length_m))}. Move a point to bend it.`);
}

function numbers(design: Design, edge: PlainEdge): HTMLElement[] {
  type Name = "offset_mm" | "taper_deg" | "curvature_per_m" | "length_mm";
  const number = (label: string, name: Name, unit: string, least: number, most: number): HTMLElement =>
    numberField(label, edge[name], { key: name, unit, least, most }, (value) => {
      const now = design.drawn.edge;
      const { edge_refused: _, ...kept } = design.drawn;
      const other: Edge = { ...(now && now.family !== "points" ? now : edge), [name]: value };
      design.replace({ ...kept, edge: other, edge_points: pointsOf(other) });
    });
  return [
    number("Offset", "offset_mm", "mm", -1000, 1000), number("Taper", "taper_deg", "deg", -89.9, 89.9),
    ...(edge.family === "arc" ? [number("Curvature", "curvature_per_m", "1/m", -1000, 1000)] : []),
    number("Length", "length_mm", "mm", 1, 1000),
  ];
}

/** How the edge goes with its points, or why these are none. */
function stateOf({ edge, edge_points, edge_refused }: Drawn): HTMLElement {
  if (!edge || edge_refused) {
    const sentence = edge_refused?.sentence ?? "";
    const blades = edge ? "The blades keep the edge that they had." : "The blades stay as fitted.";
    return html("p", { class: "warning", role: "alert" }, `${sentence.charAt(0).toUpperCase()}${sentence.slice(1).replace(/\.$/, "")}. ${blades}`);
  }
  const away = misfit(edge_points, edge);
  if (edge.family !== "points") {
    const other = away > 0.02 ? "; the curve through the points follows them" : "";
    return html("p", {}, `The points leave the ${edge.family} by up to ${away.toFixed(2)} mm${other}.`);
  }
  const cubics = edge.spline.weights_m.length - 3;
  const pieces = cubics === 1 ? "one cubic" : `${cubics} cubics`;
  return html("p", {}, `A smooth curve of ${pieces}, ${edge.length_mm} mm long, leaves its ${edge_points.length} points by up to ${micrometres(away)}.`);
}

function micrometres(length_mm: number): string {
  return `${Math.max(1e3 * length_mm, 0.1).toPrecision(2)} µm`;
}

// Numbers beside the drawing: layers, corners, what the blades meet, the blade's edge.

import { canFit, edgeThrough, misfit, offsetAt, rounded } from "./blade_edge";
import { Design, Kind, nameOf, Part, withAdded, withLayer, withoutPart } from "./design_state";
import { addCorner, removeCorner } from "./design_keys";
import { html, numberField } from "./elements";
import { boundsOf, crossesItself, moved, Outline, Point, resized } from "./outline";
import { Calibrated, Drawn, Edge, Layer, layerName, Piece } from "./pieces";

const ROWS = 12;
const MOST_CHECKED = 400; // corners of an outline that is looked at for sides that cross

type Say = (sentence: string) => void;

/** The layers from the lowest up, with their holes and parts. */
export function layerList(design: Design): HTMLElement {
  const { drawn, part } = design;
  const rows = drawn.layers.map((layer, i) => layerFields(design, layer, i, part.kind !== "edge" && part.layer === i));
  return html("section", { class: "design-panel" },
    html("h3", {}, "Layers, the lowest first"),
    rows.length ? html("ol", { class: "design-layers" }, ...rows) : html("p", {}, "There is no plate: draw one or load one."),
    numberField("Line of the cut, y", drawn.cut_line_mm, { key: "cut", unit: "mm", least: -1e4, most: 1e4 }, (value) =>
      design.replace({ ...design.drawn, cut_line_mm: value })));
}

function layerFields(design: Design, layer: Layer, i: number, isChosen: boolean): HTMLLIElement {
  const { drawn } = design;
  const change = (values: Partial<Layer>): void => design.replace(withLayer(design.drawn, i, (own) => ({ ...own, ...values })));
  const choose = (kind: Kind, index = 0): void => design.choose({ kind, layer: i, index });
  const name = html("input", {
    type: "text", value: layer.name, maxlength: 60, "aria-label": `Name of layer ${i + 1}`, "data-key": `name${i}`,
    change: (event) => {
      const field = event.currentTarget as HTMLInputElement;
      const others = design.drawn.layers.filter((_, k) => k !== i).map((one) => one.name);
      field.value = layerName(field.value, others, layer.name);
      if (field.value !== layer.name) change({ name: field.value });
    },
  });
  const swap = (j: number): void => {
    const layers = [...design.drawn.layers];
    [layers[i], layers[j]] = [layers[j], layers[i]];
    design.part = { kind: "outline", layer: j, index: 0 };
    design.replace({ ...design.drawn, layers });
  };
  const small = (text: string, label: string, click: () => void, isOff = false): HTMLButtonElement =>
    html("button", { type: "button", class: "small", "aria-label": `${label}: ${layer.name}`, title: label, disabled: isOff, click, "data-key": `${label}${i}` }, text);
  return html("li", { class: isChosen ? "is-chosen" : "" },
    html("div", { class: "row" },
      html("button", {
        type: "button", class: "small", "aria-pressed": String(isChosen), "data-key": `choose${i}`, click: () => choose("outline"),
        "aria-label": `Choose ${layer.name}`,
      }, isChosen ? "●" : "○"),
      name,
      small("↑", "Up", () => swap(i + 1), i + 1 === drawn.layers.length),
      small("↓", "Down", () => swap(i - 1), i === 0),
      small("×", "Remove", () => design.replace(withoutPart(design.drawn, { kind: "outline", layer: i, index: 0 })))),
    html("div", { class: "row" },
      numberField("Thickness", layer.thickness_mm, { key: `h${i}`, unit: "mm", least: 1e-4, most: 100 }, (value) => change({ thickness_mm: value })),
      numberField("Toughness", layer.toughness_ratio, { key: `j${i}`, unit: "× calibrated", least: 0.01, most: 100 }, (value) => change({ toughness_ratio: value }))),
    ...layer.holes.map((_, k) => partRow(design, { kind: "hole", layer: i, index: k })),
    ...layer.regions.map((_, k) => partRow(design, { kind: "region", layer: i, index: k })));
}

function partRow(design: Design, part: Part): HTMLElement {
  const { drawn } = design;
  const name = nameOf(drawn, part);
  const isChosen = design.part.kind === part.kind && design.part.layer === part.layer && design.part.index === part.index;
  const key = `${part.kind}${part.layer}-${part.index}`;
  const layer = drawn.layers[part.layer];
  const ratio = part.kind === "region" ? layer.regions[part.index].toughness_ratio : null;
  return html("div", { class: "row part" },
    html("button", {
      type: "button", class: "small", "aria-pressed": String(isChosen), "data-key": `choose${key}`, click: () => design.choose(part),
    }, `${isChosen ? "●" : "○"} ${name.replace(` of ${layer.name}`, "")}`),
    ratio === null ? null : numberField("Toughness", ratio, { key: `j${key}`, unit: "×", least: 0.01, most: 100 }, (value) =>
      design.replace(withLayer(design.drawn, part.layer, (own) => ({
        ...own, regions: own.regions.map((one, k) => (k === part.index ? { ...one, toughness_ratio: value } : one)),
      })))),
    html("button", {
      type: "button", class: "small", "aria-label": `Remove ${name}`, title: "Remove", "data-key": `remove${key}`,
      click: () => design.replace(withoutPart(design.drawn, part)),
    }, "×"));
}

/** The corners of the chosen outline as numbers, some at a time. */
export function cornerTable(design: Design, say: Say): HTMLElement {
  const { outline, part, drawn } = design;
  const name = nameOf(drawn, part);
  if (!outline.length) return html("section", { class: "design-panel" });
  const first = Math.min(Math.floor((design.corner ?? 0) / ROWS) * ROWS, outline.length - 1);
  const heads = part.kind === "edge" ? ["station, mm", "offset, mm"] : ["x, mm", "y, mm"];
  const isTwisted = part.kind !== "edge" && outline.length <= MOST_CHECKED && crossesItself(outline);
  return html("section", { class: "design-panel" },
    html("h3", {}, `Corners: ${name}`),
    part.kind === "edge" ? null : sizeFields(design),
    isTwisted ? html("p", { class: "warning" }, "Two sides of this outline cross each other.") : null,
    html("table", { class: "design-corners" },
      html("thead", {}, html("tr", {}, ...["corner", ...heads].map((head) => html("th", { scope: "col" }, head)))),
      html("tbody", {}, ...outline.slice(first, first + ROWS).map((point, i) => cornerRow(design, point, first + i)))),
    html("div", { class: "row" },
      html("button", { type: "button", "data-key": "add", click: () => addCorner(design, say) }, "Add corner"),
      html("button", { type: "button", "data-key": "less", click: () => removeCorner(design, say) }, "Remove corner"),
      ...(outline.length > ROWS ? turners(design, first) : [])));
}

function cornerRow(design: Design, point: Point, i: number): HTMLTableRowElement {
  const cell = (k: 0 | 1, label: string): HTMLTableCellElement => html("td", {}, numberField(
    `${label} of corner ${i + 1}`, point[k], { key: `${label}${i}`, unit: "mm", least: -1e5, most: 1e5, hideLabel: true }, (value) => {
      design.corner = i;
      design.reshape(design.outline.map((one, j): Point => (j !== i ? one : k === 0 ? [value, one[1]] : [one[0], value])));
    }));
  const isChosen = design.corner === i;
  const [x, y] = design.part.kind === "edge" ? ["station", "offset"] : ["x", "y"];
  return html("tr", { class: isChosen ? "is-chosen" : "" },
    html("th", { scope: "row" }, html("button", {
      type: "button", class: "small", "data-key": `corner${i}`, "aria-pressed": String(isChosen), "aria-label": `Choose corner ${i + 1}`,
      click: () => design.choose(design.part, i),
    }, String(i + 1))),
    cell(0, x), cell(1, y));
}

function turners(design: Design, first: number): HTMLElement[] {
  const count = design.outline.length;
  const to = (corner: number): void => design.choose(design.part, corner);
  return [
    html("button", { type: "button", "data-key": "back", disabled: first === 0, click: () => to(first - ROWS) }, "Before"),
    html("button", { type: "button", "data-key": "on", disabled: first + ROWS >= count, click: () => to(first + ROWS) }, "Next"),
    html("span", {}, `${first + 1} to ${Math.min(first + ROWS, count)} of ${count}`),
  ];
}

function sizeFields(design: Design): HTMLElement {
  const { outline } = design;
  const { low, high } = boundsOf(outline);
  const [width, height] = [high[0] - low[0], high[1] - low[1]];
  const size = { unit: "mm", least: 1e-3, most: 1e4 };
  const place = { unit: "mm", least: -1e4, most: 1e4 };
  if (!(width > 0 && height > 0)) return html("div");
  /** To a place or size; the others are those of the outline at that time. */
  const shape = (k: 0 | 1, isSize: boolean) => (value: number): void => {
    const now = boundsOf(design.outline);
    const sizes: Point = [now.high[0] - now.low[0], now.high[1] - now.low[1]];
    const by: Point = [0, 0];
    if (isSize) sizes[k] = value;
    else by[k] = value - now.low[k];
    design.reshape(isSize ? resized(design.outline, ...sizes) : moved(design.outline, ...by));
  };
  return html("div", { class: "row" },
    numberField("Left", low[0], { ...place, key: "left" }, shape(0, false)),
    numberField("Bottom", low[1], { ...place, key: "bottom" }, shape(1, false)),
    numberField("Width", width, { ...size, key: "width" }, shape(0, true)),
    numberField("Height", height, { ...size, key: "height" }, shape(1, true)));
}

/** What the blades meet along the line of the cut: one row for each strip. */
export function pieceTable(pieces: Piece[] | null, refusal: string): HTMLElement {
  const heads = ["piece", "from, mm", "to, mm", "upper face, mm", "response", "fracture energy, J/m"];
  const rows = (pieces ?? []).flatMap((piece, i) => piece.strips.map((strip, k) => {
    const from = k ? piece.strips[k - 1].end_m : piece.begin_m;
    const texts = [
      (1e3 * from).toFixed(2), (1e3 * strip.end_m).toFixed(2), shown(1e3 * piece.upper_face_m), `× ${shown(piece.scale)}`,
      shown(strip.fracture_energy_J_per_m),
    ];
    return html("tr", {}, html("th", { scope: "row" }, String(i + 1)), ...texts.map((text) => html("td", {}, text)));
  }));
  return html("section", { class: "design-panel" },
    html("h3", {}, "What the blades meet along the cut"),
    refusal ? html("p", { class: "warning", role: "alert" }, refusal) : null,
    rows.length ? html("table", {},
      html("thead", {}, html("tr", {}, ...heads.map((head) => html("th", { scope: "col" }, head)))),
      html("tbody", {}, ...rows)) : null);
}

/** The blade's edge: as fitted, or a line or an arc through drawn points or from numbers. */
export function edgePanel(design: Design, fitted: Edge): HTMLElement {
  const { drawn } = design;
  const { edge } = drawn;
  const begin = (): void => {
    const points = pointsOf(fitted);
    const added = withAdded(design.drawn, "edge", 0, points, 1);
    design.part = added.part;
    design.replace({ ...added.drawn, edge: fitted });
  };
  if (!edge) {
    return html("section", { class: "design-panel" }, html("h3", {}, "Blades"),
      html("p", {}, "The blades are as fitted."),
      html("button", { type: "button", "data-key": "blade", click: begin }, "Draw another edge"));
  }
  const change = (values: Partial<Edge>): void => {
    const other = { ...(design.drawn.edge ?? edge), ...values };
    design.replace({ ...design.drawn, edge: other, edge_points: pointsOf(other) });
  };
  const family = html("select", {
    "data-key": "family", "aria-label": "Family of the edge",
    change: (event) => design.replace(withFamily(design.drawn, (event.currentTarget as HTMLSelectElement).value as Edge["family"])),
  }, ...["line", "arc"].map((one) => html("option", { value: one, selected: one === edge.family }, one)));
  const number = (label: string, name: "offset_mm" | "taper_deg" | "curvature_per_m" | "length_mm", unit: string, least: number, most: number): HTMLElement =>
    numberField(label, edge[name], { key: name, unit, least, most }, (value) => change({ [name]: value }));
  return html("section", { class: "design-panel" }, html("h3", {}, "Blades"),
    html("div", { class: "row" },
      html("label", { class: "field" }, "Edge ", family),
      number("Offset", "offset_mm", "mm", -1000, 1000), number("Taper", "taper_deg", "deg", -89.9, 89.9),
      edge.family === "arc" ? number("Curvature", "curvature_per_m", "1/m", -1000, 1000) : null,
      number("Length", "length_mm", "mm", 1, 1000)),
    html("p", {}, `The points leave the ${edge.family} by up to ${misfit(drawn.edge_points, edge).toFixed(2)} mm.`),
    html("div", { class: "row" },
      html("button", { type: "button", "data-key": "points", click: () => design.choose({ kind: "edge", layer: 0, index: 0 }) }, "Choose its points"),
      html("button", { type: "button", "data-key": "blade", click: () => design.replace(withoutPart(design.drawn, { kind: "edge", layer: 0, index: 0 })) }, "As fitted again")));
}

function withFamily(drawn: Drawn, family: Edge["family"]): Drawn {
  return canFit(drawn.edge_points, family) ? { ...drawn, edge: edgeThrough(drawn.edge_points, family) } : drawn;
}

/** Points on an edge: five from the pivot to the tip. */
export function pointsOf(edge: Edge): Outline {
  return [0, 0.25, 0.5, 0.75, 1].map((share): Point => {
    const station = share * edge.length_mm;
    return [rounded(station, 3), rounded(offsetAt(edge, station), 4)];
  });
}

export function calibratedText({ thickness_m, fracture_energy_J_per_m }: Calibrated): string {
  return `${shown(1e3 * thickness_m)} mm thick, ${shown(fracture_energy_J_per_m)} J/m`;
}

function shown(value: number): string {
  return String(Number(value.toPrecision(4)));
}

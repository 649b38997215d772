// SVG files: outlines out of one, and a drawing as one that can be read back.

import { SVGPathData } from "svg-pathdata";
import { flattened, nested, Outline, Point } from "./outline";
import { familyOf, withEdge } from "./design_state";
import { Drawn, FAMILIES, Family, Layer, layerName } from "./pieces";
import { shownShapes } from "./svg_names";

const MOST_CHARACTERS = 2_000_000;
const MOST_SHAPES = 400;
const MOST_POINTS = 4_000;
const MOST_POINTS_OF_FILE = 20_000;
const FLAT_mm = 0.02;
const PIXEL_mm = 25.4 / 96;
const UNITS_mm: Record<string, number | undefined> = {
  "": PIXEL_mm, px: PIXEL_mm, cm: 10, mm: 1, in: 25.4, pt: 25.4 / 72, pc: 25.4 / 6,
};
const LENGTH = /^([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?)([a-z%]*)$/i;

const NAMESPACE = "http://www.w3.org/2000/svg";
const KINDS = new Set(["cut", "edge", "outline", "hole", "region"]);

/** One element's outlines in mm, y up; `marks` are its data- attributes and those of its group. */
export interface Shape {
  outlines: Outline[];
  /** Of each outline, whether its end is its begin. */
  closed: boolean[];
  id: string;
  marks: Record<string, string>;
}

/**
 * The shapes of an SVG file: paths, rectangles, circles, ellipses, polygons and polylines.
 *
 * Curves become points within 0.02 mm. Nothing of the file is shown or run: texts, pictures and
 * what display or visibility hides are passed over, and what is refused in a recipe's drawing is
 * refused here, by its name. Places are from the upper left corner of the page, y up and so below
 * 0; units are those of the width and the viewBox, a pixel (1/96 inch) where it states none.
 * Raises Error with a sentence.
 */
export function readSvg(text: string): Shape[] {
  if (text.length > MOST_CHARACTERS) throw new Error("This SVG file is larger than 2 MB: simplify it first.");
  if (text.startsWith("\x1f")) throw new Error("This SVG file is compressed (svgz): unpack it, or save it as plain SVG.");
  if (/<!(ENTITY|ATTLIST)/i.test(text)) throw new Error("This SVG file defines entities or attributes, which are not read: save it as plain SVG.");
  const page = new DOMParser().parseFromString(text, "image/svg+xml");
  const root = page.documentElement;
  if (page.querySelector("parsererror") || root.namespaceURI !== NAMESPACE || root.localName !== "svg") {
    throw new Error("This is no SVG file: it does not parse as one.");
  }
  try {
    return shapesOf(page);
  } catch (error) {
    throw new Error(`This SVG file is not taken: ${(error as Error).message}.`);
  }
}

/** The shapes of a page. Raises Error, of words that say what is wrong with it. */
function shapesOf(page: Document): Shape[] {
  const view = viewOf(page.documentElement as unknown as SVGSVGElement);
  const found: Shape[] = [];
  let points = 0;
  for (const { element, matrix } of shownShapes(page)) {
    if (found.length === MOST_SHAPES) throw new Error(`it has more than ${MOST_SHAPES} shapes`);
    const contours = outlinesOf(element, view.multiply(matrix)).filter(({ outline }) => outline.length >= 2);
    const outlines = contours.map(({ outline }) => outline);
    points += outlines.reduce((sum, one) => sum + one.length, 0);
    if (points > MOST_POINTS_OF_FILE || outlines.some((one) => one.length > MOST_POINTS)) {
      throw new Error(`it has an outline of more than ${MOST_POINTS} points, or ${MOST_POINTS_OF_FILE} in all`);
    }
    if (outlines.flat(2).some((value) => !(Math.abs(value) < 1e5))) {
      throw new Error("it has a place that is no number, or 100 m away");
    }
    if (outlines.length) found.push({ outlines, closed: contours.map(({ isClosed }) => isClosed), id: element.id, marks: marksOf(element) });
  }
  if (!found.length) throw new Error("it has no path, rectangle, circle, ellipse, polygon or polyline");
  return found;
}

/** The drawing that a file holds: one of ours as it was, any other as one layer for each plate. */
export function drawnFromSvg(text: string, thickness_mm: number): Drawn & { isOurs: boolean } {
  const shapes = readSvg(text);
  const drawn: Drawn & { isOurs: boolean } = { cut_line_mm: 0, layers: [], edge: null, edge_points: [], isOurs: false };
  const ours = shapes.filter((shape) => KINDS.has(shape.marks.kind));
  if (!ours.length) {
    const plates = nested(shapes.flatMap((shape) => shape.outlines).filter((outline) => outline.length >= 3));
    plates.forEach((plate, i) => drawn.layers.push({
      name: layerName(nameOf(shapes, plate.outline), drawn.layers.map((one) => one.name), `plate ${i + 1}`),
      thickness_mm, toughness_ratio: 1, ...plate, regions: [],
    }));
    return drawn;
  }
  drawn.isOurs = true;
  const cut = ours.find((shape) => shape.marks.kind === "cut");
  const begin = cut?.outlines[0][0] ?? [0, 0];
  drawn.cut_line_mm = Number(cut?.marks.y) || 0;
  const settle = (outline: Outline): Outline =>
    outline.map(([x, y]): Point => [round(x - begin[0]), round(y - begin[1] + drawn.cut_line_mm)]);
  for (const { outlines: found, marks } of ours) {
    const { kind, layer, ratio, thickness } = marks;
    const outlines = found.map(settle);
    if (kind === "edge") Object.assign(drawn, withEdge(drawn, outlines[0], familyIn(marks.family)));
    if (kind === "outline") {
      drawn.layers.push({
        name: layerName(layer ?? "", drawn.layers.map((one) => one.name), "plate"), thickness_mm: positive(thickness, thickness_mm), toughness_ratio: positive(ratio, 1),
        outline: outlines[0], holes: [], regions: [],
      });
    }
    const last = drawn.layers[drawn.layers.length - 1];
    if (kind === "hole" && last) last.holes.push(...outlines);
    if (kind === "region" && last) {
      last.regions.push(...outlines.map((outline) => ({ toughness_ratio: positive(ratio, 1), outline })));
    }
  }
  return drawn;
}

/**
 * A drawing as an SVG file in mm, which `drawnFromSvg` reads back; each outline has an id. Where no
 * place is below x = 0, x counts from the left of the page. The cut's mark begins at x = 0.
 */
export function svgOf(drawn: Drawn): string {
  const points = [...drawn.layers.flatMap((layer) => layer.outline), ...drawn.edge_points];
  const xs = points.map(([x]) => x).concat(0);
  const ys = points.map(([, y]) => -y).concat(-drawn.cut_line_mm);
  const [left, top] = [Math.min(...xs), Math.min(...ys) - 2];
  const [width, height] = [Math.max(...xs) + 2 - left, Math.max(...ys) + 2 - top];
  const shape = (tag: string, outline: Outline, attributes: Record<string, string>): string => {
    const named = Object.entries(attributes).map(([key, value]) => `${key}="${escaped(value)}"`).join(" ");
    return `    <${tag} ${named} points="${outline.map(([x, y]) => `${number(x)},${number(-y)}`).join(" ")}"/>`;
  };
  const groups = drawn.layers.map((layer, i) => [
    `  <g fill="none" stroke="black" stroke-width="0.3">`,
    shape("polygon", layer.outline, {
      id: `layer-${i + 1}`, "data-kind": "outline", "data-layer": layer.name,
      "data-thickness": String(layer.thickness_mm), "data-ratio": String(layer.toughness_ratio),
    }),
    ...layer.holes.map((hole, k) => shape("polygon", hole, { id: `layer-${i + 1}-hole-${k + 1}`, "data-kind": "hole" })),
    ...layer.regions.map((region, k) => shape("polygon", region.outline, {
      id: `layer-${i + 1}-region-${k + 1}`, "data-kind": "region", "data-ratio": String(region.toughness_ratio),
    })),
    "  </g>",
  ].join("\n"));
  const cut: Outline = [[0, drawn.cut_line_mm], [left + width, drawn.cut_line_mm]];
  const lines = [shape("polyline", cut, {
    id: "cut", "data-kind": "cut", "data-y": String(drawn.cut_line_mm), stroke: "red", "stroke-width": "0.2",
  })];
  if (drawn.edge_points.length) {
    lines.push(shape("polyline", drawn.edge_points, {
      id: "edge", "data-kind": "edge", "data-family": familyOf(drawn) ?? "line", stroke: "blue", fill: "none", "stroke-width": "0.3",
    }));
  }
  const box = [left, top, width, height].map(number);
  return [
    `<svg xmlns="${NAMESPACE}" width="${box[2]}mm" height="${box[3]}mm" viewBox="${box.join(" ")}">`,
    ...groups, ...lines, "</svg>", "",
  ].join("\n");
}

/** The matrix from user units to mm on the page, y up. */
function viewOf(root: SVGSVGElement): DOMMatrix {
  const [width, height] = ["width", "height"].map((key) => {
    const length = root.hasAttribute(key) ? mmOf(root, key) : null;
    if (length !== null && !(length > 0)) throw new Error(`its ${key} is not above 0: state its lengths`);
    return length;
  });
  if (!root.hasAttribute("viewBox")) return new DOMMatrix([PIXEL_mm, 0, 0, -PIXEL_mm, 0, 0]);
  const box = root.viewBox.baseVal;
  if (!box || !(box.width > 0 && box.height > 0)) throw new Error("its viewBox is not four numbers, the last two above 0");
  const across = width === null ? null : width / box.width;
  const down = height === null ? null : height / box.height;
  const scale = Math.min(across ?? Infinity, down ?? Infinity);
  const unit = Number.isFinite(scale) ? scale : PIXEL_mm;
  const [spareX, spareY] = [((across ?? unit) - unit) * box.width, ((down ?? unit) - unit) * box.height];
  const fit = (root.getAttribute("preserveAspectRatio") ?? "xMidYMid").trim();
  const isFilled = !spareX && !spareY;
  if (!(isFilled ? /^(none|xM(in|id|ax)YM(in|id|ax)( +(meet|slice))?)$/ : /^xMidYMid( +meet)?$/).test(fit)) {
    throw new Error(`its preserveAspectRatio="${fit.slice(0, 40)}" is not read: remove it, or save it as plain SVG`);
  }
  return new DOMMatrix([unit, 0, 0, -unit, 0.5 * spareX - unit * box.x, unit * box.y - 0.5 * spareY]);
}

/** A length in mm; one without a unit, or in px, is of pixels. */
function mmOf(element: Element, key: string): number {
  const text = (element.getAttribute(key) ?? "").trim();
  const found = LENGTH.exec(text);
  const unit = found ? UNITS_mm[found[2].toLowerCase()] : undefined;
  if (!found || unit === undefined) throw new Error(`its ${key}="${text.slice(0, 40)}" is relative, or no length: state a number`);
  return Number(found[1]) * unit;
}

function outlinesOf(element: SVGGeometryElement, matrix: DOMMatrix): { outline: Outline; isClosed: boolean }[] {
  const found: Outline[] = [];
  const shut = new Set<Outline>();
  const place = (x: number, y: number): Point => [matrix.a * x + matrix.c * y + matrix.e, matrix.b * x + matrix.d * y + matrix.f];
  const path = pathOf(element);
  let data: SVGPathData;
  try {
    data = new SVGPathData(path).toAbs().normalizeHVZ(false).normalizeST().aToC().qtToC();
  } catch {
    throw new Error(`it has a ${element.localName} that is not written as SVG asks${element.id ? ` (${element.id})` : ""}`);
  }
  for (const command of data.commands) {
    const own = found[found.length - 1];
    if (command.type === SVGPathData.MOVE_TO) found.push([place(command.x, command.y)]);
    else if (command.type === SVGPathData.LINE_TO) own.push(place(command.x, command.y));
    else if (command.type === SVGPathData.CURVE_TO) {
      own.push(...flattened(
        own[own.length - 1], place(command.x1, command.y1), place(command.x2, command.y2), place(command.x, command.y), FLAT_mm,
      ));
    } else if (command.type === SVGPathData.CLOSE_PATH) {
      shut.add(own);
      found.push([own[0]]);
    }
  }
  return found.map((points) => {
    const outline = settled(points);
    return { outline, isClosed: shut.has(points) || outline.length < points.length && areSame(points[0], points[points.length - 1]) };
  });
}

/** To 0.1 um, without points that stand on the one before, nor the first one again at the end. */
function settled(outline: Outline): Outline {
  const points = outline.map(([x, y]): Point => [round(x), round(y)]);
  const apart = (a: Point, b: Point): boolean => a[0] !== b[0] || a[1] !== b[1];
  const kept = points.filter((point, i) => i === 0 || apart(point, points[i - 1]));
  while (kept.length > 1 && !apart(kept[0], kept[kept.length - 1])) kept.pop();
  return kept;
}

function areSame([x1, y1]: Point, [x2, y2]: Point): boolean {
  return round(x1) === round(x2) && round(y1) === round(y2);
}

function round(value: number): number {
  return Math.round(value * 1e4) / 1e4 + 0;
}

/** An element as the commands of a path. */
function pathOf(element: SVGGeometryElement): string {
  const stated = (name: string): number | undefined => {
    if ((element.getAttribute(name) ?? "auto").trim() === "auto") return undefined;
    const value = mmOf(element, name) / PIXEL_mm;
    if (value < 0 && !["x", "y", "cx", "cy"].includes(name)) throw new Error(`it has a <${element.localName}> of a size below 0: draw it anew`);
    return value;
  };
  const length = (name: string): number => stated(name) ?? 0;
  const radii = (): Point => [stated("rx") ?? length("ry"), stated("ry") ?? length("rx")];
  const listed = (name: string): string => (element.getAttribute(name) ?? "").trim().replace(/^none$/, "");
  if (element.localName === "path") return listed("d");
  if (element.localName === "rect") {
    const [x, y, w, h] = ["x", "y", "width", "height"].map(length);
    const [rx, ry] = [Math.min(radii()[0], w / 2), Math.min(radii()[1], h / 2)];
    if (!(w > 0 && h > 0)) return "";
    if (!rx || !ry) return `M${x} ${y}h${w}v${h}h${-w}z`;
    const corner = (dx: number, dy: number): string => `a${rx} ${ry} 0 0 1 ${dx} ${dy}`;
    return `M${x + rx} ${y}h${w - 2 * rx}${corner(rx, ry)}v${h - 2 * ry}${corner(-rx, ry)}h${2 * rx - w}${corner(-rx, -ry)}v${2 * ry - h}${corner(rx, -ry)}z`;
  }
  if (element.localName === "circle" || element.localName === "ellipse") {
    const [cx, cy] = [length("cx"), length("cy")];
    const [rx, ry] = element.localName === "circle" ? [length("r"), length("r")] : radii();
    if (!(rx > 0 && ry > 0)) return "";
    return `M${cx - rx} ${cy}a${rx} ${ry} 0 1 0 ${2 * rx} 0a${rx} ${ry} 0 1 0 ${-2 * rx} 0z`;
  }
  const points = listed("points");
  if (/[^\d\s.,e+-]/i.test(points)) throw new Error("its points are no numbers: draw it anew");
  return points && `M${points}${element.localName === "polygon" ? "z" : ""}`;
}

function marksOf(element: SVGElement): Record<string, string> {
  return Object.fromEntries(Object.entries(element.dataset).map(([key, value]) => [key, value ?? ""]));
}

/** The id of the element that an outline is from. */
function nameOf(shapes: Shape[], outline: Outline): Layer["name"] {
  return shapes.find((shape) => shape.outlines.includes(outline))?.id ?? "";
}

/** The family that a drawing of ours names; where it names none, the points say it. */
function familyIn(text: string | undefined): Family | undefined {
  const family = FAMILIES.find((one) => one === text);
  if (text !== undefined && !family) throw new Error(`This drawing has an edge of the family "${text}", and an edge is one of ${FAMILIES.join(", ")}.`);
  return family;
}

function positive(text: string | undefined, otherwise: number): number {
  const value = Number(text);
  return value > 0 && Number.isFinite(value) ? value : otherwise;
}

function escaped(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;").replace(/[\u0000-\u001f]/g, " ");
}

function number(value: number): string {
  return String(Number(value.toFixed(4)) + 0);
}

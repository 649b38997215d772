// The drawing itself: plates from above, the line of the cut, corners that pointer and keys move.

import { traced } from "./blade_edge";
import { Design, Kind, nameOf, outlineAt, Part, withAdded } from "./design_state";
import { svg } from "./elements";
import { HELP, keysOf } from "./design_keys";
import { areaOf, boundsOf, circle, middle, moved, Outline, Point, rectangle } from "./outline";
import { Calibrated, Layer, materialOf } from "./pieces";

export type Tool = "move" | "polygon" | "rectangle" | "circle";

const MARGIN_px = 34;
const NEAR_px = 14;
const SMALLEST_mm2 = 1e-4;
const MOST_HANDLES = 160;
const SHAPE_mm = 10; // of a shape that Enter adds
const GRIDS_mm = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

type Drag =
  | { kind: "corner" | "whole"; outline: Outline; from: Point }
  | { kind: "pan"; origin: Point; x: number; y: number }
  | { kind: "shape"; from: Point };

export class DesignCanvas {
  tool: Tool = "move";
  /** What the next shape becomes. */
  draws: Kind = "outline";
  readonly element: SVGSVGElement;
  /** Points of a polygon that is being drawn, or the shape under the pointer. */
  private begun: Outline = [];
  private scale = 1; // px/mm
  private origin: Point = [0, 0];
  private size: Point = [0, 0];
  private drag: Drag | null = null;
  private readonly resizes: ResizeObserver;

  constructor(
    container: HTMLElement, private readonly design: Design, private readonly calibrated: Calibrated,
    private readonly say: (sentence: string) => void,
  ) {
    this.element = svg("svg", {
      class: "design-drawing", tabindex: 0, role: "application", "aria-roledescription": "drawing",
      "aria-label": `Drawing of the plates. ${HELP}`,
      pointerdown: (event) => this.pressed(event as PointerEvent),
      pointermove: (event) => this.dragged(event as PointerEvent),
      pointerup: (event) => this.released(event as PointerEvent),
      pointercancel: () => this.letGo(),
      dblclick: () => this.close(),
      wheel: (event) => this.wheeled(event as WheelEvent),
      keydown: (event) => this.keyed(event as KeyboardEvent),
    });
    container.append(this.element);
    this.resizes = new ResizeObserver(() => this.fit());
    this.resizes.observe(this.element);
  }

  dispose(): void {
    this.resizes.disconnect();
    this.element.remove();
  }

  /** Show all of the drawing. */
  fit(): void {
    this.size = [this.element.clientWidth, this.element.clientHeight];
    const { layers, edge_points, cut_line_mm } = this.design.drawn;
    const points: Point[] = [...layers.flatMap((layer) => layer.outline), ...edge_points, [0, cut_line_mm]];
    if (points.length < 3) points.push([80, 30], [0, -30]);
    const { low, high } = boundsOf(points);
    const [width, height] = [Math.max(high[0] - low[0], 1), Math.max(high[1] - low[1], 1)];
    const free = this.size.map((one) => Math.max(one - 2 * MARGIN_px, 40));
    this.scale = Math.min(free[0] / width, free[1] / height);
    this.origin = [
      0.5 * (this.size[0] - this.scale * (low[0] + high[0])), 0.5 * (this.size[1] + this.scale * (low[1] + high[1])),
    ];
    this.redraw();
  }

  zoom(factor: number, at: Point = [0.5 * this.size[0], 0.5 * this.size[1]]): void {
    const scale = Math.min(Math.max(this.scale * factor, 0.05), 500);
    this.origin = this.origin.map((one, k) => at[k] - ((at[k] - one) * scale) / this.scale) as Point;
    this.scale = scale;
    this.redraw();
  }

  get isDragging(): boolean {
    return this.drag !== null;
  }

  choose(tool: Tool): void {
    this.tool = tool;
    this.begun = [];
    this.redraw();
  }

  redraw(): void {
    const { drawn, part } = this.design;
    this.element.setAttribute("viewBox", `0 0 ${Math.max(this.size[0], 1)} ${Math.max(this.size[1], 1)}`);
    this.element.dataset.tool = this.tool;
    this.element.replaceChildren(
      this.grid(),
      ...drawn.layers.map((layer, i) => this.layer(layer, i === part.layer && part.kind !== "edge")),
      this.cut(), this.edge(), this.chosen(), this.sketch(),
    );
  }

  /** Add a shape of the chosen tool about the middle of what is seen, on the line of the cut. */
  addShape(): void {
    const centre: Point = [Math.round(this.placeOf([0.5 * this.size[0], 0])[0]), this.design.drawn.cut_line_mm];
    const half = 0.5 * SHAPE_mm;
    const outline = this.tool === "circle" ? circle(centre, half)
      : rectangle([centre[0] - half, centre[1] - half], [centre[0] + half, centre[1] + half]);
    this.add(outline);
  }

  private add(outline: Outline): void {
    if (this.draws === "edge" && this.tool !== "polygon") {
      this.leave();
      return this.say("An edge is no closed shape: draw it as a polygon, from the pivot to the tip.");
    }
    if (this.draws !== "edge" && Math.abs(areaOf(outline)) < SMALLEST_mm2) return this.say("This outline encloses no area.");
    const { drawn, part } = this.design;
    const added = withAdded(drawn, this.draws, part.layer, outline, 1e3 * this.calibrated.thickness_m);
    this.begun = [];
    this.tool = "move";
    this.design.part = added.part;
    this.design.corner = null;
    this.design.replace(added.drawn);
    this.say(`Added: ${nameOf(added.drawn, added.part)}.`);
  }

  // Places: mm with y up, pixels with y down.

  private at([x, y]: Point): Point {
    return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y];
  }

  private placeOf([x, y]: Point): Point {
    return [(x - this.origin[0]) / this.scale, (this.origin[1] - y) / this.scale];
  }

  /** Where a pointer stands, on the finest grid that it can hit unless Alt is held. */
  private pointed(event: MouseEvent): { px: Point; mm: Point } {
    const box = this.element.getBoundingClientRect();
    const px: Point = [event.clientX - box.left, event.clientY - box.top];
    const fine = event.altKey ? 0.01 : GRIDS_mm.find((one) => one * this.scale >= 3) ?? 1;
    return { px, mm: this.placeOf(px).map((one) => Number((fine * Math.round(one / fine)).toFixed(4))) as Point };
  }

  private path(outlines: readonly Outline[], isClosed = true): string {
    return outlines.map((outline) => {
      const points = outline.map((point) => this.at(point).map((one) => one.toFixed(1)).join(" "));
      return points.length ? `M${points.join("L")}${isClosed ? "Z" : ""}` : "";
    }).join("");
  }

  private grid(): SVGGElement {
    const step = GRIDS_mm.find((one) => one * this.scale >= 44) ?? 1000;
    const [left, top] = this.placeOf([0, 0]);
    const [right, bottom] = this.placeOf(this.size);
    const group = svg("g", { class: "design-grid" });
    for (let x = Math.ceil(left / step); x * step <= right; x++) {
      const [at] = this.at([x * step, 0]);
      group.append(svg("path", { d: `M${at} 0V${this.size[1]}` }));
      if (at < this.size[0] - 50) group.append(svg("text", { x: at + 3, y: this.size[1] - 5 }, String(Number((x * step).toFixed(1)))));
    }
    for (let y = Math.ceil(bottom / step); y * step <= top; y++) {
      const [, at] = this.at([0, y * step]);
      group.append(svg("path", { d: `M0 ${at}H${this.size[0]}` }));
      const isFree = at < this.size[1] - 24 && Math.abs(at - this.at([0, this.design.drawn.cut_line_mm])[1]) > 14;
      if (isFree) group.append(svg("text", { x: 4, y: at - 3 }, `${Number((y * step).toFixed(1))}`));
    }
    group.append(svg("text", { x: this.size[0] - 5, y: this.size[1] - 5, "text-anchor": "end" }, "mm"));
    return group;
  }

  private layer(layer: Layer, isChosen: boolean): SVGGElement {
    return svg("g", { class: `design-layer${isChosen ? " is-chosen" : ""}` },
      svg("path", { class: "design-plate", d: this.path([layer.outline, ...layer.holes]), "fill-rule": "evenodd" }),
      ...layer.regions.map((region) => svg("path", {
        class: region.toughness_ratio >= layer.toughness_ratio ? "design-tougher" : "design-weaker",
        d: this.path([region.outline]),
      })));
  }

  /** The line of the cut, and bold on it where the blades meet material. */
  private cut(): SVGGElement {
    const { cut_line_mm, layers } = this.design.drawn;
    const [, y] = this.at([0, cut_line_mm]);
    const group = svg("g", { class: "design-cut" }, svg("path", { d: `M0 ${y}H${this.size[0]}` }));
    layers.forEach((layer, i) => {
      for (const [from, to] of materialOf(layer, cut_line_mm)) {
        const [[x1], [x2]] = [this.at([from, 0]), this.at([to, 0])];
        group.append(svg("path", { class: "design-met", d: `M${x1} ${y - 3 * i}H${x2}` }));
      }
    });
    group.append(svg("path", { class: "design-arrow", d: `M6 ${y - 5}l9 5l-9 5z` }));
    // above the lines of all layers
    group.append(svg("text", { x: 20, y: y - 6 - 3 * Math.max(layers.length - 1, 0) }, `cut, y = ${cut_line_mm}`));
    return group;
  }

  private edge(): SVGGElement {
    const { edge, edge_points } = this.design.drawn;
    const group = svg("g", { class: "design-edge" });
    if (!edge_points.length) return group;
    const [x, y] = this.at([0, 0]);
    if (edge) group.append(svg("path", { d: this.path([traced(edge, edge_points)], false) }));
    group.append(svg("circle", { cx: x, cy: y, r: 4 }));
    group.append(svg("text", { x: x + 6, y: y + 14 }, "pivot"));
    return group;
  }

  /** The chosen outline with its corners, and between them where a new one can be pulled out. */
  private chosen(): SVGGElement {
    const { outline, part, corner } = this.design;
    const group = svg("g", { class: "design-chosen" });
    group.append(svg("path", { class: part.kind === "edge" ? "design-through" : "", d: this.path([outline], part.kind !== "edge") }));
    if (outline.length > MOST_HANDLES || this.tool !== "move") return group;
    const between = outline.map((point, i) => middle(point, outline[(i + 1) % outline.length]));
    if (part.kind === "edge") between.pop();
    const isClose = this.reach < NEAR_px;
    for (const point of isClose ? [] : between) {
      const [cx, cy] = this.at(point);
      group.append(svg("circle", { class: "design-between", cx, cy, r: 3 }));
    }
    outline.forEach((point, i) => {
      const [cx, cy] = this.at(point);
      group.append(svg("circle", { class: i === corner ? "design-corner is-chosen" : "design-corner", cx, cy, r: i === corner ? 7 : isClose ? 2 : 5 }));
    });
    return group;
  }

  private sketch(): SVGPathElement {
    return svg("path", { class: "design-sketch", d: this.path([this.begun], this.tool !== "polygon") });
  }

  // The pointer.

  private pressed(event: PointerEvent): void {
    if (event.button !== 0 || this.drag) return;
    this.element.focus({ preventScroll: true });
    this.element.setPointerCapture(event.pointerId);
    const { px, mm } = this.pointed(event);
    if (this.tool === "polygon") {
      const isClosing = this.begun.length >= 3 && this.isNear(px, this.begun[0]);
      if (isClosing) this.close();
      else {
        this.begun = [...this.begun, mm];
        this.redraw();
      }
    } else if (this.tool === "move") {
      this.grab(px, mm);
    } else {
      this.drag = { kind: "shape", from: mm };
    }
  }

  private grab(px: Point, mm: Point): void {
    const { design } = this;
    const { outline, part } = design;
    const most = outline.length <= MOST_HANDLES ? outline.length : 0;
    const { reach } = this;
    const corner = outline.slice(0, most).findIndex((point) => this.isNear(px, point, reach));
    const last = part.kind === "edge" ? most - 1 : most;
    const between = reach < NEAR_px ? -1 : outline.slice(0, Math.max(last, 0))
      .findIndex((point, i) => this.isNear(px, middle(point, outline[(i + 1) % outline.length])));
    if (corner >= 0) {
      design.choose(part, corner);
      this.drag = { kind: "corner", outline, from: mm };
    } else if (between >= 0) {
      const longer = [...outline.slice(0, between + 1), mm, ...outline.slice(between + 1)];
      design.corner = between + 1;
      design.reshape(longer, false);
      this.drag = { kind: "corner", outline: longer, from: mm };
    } else {
      const under = this.under(px);
      if (under) {
        design.choose(under);
        this.drag = { kind: "whole", outline: design.outline, from: mm };
      } else {
        this.drag = { kind: "pan", origin: this.origin, x: px[0], y: px[1] };
      }
    }
  }

  /** The outline that lies on top under a pointer. */
  private under(px: Point): Part | null {
    const { layers } = this.design.drawn;
    const parts = layers.flatMap((layer, i): Part[] => [
      { kind: "outline", layer: i, index: 0 },
      ...layer.regions.map((_, index): Part => ({ kind: "region", layer: i, index })),
      ...layer.holes.map((_, index): Part => ({ kind: "hole", layer: i, index })),
    ]);
    const own = parts.filter((part) => part.layer === this.design.part.layer && part.kind !== "outline");
    const context = document.createElement("canvas").getContext("2d");
    const isOver = (part: Part): boolean =>
      context?.isPointInPath(new Path2D(this.path([outlineAt(this.design.drawn, part)])), px[0], px[1]) ?? false;
    return own.reverse().find(isOver) ?? parts.reverse().find(isOver) ?? null;
  }

  private dragged(event: PointerEvent): void {
    const { drag, design } = this;
    const { px, mm } = this.pointed(event);
    if (drag?.kind === "pan") {
      this.origin = [drag.origin[0] + px[0] - drag.x, drag.origin[1] + px[1] - drag.y];
      this.redraw();
    } else if (drag?.kind === "shape") {
      const radius = Math.hypot(mm[0] - drag.from[0], mm[1] - drag.from[1]);
      this.begun = this.tool === "circle" ? (radius > 0 ? circle(drag.from, radius) : []) : rectangle(drag.from, mm);
      this.redraw();
    } else if (drag?.kind === "corner" && design.corner !== null) {
      design.reshape(drag.outline.map((point, i) => (i === design.corner ? mm : point)), false);
    } else if (drag?.kind === "whole" && (mm[0] !== drag.from[0] || mm[1] !== drag.from[1])) {
      design.reshape(moved(drag.outline, mm[0] - drag.from[0], mm[1] - drag.from[1]), false);
    }
  }

  private released(event: PointerEvent): void {
    if (this.element.hasPointerCapture(event.pointerId)) this.element.releasePointerCapture(event.pointerId);
    const isShape = this.drag?.kind === "shape";
    this.drag = null;
    this.design.finish();
    if (!isShape) return;
    const { low, high } = boundsOf(this.begun);
    if (high[0] > low[0] && high[1] > low[1]) this.add(this.begun);
    else this.begun = [];
  }

  private letGo(): void {
    this.drag = null;
    this.design.finish();
  }

  private wheeled(event: WheelEvent): void {
    if (!event.ctrlKey && !event.metaKey) return; // the page scrolls
    event.preventDefault();
    this.zoom(Math.exp(-0.002 * event.deltaY), this.pointed(event).px);
  }

  private keyed(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey) return;
    const done = keysOf(this, this.design, this.say, event)[event.key];
    if (!done) return;
    done();
    event.preventDefault();
    event.stopPropagation();
  }

  /** End the polygon that is being drawn; what has no polygon gets a shape of the chosen tool. */
  enter(): void {
    if (this.tool === "polygon" && this.begun.length) this.close();
    else this.addShape();
  }

  /** Leave what is being drawn. */
  leave(): void {
    this.begun = [];
    this.redraw();
  }

  private close(): void {
    if (this.tool !== "polygon") return;
    const points = this.begun.filter((point, i, all) => i === 0 || point[0] !== all[i - 1][0] || point[1] !== all[i - 1][1]);
    if (points.length >= (this.draws === "edge" ? 2 : 3)) this.add(points);
    else this.say(this.draws === "edge" ? "An edge needs two points." : "A polygon needs three corners.");
  }

  private isNear(px: Point, mm: Point, reach = NEAR_px): boolean {
    const [x, y] = this.at(mm);
    return Math.hypot(px[0] - x, px[1] - y) <= reach;
  }

  /** How near (px) a corner of the chosen outline is grabbed: less where they stand close, as on a circle. */
  private get reach(): number {
    const { outline } = this.design;
    const shortest = outline.reduce((least, [x, y], i) => {
      const [x2, y2] = outline[(i + 1) % outline.length];
      return Math.min(least, Math.hypot(x2 - x, y2 - y));
    }, Infinity);
    return Math.min(NEAR_px, Math.max(0.4 * shortest * this.scale, 3));
  }
}

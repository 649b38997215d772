// The drawing as it is being made: which part of it is chosen, and the steps back and forward.

import { edgeThrough, nearestFamily, rounded } from "./blade_edge";
import { Outline, rectangle } from "./outline";
import { Calibrated, Drawn, Family, Layer, layerName } from "./pieces";

export type Kind = "outline" | "hole" | "region" | "edge";

/** One outline of a drawing; `index` counts holes and regions of a layer. */
export interface Part {
  kind: Kind;
  layer: number;
  index: number;
}

const MOST_STEPS = 200;
const TOUGHER = 2;

/** A drawing, and the text of the recipe that it goes into. */
interface Step {
  drawn: Drawn;
  base: string | null;
  /** Whether it is that of a recipe without layers, which is about the uniform sheet. */
  isUniform: boolean;
}

/** A drawing with its history. Drawings are never changed, only replaced. */
export class Design {
  part: Part = { kind: "outline", layer: 0, index: 0 };
  /** The chosen corner of the chosen part, null for the part as a whole. */
  corner: number | null = null;
  private present: Step;
  private readonly before: Step[] = [];
  private readonly after: Step[] = [];
  private isOpen = false;

  constructor(drawn: Drawn, private readonly changed: (isDone: boolean) => void, base: string | null = null) {
    this.present = { drawn, base, isUniform: false };
  }

  get drawn(): Drawn {
    return this.present.drawn;
  }

  /** Text of the recipe that the drawing goes into; null: the page makes one. */
  get base(): string | null {
    return this.present.base;
  }

  get isUniform(): boolean {
    return this.present.isUniform;
  }

  get outline(): Outline {
    return outlineAt(this.drawn, this.part);
  }

  choose(part: Part, corner: number | null = null): void {
    this.part = part;
    this.corner = corner;
    this.settle();
    this.changed(false);
  }

  /** Replace the drawing. Replacements up to one that is done are one step back. */
  replace(drawn: Drawn, isDone = true, base = this.base, isUniform = false): void {
    if (!this.isOpen) {
      this.before.push(this.present);
      if (this.before.length > MOST_STEPS) this.before.shift();
      this.after.length = 0;
    }
    this.isOpen = !isDone;
    this.present = { drawn, base, isUniform };
    this.settle();
    this.changed(isDone);
  }

  /** End a step that was begun by replacements that are not done. */
  finish(): void {
    if (!this.isOpen) return;
    this.isOpen = false;
    this.changed(true);
  }

  reshape(outline: Outline, isDone = true): void {
    this.replace(withOutline(this.drawn, this.part, outline), isDone);
  }

  undo(): void {
    this.step(this.before, this.after);
  }

  redo(): void {
    this.step(this.after, this.before);
  }

  get canUndo(): boolean {
    return this.before.length > 0;
  }

  get canRedo(): boolean {
    return this.after.length > 0;
  }

  private step(from: Step[], to: Step[]): void {
    const next = from.pop();
    if (!next) return;
    this.isOpen = false;
    to.push(this.present);
    this.present = next;
    this.settle();
    this.changed(true);
  }

  /** Keep the choice within what there is. */
  private settle(): void {
    const { layers } = this.drawn;
    const { kind } = this.part;
    if (kind === "edge") {
      if (!this.drawn.edge_points.length) this.part = { kind: "outline", layer: 0, index: 0 };
    } else {
      const layer = Math.max(Math.min(this.part.layer, layers.length - 1), 0);
      const count = kind === "hole" ? layers[layer]?.holes.length : kind === "region" ? layers[layer]?.regions.length : 1;
      const isThere = this.part.index < (count ?? 0);
      this.part = isThere ? { ...this.part, layer } : { kind: "outline", layer, index: 0 };
    }
    if (this.corner !== null && this.corner >= this.outline.length) this.corner = null;
  }
}

export function outlineAt(drawn: Drawn, { kind, layer, index }: Part): Outline {
  if (kind === "edge") return drawn.edge_points;
  const own = drawn.layers[layer];
  if (kind === "outline") return own?.outline ?? [];
  return (kind === "hole" ? own?.holes[index] : own?.regions[index]?.outline) ?? [];
}

export function withOutline(drawn: Drawn, { kind, layer, index }: Part, outline: Outline): Drawn {
  if (kind === "edge") return withEdge(drawn, outline);
  return withLayer(drawn, layer, (own) => {
    if (kind === "outline") return { ...own, outline };
    if (kind === "hole") return { ...own, holes: own.holes.map((hole, i) => (i === index ? outline : hole)) };
    return { ...own, regions: own.regions.map((region, i) => (i === index ? { ...region, outline } : region)) };
  });
}

/** With other points of the edge and the edge through them; where they make none, the edge stays, and why is kept. */
export function withEdge(drawn: Drawn, edge_points: Outline, family = familyOf(drawn) ?? nearestFamily(edge_points)): Drawn {
  const { edge_refused: _, ...kept } = drawn;
  try {
    return { ...kept, edge_points, edge: edgeThrough(edge_points, family) };
  } catch (error) {
    return { ...kept, edge_points, edge_refused: { family, sentence: (error as Error).message } };
  }
}

/** The family that the edge's points are to be. */
export function familyOf(drawn: Drawn): Family | undefined {
  return drawn.edge_refused?.family ?? drawn.edge?.family;
}

export function withoutEdge(drawn: Drawn): Drawn {
  const { edge_refused: _, ...kept } = drawn;
  return { ...kept, edge: null, edge_points: [] };
}

/** Points of an edge that is drawn from the tip on the other way round, and straight on to a pivot that they do not reach. */
function fromPivot(points: Outline): Outline {
  const rising = points.every(([s], i) => i === 0 || s < points[i - 1][0]) ? [...points].reverse() : points;
  const [[s0, e0], [s1, e1]] = rising;
  if (!(s0 > 0 && s1 > s0)) return rising;
  return [[0, rounded(e0 - (s0 * (e1 - e0)) / (s1 - s0), 4)], ...rising];
}

export function withLayer(drawn: Drawn, layer: number, change: (own: Layer) => Layer): Drawn {
  return { ...drawn, layers: drawn.layers.map((own, i) => (i === layer ? change(own) : own)) };
}

export function withoutPart(drawn: Drawn, { kind, layer, index }: Part): Drawn {
  if (kind === "edge") return withoutEdge(drawn);
  if (kind === "outline") return { ...drawn, layers: drawn.layers.filter((_, i) => i !== layer) };
  return withLayer(drawn, layer, (own) => ({
    ...own,
    holes: kind === "hole" ? own.holes.filter((_, i) => i !== index) : own.holes,
    regions: kind === "region" ? own.regions.filter((_, i) => i !== index) : own.regions,
  }));
}

/** Add an outline of a kind; holes and regions go into the given layer. */
export function withAdded(
  drawn: Drawn, kind: Kind, layer: number, outline: Outline, thickness_mm: number,
): { drawn: Drawn; part: Part } {
  if (kind === "edge") {
    const points = fromPivot(outline);
    return { drawn: withEdge(drawn, points, nearestFamily(points)), part: { kind, layer: 0, index: 0 } };
  }
  const own = drawn.layers[layer];
  if (kind === "outline" || !own) {
    const names = drawn.layers.map((one) => one.name);
    const added: Layer = {
      name: layerName(`layer ${drawn.layers.length + 1}`, names, "layer"), thickness_mm, toughness_ratio: 1, outline, holes: [], regions: [],
    };
    return { drawn: { ...drawn, layers: [...drawn.layers, added] }, part: { kind: "outline", layer: drawn.layers.length, index: 0 } };
  }
  const found = withLayer(drawn, layer, (one) => (kind === "hole"
    ? { ...one, holes: [...one.holes, outline] }
    : { ...one, regions: [...one.regions, { toughness_ratio: TOUGHER, outline }] }));
  const index = kind === "hole" ? own.holes.length : own.regions.length;
  return { drawn: found, part: { kind, layer, index } };
}

/** The sheet as it was calibrated: what one begins to draw with. */
export function plainSheet(calibrated: Calibrated, length_m: number): Drawn {
  const length = Math.max(10, 10 * Math.round(160 * length_m));
  return {
    cut_line_mm: 0, edge: null, edge_points: [],
    layers: [{
      name: "sheet", thickness_mm: Number((1e3 * calibrated.thickness_m).toPrecision(6)), toughness_ratio: 1,
      outline: rectangle([0, -30], [length, 30]), holes: [], regions: [],
    }],
  };
}

/** What a part is called beside the drawing. */
export function nameOf(drawn: Drawn, { kind, layer, index }: Part): string {
  if (kind === "edge") return "edge of the blade";
  const name = drawn.layers[layer]?.name ?? "plate";
  if (kind === "outline") return name;
  return `${kind === "hole" ? "hole" : "part"} ${index + 1} of ${name}`;
}

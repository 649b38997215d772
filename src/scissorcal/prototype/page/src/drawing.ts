// The plain look: scissors and sheet from the side, the contact magnified, the sheet from above.

import { Step } from "./kernel";
import { bladeLength, heldValue, Law } from "./law";
import { Pose } from "./hand";
import { rectangle } from "./outline";
import { Drawn, Piece } from "./pieces";
import { Scene } from "./scene";
import { slabsOf, Tinted } from "./slabs";

/** What is drawn; without pieces the sheet is uniform. `drawn` is what the pieces were made of. */
export interface View {
  scene: Scene;
  law: Law;
  pose: Pose;
  wanted: Pose;
  step: Step;
  crack: number;
  pieces?: readonly Piece[] | null;
  /** Crack of each piece, m. */
  cracks?: readonly number[] | null;
  drawn?: Drawn | null;
}

interface Colours {
  ink: string;
  muted: string;
  grid: string;
  paper: string;
  raised: string;
  fitted: string;
  whatIf: string;
  material: string;
  hand: string;
}

type Point = [number, number];

/** Width of the picture, in lengths of the blades. */
export const LENGTHS_ACROSS = 2.1;
const EDGE_POINTS = 120; // as fine as sixteen cubics ask
const STRIP_px = 56;
const HALF_WIDTH_mm = 30; // of a plate that nobody drew
const THINNEST_px = 2;
const SECOND = 0.55; // opacity of a layer on another one
const KNOB_px = 10;
const LENS_m = 0.0012; // across the magnified circle

export class Drawing {
  /** Where the handle is that a person drags, px. */
  handle: [number, number] = [0, 0];
  private scale = 1;
  private origin: Point = [0, 0];
  private readonly context: CanvasRenderingContext2D;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d", { alpha: false }) as CanvasRenderingContext2D;
  }

  draw(view: View): void {
    const { width, height } = this.fit();
    const colours = coloursOf(this.canvas);
    const length = bladeLength(view.law);
    this.scale = width / (LENGTHS_ACROSS * length);
    this.origin = [0.29 * width, 0.5 * (height - STRIP_px)];
    const context = this.context;
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, width, height);
    this.sheet(view, colours, width);
    const beta = view.pose.opening / view.scene.moving_blades;
    this.blade(view, beta, 1, colours);
    this.blade(view, view.scene.moving_blades === 2 ? beta : 0, -1, colours);
    this.hand(view, colours);
    this.knob(view, colours);
    this.circle(this.origin, 4, colours.ink);
    this.lens(view, colours, width);
    this.strip(view, colours, width, height);
  }

  private fit(): { width: number; height: number } {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return { width, height };
  }

  private at([x, y]: Point): Point {
    return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y];
  }

  private path(points: Point[], close: boolean): void {
    this.context.beginPath();
    points.forEach((point, i) => {
      const [x, y] = this.at(point);
      if (i) this.context.lineTo(x, y);
      else this.context.moveTo(x, y);
    });
    if (close) this.context.closePath();
  }

  private blade(view: View, beta: number, side: 1 | -1, colours: Colours): void {
    const edge = edgeOf(view);
    const turned = (s: number, e: number): Point => [
      s * Math.cos(beta) - e * Math.sin(beta), side * (s * Math.sin(beta) + e * Math.cos(beta)),
    ];
    const length = bladeLength(view.law);
    const offset = side === -1 && view.scene.moving_blades === 1 ? 0 : 1;
    const depth = Math.max(Math.abs(edge[0][1]), 0.06 * length);
    const back = edge.map(([s, e]): Point => [s, offset * e + 2 * depth * (1 - 0.85 * Math.max(s, 0) / length)]);
    const outline = [...edge.map(([s, e]): Point => turned(s, offset * e)), ...back.reverse().map(([s, e]) => turned(s, e))];
    const context = this.context;
    context.globalAlpha = 0.85;
    this.path(outline, true);
    context.fillStyle = colours.raised;
    context.fill();
    context.globalAlpha = 1;
    context.strokeStyle = colours.muted;
    context.lineWidth = 1;
    context.stroke();
    this.path(edge.map(([s, e]) => turned(s, offset * e)), false);
    context.strokeStyle = colours.ink;
    context.lineWidth = 2;
    context.stroke();
    // The handle: behind the pivot, on the other side.
    const reach = 0.42 * length;
    const [x, y] = this.at([-reach * Math.cos(beta), -side * (reach * Math.sin(beta) + 0.06 * length)]);
    const [x0, y0] = this.at([0, 0]);
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x, y);
    context.strokeStyle = colours.muted;
    context.lineWidth = 5;
    context.stroke();
    context.beginPath();
    context.ellipse(x - 12, y, 16, 11, 0, 0, 2 * Math.PI);
    context.lineWidth = 4;
    context.stroke();
  }

  /** The sheet or the plates from the side, and behind the crack the two flaps. */
  private sheet(view: View, colours: Colours, width: number): void {
    const { scene, pose } = view;
    const contact = Math.max(view.crack - pose.advance, 0);
    const right = (width - this.origin[0]) / this.scale;
    const whole = 2 * scene.upper_face_m;
    const layers: Stretch[] = view.pieces ? stretchesOf(view, view.pieces) : [
      { from: Math.max(-pose.advance, 0), cut: contact, to: right, low: -0.5 * whole, high: 0.5 * whole, isSecond: false },
    ];
    const thinnest = layers.reduce((least, { low, high }) => Math.min(least, high - low), Infinity);
    const factor = Math.max(1, THINNEST_px / (this.scale * thinnest)); // so that each layer is seen
    const context = this.context;
    context.strokeStyle = context.fillStyle = colours.material;
    for (const { from, cut, to, low, high, isSecond } of layers) {
      context.globalAlpha = isSecond ? SECOND : 1;
      if (to > cut && cut < right) this.box([Math.max(cut, 0), factor * high], [Math.min(to, right), factor * low]);
      const [near, far] = [Math.min(cut, to), Math.max(from, 0)];
      if (near <= far) continue;
      context.globalAlpha = 0.6;
      context.lineWidth = Math.max(factor * (high - low) * this.scale, 2);
      for (const side of [1, -1] as const) {
        const flap: Point[] = [];
        for (let i = 0; i <= 20; i++) {
          const x = near + ((far - near) * i) / 20;
          flap.push([x, side * Math.min(heightOver(view, x), 0)]);
        }
        this.path(flap, false);
        context.stroke();
      }
    }
    context.globalAlpha = 1;
  }

  private box([left, top]: Point, [right, bottom]: Point): void {
    const [[x, y], [x1, y1]] = [this.at([left, top]), this.at([right, bottom])];
    this.context.fillRect(x, y, x1 - x, y1 - y);
  }

  /** What a person drags: it moves as the pointer does, down where the blades close. */
  private knob(view: View, colours: Colours): void {
    const length = bladeLength(view.law);
    const beta = view.wanted.opening / view.scene.moving_blades;
    const isBoth = view.scene.moving_blades === 2;
    const reach = isBoth ? -0.42 * length : 0.97 * length; // the ring that goes down, or the tip that does
    const side = isBoth ? -1 : 1;
    const [x, y] = this.at([reach * Math.cos(beta), side * (reach * Math.sin(beta) - (isBoth ? 0.06 : -0.06) * length)]);
    const context = this.context;
    const at: Point = isBoth ? [x - 12, y] : [x, y];
    this.handle = at;
    this.circle(at, KNOB_px, colours.hand);
    context.fillStyle = colours.paper;
    for (const way of [1, -1]) {
      context.beginPath();
      context.moveTo(at[0] - 4, at[1] + 2 * way);
      context.lineTo(at[0] + 4, at[1] + 2 * way);
      context.lineTo(at[0], at[1] + 7 * way);
      context.fill();
    }
  }

  /** Where the hand is while the blades stay behind it. */
  private hand(view: View, colours: Colours): void {
    const lag = view.wanted.opening - view.pose.opening;
    if (Math.abs(lag) < 0.003) return;
    const reach = 0.5 * bladeLength(view.law);
    const beta = view.wanted.opening / view.scene.moving_blades;
    this.context.setLineDash([4, 4]);
    this.context.strokeStyle = colours.hand;
    this.context.lineWidth = 1.5;
    for (const side of [1, -1]) {
      this.path([[0, 0], [-reach * Math.cos(beta), -side * reach * Math.sin(beta)]], false);
      this.context.stroke();
    }
    this.context.setLineDash([]);
  }

  private circle([x, y]: Point, radius: number, colour: string): void {
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.fillStyle = colour;
    this.context.fill();
  }

  /** The contact, some hundred times larger: how the edges press the sheet. */
  private lens(view: View, colours: Colours, width: number): void {
    // right of the blades' tips, and with its caption above the line of the cut
    const [beside, above] = [width - this.at([bladeLength(view.law), 0])[0], this.origin[1]];
    const radius = Math.max(Math.min(58, 0.5 * beside - 7, 0.5 * (above - 44)), 10);
    const [x, y] = [width - radius - 10, radius + 8];
    const context = this.context;
    const kept: [number, Point] = [this.scale, this.origin];
    const contact = Math.max(view.crack - view.pose.advance, 0);
    this.scale = (2 * radius) / LENS_m;
    this.origin = [x - this.scale * contact, y];
    context.save();
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = colours.paper;
    context.fill();
    context.clip();
    const [left, right] = [contact - 0.5 * LENS_m, contact + 0.5 * LENS_m];
    const face = view.scene.upper_face_m;
    const pressed = (at: number): number => Math.min(face, Math.max(heightOver(view, at), -face));
    const upper: Point[] = [];
    for (let i = 0; i <= 30; i++) {
      const at = contact + ((right - contact) * i) / 30;
      upper.push([at, Math.min(face, pressed(contact) + 0.5 * (at - contact))]);
    }
    const lower = upper.map(([at, height]): Point => [at, view.scene.moving_blades === 2 ? -height : -face]);
    this.path([...upper, ...lower.reverse()], true);
    context.fillStyle = colours.material;
    context.fill();
    for (const side of view.scene.moving_blades === 2 ? [1, -1] : [1]) {
      const edge: Point[] = [];
      for (let i = 0; i <= 30; i++) {
        const at = left + ((right - left) * i) / 30;
        edge.push([at, side * heightOver(view, at)]);
      }
      this.path(edge, false);
      context.strokeStyle = colours.ink;
      context.lineWidth = 2;
      context.stroke();
    }
    context.restore();
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = colours.muted;
    context.lineWidth = 1;
    context.stroke();
    [this.scale, this.origin] = kept;
    context.fillStyle = colours.muted;
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    const middle = Math.min(x, width - 36);
    context.fillText("contact,", middle, y + radius + 13);
    context.fillText(`${(1e3 * LENS_m).toFixed(1)} mm wide`, middle, y + radius + 25);
  }

  /** From above: sheet or plates with holes and layers, what is cut, and where the scissors stand. */
  private strip(view: View, colours: Colours, width: number, height: number): void {
    const context = this.context;
    const [top, middle] = [height - STRIP_px + 16, height - 0.5 * (STRIP_px - 16)];
    const scale = this.scale;
    const left = this.origin[0] - view.pose.advance * scale;
    context.save();
    context.beginPath();
    context.rect(0, top, width, STRIP_px - 20);
    context.clip();
    const reach_mm = (1e3 * (width - left)) / scale;
    const slabs = slabsOf(view, HALF_WIDTH_mm) ?? [plainSlab(Math.max(reach_mm, 0))];
    for (const slab of slabs) this.slab(slab, [left, middle], view.drawn?.cut_line_mm ?? 0, colours);
    context.restore();
    context.strokeStyle = colours.ink;
    context.lineWidth = 2;
    for (const [from, to] of cutsOf(view)) {
      context.beginPath();
      context.moveTo(left + from * scale, middle);
      context.lineTo(left + to * scale, middle);
      context.stroke();
    }
    context.strokeStyle = colours.muted;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(this.origin[0], middle);
    context.lineTo(this.origin[0] + bladeLength(view.law) * scale, middle);
    context.setLineDash([2, 3]);
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = colours.muted;
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText(`from above: ${(1e3 * view.crack).toFixed(1)} mm cut`, 8, top - 4);
  }

  private slab({ outline, holes, tint }: Tinted, [left, middle]: Point, cut_mm: number, colours: Colours): void {
    const context = this.context;
    const mm = 1e-3 * this.scale;
    context.beginPath();
    for (const contour of [outline, ...holes]) {
      contour.forEach(([x, y], i) => {
        const place: Point = [left + mm * x, middle - mm * (y - cut_mm)];
        if (i) context.lineTo(...place);
        else context.moveTo(...place);
      });
      context.closePath();
    }
    context.fillStyle = tint === "weaker" ? colours.paper : tint === "tougher" ? colours.ink : colours.material;
    context.globalAlpha = tint === "sheet" || tint === "second" ? 0.22 : 0.35;
    context.fill("evenodd");
    context.globalAlpha = 1;
    context.strokeStyle = colours.material;
    context.lineWidth = 1;
    context.stroke();
  }
}

/** A layer in the blades' frame, m: its ends, where its crack is, its faces. */
interface Stretch {
  from: number;
  cut: number;
  to: number;
  low: number;
  high: number;
  isSecond: boolean;
}

function stretchesOf({ scene, pose, cracks }: View, pieces: readonly Piece[]): Stretch[] {
  const moving = scene.moving_blades;
  const whole = scene.upper_face_m * moving;
  const height = pieces.reduce((most, piece) => Math.max(most, moving * piece.upper_face_m), 0);
  const base = moving === 2 ? 0.5 * height : 0;
  return pieces.map((piece, i) => {
    const high = moving * piece.upper_face_m;
    const thick = piece.scale * whole;
    const end = piece.strips[piece.strips.length - 1].end_m;
    return {
      from: piece.begin_m - pose.advance, cut: Math.max(cracks?.[i] ?? 0, piece.begin_m) - pose.advance, to: end - pose.advance,
      low: high - thick - base, high: high - base, isSecond: high > 1.000001 * thick,
    };
  });
}

/** Where the cut is, m from the sheet's near edge. */
function cutsOf({ crack, pieces, cracks }: View): [number, number][] {
  if (!pieces) return [[0, crack]];
  return pieces.map((piece, i): [number, number] => {
    const end = piece.strips[piece.strips.length - 1].end_m;
    return [piece.begin_m, Math.min(Math.max(cracks?.[i] ?? 0, piece.begin_m), end)];
  });
}

function plainSlab(reach_mm: number): Tinted {
  return { outline: rectangle([0, -HALF_WIDTH_mm], [reach_mm, HALF_WIDTH_mm]), holes: [], low: 0, high: 1, tint: "sheet" };
}

/** The edge in the blade's frame: station and offset. */
function edgeOf(view: View): Point[] {
  const table = view.law.tables.edge;
  return Array.from({ length: EDGE_POINTS + 1 }, (_, i): Point => {
    const s = (bladeLength(view.law) * i) / EDGE_POINTS;
    return [s, heldValue(table, s)];
  });
}

/** Height of the upper edge over a place of the cut, by Newton's method along the blade. */
export function heightOver(view: View, x: number): number {
  const beta = view.pose.opening / view.scene.moving_blades;
  const [sine, cosine] = [Math.sin(beta), Math.cos(beta)];
  let s = x / cosine;
  for (let i = 0; i < 4; i++) s = (x + heldValue(view.law.tables.edge, s) * sine) / cosine;
  return s * sine + heldValue(view.law.tables.edge, s) * cosine;
}

export function coloursOf(element: Element): Colours {
  const style = getComputedStyle(element);
  const named = (name: string): string => style.getPropertyValue(`--${name}`).trim();
  return {
    ink: named("ink"), muted: named("muted"), grid: named("grid"), paper: named("paper"),
    raised: named("raised"), fitted: named("fitted"), whatIf: named("whatif"), material: named("material"), hand: named("hand"),
  };
}

// The plain look: scissors and sheet from the side, the contact magnified, the sheet from above.

import { Step } from "./kernel";
import { heldValue, Law } from "./law";
import { Pose } from "./hand";
import { Scene } from "./scene";

export interface View {
  scene: Scene;
  law: Law;
  pose: Pose;
  wanted: Pose;
  step: Step;
  crack: number;
}

interface Colours {
  ink: string;
  muted: string;
  grid: string;
  paper: string;
  raised: string;
  blue: string;
  vermillion: string;
}

type Point = [number, number];

/** Width of the picture, in lengths of the blades. */
export const LENGTHS_ACROSS = 2.1;
const EDGE_POINTS = 40;
const STRIP_px = 56;
const LENS_m = 0.0012; // across the magnified circle

export class Drawing {
  private scale = 1;
  private origin: Point = [0, 0];
  private readonly context: CanvasRenderingContext2D;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d", { alpha: false }) as CanvasRenderingContext2D;
  }

  draw(view: View): void {
    const { width, height } = this.fit();
    const colours = coloursOf(this.canvas);
    const length = view.scene.blade_length_m;
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
    const length = view.scene.blade_length_m;
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
    context.strokeStyle = side === 1 ? colours.blue : colours.ink;
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

  private sheet(view: View, colours: Colours, width: number): void {
    const contact = Math.max(view.crack - view.pose.advance, 0);
    const thick = Math.max(2 * view.scene.upper_face_m * this.scale, 2);
    const context = this.context;
    context.strokeStyle = colours.vermillion;
    context.lineWidth = thick;
    this.path([[contact, 0], [(width - this.origin[0]) / this.scale, 0]], false);
    context.stroke();
    const start = Math.max(-view.pose.advance, 0);
    if (contact <= start) return;
    context.globalAlpha = 0.6;
    for (const side of [1, -1] as const) {
      const flap: Point[] = [];
      for (let i = 0; i <= 20; i++) {
        const x = contact + ((start - contact) * i) / 20;
        flap.push([x, side * Math.min(heightOver(view, x), 0)]);
      }
      this.path(flap, false);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  /** Where the hand is while the blades stay behind it. */
  private hand(view: View, colours: Colours): void {
    const lag = view.wanted.opening - view.pose.opening;
    if (Math.abs(lag) < 0.003) return;
    const reach = 0.5 * view.scene.blade_length_m;
    const beta = view.wanted.opening / view.scene.moving_blades;
    this.context.setLineDash([4, 4]);
    this.context.strokeStyle = colours.blue;
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
    const [beside, above] = [width - this.at([view.scene.blade_length_m, 0])[0], this.origin[1]];
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
    context.fillStyle = colours.vermillion;
    context.fill();
    for (const side of view.scene.moving_blades === 2 ? [1, -1] : [1]) {
      const edge: Point[] = [];
      for (let i = 0; i <= 30; i++) {
        const at = left + ((right - left) * i) / 30;
        edge.push([at, side * heightOver(view, at)]);
      }
      this.path(edge, false);
      context.strokeStyle = side === 1 ? colours.blue : colours.ink;
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

  /** The sheet from above: what is cut, and where the scissors stand. */
  private strip(view: View, colours: Colours, width: number, height: number): void {
    const context = this.context;
    const [top, middle] = [height - STRIP_px + 16, height - 0.5 * (STRIP_px - 16)];
    const scale = this.scale;
    const left = this.origin[0] - view.pose.advance * scale;
    context.fillStyle = colours.vermillion;
    context.globalAlpha = 0.18;
    context.fillRect(Math.max(left, 0), top, width - Math.max(left, 0), STRIP_px - 20);
    context.globalAlpha = 1;
    context.strokeStyle = colours.vermillion;
    context.lineWidth = 3;
    context.beginPath();
    context.moveTo(left, middle);
    context.lineTo(left + view.crack * scale, middle);
    context.stroke();
    context.strokeStyle = colours.blue;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(this.origin[0], middle);
    context.lineTo(this.origin[0] + view.scene.blade_length_m * scale, middle);
    context.setLineDash([2, 3]);
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = colours.muted;
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText(`from above: ${(1e3 * view.crack).toFixed(1)} mm cut`, 8, top - 4);
  }
}

/** The edge in the blade's frame: station and offset. */
function edgeOf(view: View): Point[] {
  const table = view.law.tables.edge;
  return Array.from({ length: EDGE_POINTS + 1 }, (_, i): Point => {
    const s = (view.scene.blade_length_m * i) / EDGE_POINTS;
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
    raised: named("raised"), blue: named("blue"), vermillion: named("vermillion"),
  };
}

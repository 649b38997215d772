// Torque over the opening against what was measured, and torque and forces over the last seconds.

import uPlot from "uplot";
import { coloursOf } from "./drawing";
import { html } from "./elements";
import { Rig, Sample } from "./rig";
import { Band, Scene, Stroke, unpack } from "./scene";

const DEG = 180 / Math.PI;
const GRID = 361;
const HEIGHT_px = 260;
const LAST_s = 8;
const TIMES = 400;
const LEAST = 0.1; // of the package's largest torque: below it is what friction and noise do at rest
const AIR = 1.05;

type Row = (number | null)[];

/** Curves of the settled torque over {@link openings}, in N m. */
export interface Curves {
  fitted: Float32Array | null;
  whatIf: Float32Array | null;
  draw: Float32Array | null;
}

/** The material's torque over the opening: measured strokes, band, laws, and the present stroke. */
export class TorqueChart {
  readonly openings: Float32Array;
  private chart: uPlot | null = null;
  private readonly degrees: number[];
  private readonly measured: Row[];
  private curves: Curves = { fitted: null, whatIf: null, draw: null };
  private theme = "";
  /** What is drawn: nothing is drawn again that has not changed. */
  private drawn: unknown[] = [];

  private readonly container = html("div", { class: "chart" });

  constructor(section: HTMLElement, private readonly scene: Scene) {
    section.append(this.container);
    const [low, high] = scene.opening_rad;
    this.openings = Float32Array.from({ length: GRID }, (_, i) => low + ((high - low) * i) / (GRID - 1));
    this.degrees = Array.from(this.openings, (opening) => DEG * opening);
    this.measured = scene.strokes.filter((stroke) => stroke.kind === "closing").map((stroke) => onGrid(stroke, this.openings));
    new ResizeObserver(() => this.size()).observe(this.container);
  }

  show(curves: Curves): void {
    this.curves = curves;
  }

  draw(rig: Rig): void {
    this.theme = rebuiltWhere(this.theme, this.container, () => this.build());
    const now = [this.theme, this.curves, rig.strokeContact, rig.stroke, rig.stroke.length];
    if (now.every((one, i) => one === this.drawn[i])) return;
    this.drawn = now;
    const band = this.scene.bands.find((one) => !one.friction && one.rate < 0);
    const [low, high] = band ? bandAt(band, rig.strokeContact, this.openings) : [[], []];
    const live = latest(rig.stroke, this.openings);
    const data = [this.degrees, low, high, ...this.measured, rowOf(this.curves.draw),
      rowOf(this.curves.whatIf), rowOf(this.curves.fitted), live];
    this.chart?.setData(data as uPlot.AlignedData);
  }

  private build(): void {
    const colours = coloursOf(this.container);
    this.chart?.destroy();
    const line = (label: string, stroke: string, width: number, dash?: number[]): uPlot.Series =>
      ({ label, stroke, width, dash, points: { show: false }, value: (_, v) => (v === null ? "" : `${(1e3 * v).toFixed(1)} mN m`) });
    const measured = this.measured.map((_, i) => ({ ...line("measured", colours.muted, 0.7), ...(i ? { class: "more" } : {}) }));
    const radius = this.scene.handle_radius_m;
    this.chart = new uPlot({
      width: this.container.clientWidth, height: HEIGHT_px,
      series: [
        { label: "opening", value: (_, v) => (v === null ? "" : `${v.toFixed(1)}°`) },
        line("5 %", "transparent", 0), line("95 %", "transparent", 0), ...measured,
        line("draw", colours.muted, 1.5, [2, 3]), line("what if", colours.whatIf, 2, [6, 4]),
        line("as fitted", colours.fitted, 2), line("last closing stroke", colours.ink, 1.5),
      ],
      bands: [{ series: [2, 1], fill: alpha(colours.fitted, 0.18) }],
      scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(low, 0), Math.max(high, 1e-3) * 1.05] } },
      axes: [
        axis(colours, "opening, degrees"),
        { ...axis(colours, "torque of the material, mN m"), size: 56, values: (_, ticks) => ticks.map((v) => (1e3 * v).toFixed(0)) },
        { ...axis(colours, "handle force, N"), side: 1, size: 50, scale: "y", grid: { show: false }, values: (_, ticks) => ticks.map((v) => (v / radius).toFixed(2)) },
      ],
      legend: { live: true },
      cursor: { drag: { x: false, y: false } },
    }, [this.degrees, ...Array(this.measured.length + 6).fill([])] as uPlot.AlignedData, this.container);
  }

  private size(): void {
    this.chart?.setSize({ width: this.container.clientWidth, height: HEIGHT_px });
  }
}

/** Whole torque and the force along the cut over the last seconds; of a rig, where it is followed. */
export class TimeChart {
  private chart: uPlot | null = null;
  private theme = "";
  private readonly times = Array.from({ length: TIMES }, (_, i) => -LAST_s + (LAST_s * (i + 1)) / TIMES);
  private readonly least: [number, number];
  private ranges: [Range, Range] = [[0, 1], [0, 1]];

  private readonly container = html("div", { class: "chart" });

  /** `largestTorque` (N m) of the package; a rig has a curve of its own where it can be followed. */
  constructor(section: HTMLElement, scene: Scene, largestTorque: number, private readonly followsRig: boolean) {
    this.least = [LEAST * largestTorque, (LEAST * largestTorque) / scene.handle_radius_m];
    section.append(this.container);
    const { container } = this;
    new ResizeObserver(() => this.chart?.setSize({ width: container.clientWidth, height: HEIGHT_px })).observe(container);
  }

  draw(recent: readonly Sample[], now: number, followed: { time_s: number[]; torque_Nm: number[] } | null): void {
    this.theme = rebuiltWhere(this.theme, this.container, () => this.build());
    const torque: Row = Array(TIMES).fill(null);
    const force: Row = Array(TIMES).fill(null);
    for (const sample of recent) {
      const place = Math.ceil(((sample.time - now + LAST_s) / LAST_s) * TIMES) - 1;
      if (place >= 0 && place < TIMES) [torque[place], force[place]] = [sample.torque, sample.force];
    }
    const rig: Row = Array(TIMES).fill(null);
    const newest = followed?.time_s[followed.time_s.length - 1] ?? 0;
    followed?.time_s.forEach((time, i) => {
      const place = Math.ceil(((time - newest + LAST_s) / LAST_s) * TIMES) - 1;
      if (place >= 0 && place < TIMES) rig[place] = followed.torque_Nm[i];
    });
    const rows = this.followsRig ? [torque, force, rig] : [torque, force];
    this.ranges = withOneZero(extentOf([...torque, ...rig], this.least[0]), extentOf(force, this.least[1]));
    this.chart?.setData([this.times, ...rows] as uPlot.AlignedData);
  }

  private build(): void {
    const colours = coloursOf(this.container);
    this.chart?.destroy();
    const show = { points: { show: false }, spanGaps: true };
    const torque: uPlot.Series = {
      label: "torque", stroke: colours.ink, width: 1.5, ...show, value: (_, v) => (v === null ? "" : `${(1e3 * v).toFixed(1)} mN m`),
    };
    this.chart = new uPlot({
      width: this.container.clientWidth, height: HEIGHT_px,
      series: [
        { label: "time", value: (_, v) => (v === null ? "" : `${v.toFixed(2)} s`) },
        torque,
        { label: "force along the cut", stroke: colours.ink, width: 1.5, dash: [5, 4], scale: "N", ...show, value: (_, v) => (v === null ? "" : `${v.toFixed(2)} N`) },
        ...(this.followsRig ? [{ ...torque, label: "torque of the rig", stroke: colours.muted }] : []),
      ],
      scales: { x: { time: false, range: [-LAST_s, 0] }, y: { range: () => this.ranges[0] }, N: { range: () => this.ranges[1] } },
      axes: [
        axis(colours, "time, s before now"),
        { ...axis(colours, "torque, mN m"), size: 56, values: (_, ticks) => ticks.map((v) => (1e3 * v).toFixed(0)) },
        { ...axis(colours, "force along the cut, N"), scale: "N", side: 1, size: 50, grid: { show: false } },
      ],
      cursor: { drag: { x: false, y: false } },
    }, [this.times, [], [], []].slice(0, this.followsRig ? 4 : 3) as uPlot.AlignedData, this.container);
  }
}

type Range = [number, number];

/** From the lowest to the highest value and 0; no less than `least` on a side. */
function extentOf(row: Row, least: number): Range {
  const [low, high] = row.reduce(([a, b]: Range, v): Range => [Math.min(a, v ?? 0), Math.max(b, v ?? 0)], [0, 0]);
  return [low, Math.max(high, least, -low)];
}

/** Ranges of two axes, left and right, whose zeros stand at one height. */
function withOneZero(...extents: [Range, Range]): [Range, Range] {
  const below = Math.max(...extents.map(([low, high]) => -low / high));
  return extents.map(([, high]): Range => [-AIR * below * high, AIR * high]) as [Range, Range];
}

/** Draw a chart anew where the colours of the page have changed. */
function rebuiltWhere(theme: string, container: HTMLElement, build: () => void): string {
  const { ink, paper } = coloursOf(container);
  if (theme !== ink + paper) build();
  return ink + paper;
}

function axis(colours: { muted: string; grid: string }, label: string): uPlot.Axis {
  return {
    label, stroke: colours.muted, labelSize: 18, font: "11px system-ui", labelFont: "12px system-ui",
    grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.grid, width: 1 },
  };
}

function alpha(colour: string, share: number): string {
  return `color-mix(in srgb, ${colour} ${100 * share}%, transparent)`;
}

function rowOf(values: Float32Array | null): Row {
  return values ? Array.from(values, (value) => (Number.isFinite(value) ? value : null)) : [];
}

/** A measured stroke on a grid of openings; null beyond its ends. */
function onGrid(stroke: Stroke, grid: Float32Array): Row {
  const [opening, torque] = [unpack(stroke.opening), unpack(stroke.torque)];
  const order = Array.from(opening.keys()).sort((a, b) => opening[a] - opening[b]);
  const x = order.map((i) => opening[i]);
  const y = order.map((i) => torque[i]);
  let i = 0;
  return Array.from(grid, (at) => {
    if (at < x[0] || at > x[x.length - 1]) return null;
    while (x[i + 1] < at) i++;
    const width = x[i + 1] - x[i];
    return width > 0 ? y[i] + ((at - x[i]) / width) * (y[i + 1] - y[i]) : y[i];
  });
}

/** The band's ends at a contact, over a grid of openings. */
export function bandAt(band: Band, contact: number, grid: Float32Array): [Row, Row] {
  const [opening, contacts] = [unpack(band.opening), unpack(band.contact)];
  const column = placeOf(contacts, contact);
  return [unpack(band.low), unpack(band.high)].map((values) => Array.from(grid, (at) => {
    const row = placeOf(opening, at);
    const value = (i: number): number => {
      const start = i * contacts.length + column.below;
      return values[start] + column.share * (values[start + 1] - values[start]);
    };
    return value(row.below) + row.share * (value(row.below + 1) - value(row.below));
  })) as [Row, Row];
}

function placeOf(nodes: Float32Array, at: number): { below: number; share: number } {
  const last = nodes.length - 1;
  const place = Math.min(Math.max(((at - nodes[0]) / (nodes[last] - nodes[0])) * last, 0), last);
  const below = Math.min(Math.floor(place), last - 1);
  return { below, share: place - below };
}

/** The present stroke's newest torque of the material at each opening of a grid. */
function latest(stroke: readonly Sample[], grid: Float32Array): Row {
  const row: Row = Array(grid.length).fill(null);
  const [low, width] = [grid[0], grid[grid.length - 1] - grid[0]];
  let before = -1;
  for (const sample of stroke) {
    const place = Math.round(((sample.opening - low) / width) * (grid.length - 1));
    if (place < 0 || place >= grid.length) continue;
    const torque = sample.torque - sample.friction;
    const step = before < 0 ? 0 : Math.sign(place - before);
    for (let i = before < 0 ? place : before + step; step && i !== place; i += step) row[i] = torque;
    row[place] = torque;
    before = place;
  }
  return row;
}

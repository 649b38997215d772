// The parts of the page together: what each frame does, and what follows from a change.

import { edgeTable } from "./blade_edge";
import { Curves, TimeChart, TorqueChart } from "./charts";
import { Controls } from "./controls";
import { mountDesign, packagePlate } from "./design";
import { Drawing, View } from "./drawing";
import { html, refilled } from "./elements";
import { madeHand, oneStroke, recordedHand } from "./hand";
import { KEYS, takeInput } from "./input";
import { AT } from "./kernel";
import { asFitted, Average, inPart, Law, ofDraw, whatIf } from "./law";
import { Drawn, Edge, Piece } from "./pieces";
import { Readout } from "./readout";
import { Rig } from "./rig";
import { RigPanel } from "./rig_panel";
import { Ripple } from "./ripple";
import { Scene, unpack } from "./scene";
import { RigSamples, Server } from "./socket";
import { View3d } from "./view3d";

const CHARTS_EVERY_ms = 100; // as often as the numbers; twice as often, both took 17 % of a processor
const COLOURS = [
  ["measured", "measured"], ["fitted", "fitted model"], ["whatif", "what if"], ["material", "material"], ["hand", "you move it"],
];
const AT_REST_ms = 250; // nothing changes then but colours and sizes
const STIRS = ["pointerdown", "pointerup", "keydown", "wheel", "input", "change", "click", "resize", "visibilitychange"];

export class App {
  readonly rig: Rig;
  readonly average: Average;
  readonly controls: Controls;
  /** Pictures and charts drawn, and seconds since the first. */
  readonly frames = { count: 0, charts: 0, seconds: 0 };
  laws: { fitted: Law; whatIf: Law };
  private readonly fitted: Law;
  private readonly drawing: Drawing;
  private readonly torque: TorqueChart;
  private readonly time: TimeChart;
  private readonly readout: Readout;
  private readonly ripple = new Ripple();
  private readonly panel: RigPanel | null;
  private readonly solid = html("div", { class: "solid", hidden: true });
  private view3d: View3d | null = null;
  private readonly acts = { stroke: () => this.stroke(), freshSheet: () => this.rig.freshSheet(), swap: () => this.controls.swap() };
  private readonly bladesBox = html("label", { hidden: true }, html("input", {
    type: "checkbox", change: (event) => this.moveBlades((event.target as HTMLInputElement).checked),
  }), "move the blades");
  private readonly hint = html("p", { class: "hint" }, "↓ Drag the handle to cut");
  private drawn: Drawn | null = null;
  /** Edge of the blades that a person drew; null: as fitted. */
  private edge: Edge | null = null;
  private readonly bladesNote = html("p", { class: "note", hidden: true }, "The blades are drawn: interval and measured lines are of the fitted ones, whose sliders do nothing.");
  /** Timer of the next picture while the blades stand still, else 0. */
  private resting = 0;
  private stirredAt = 0;
  private chartedAt = 0;
  private curvesAt = NaN;
  private readonly largestTorque: number;
  private before = 0;

  constructor(page: HTMLElement, readonly scene: Scene, module: WebAssembly.Module, server: Server | null) {
    this.largestTorque = largestOf(scene);
    this.rig = new Rig(scene, module);
    this.rig.cut(scene.pieces);
    this.drawn = packagePlate(scene);
    this.average = new Average(module);
    this.fitted = asFitted(scene);
    this.laws = { fitted: this.fitted, whatIf: this.fitted };
    const canvas = html("canvas", {
      class: "plain", tabindex: 0, role: "application",
      "aria-label": "Scissors and sheet from the side. Arrow keys move the blades, Space makes a stroke; the numbers stand in Now.",
    });
    const [torque, time, now, law, design, rig] = ["torque", "time", "now", "law", "design", "rig"].map((name) => html("section", { class: name }));
    refilled(page, this.header(),
      html("main", {},
        html("section", { class: "stage" }, html("div", { class: "view" }, canvas, this.solid, this.hint), this.actions(), keyHelp()),
        torque, now, time, law, server ? rig : null,
        html("details", { class: "designer", toggle: (event) => this.openDesign(event.target as HTMLDetailsElement, design) }, html("summary", {}, "Draw plates and blades"), design)),
      html("footer", { class: "note" }, `scissorcal ${scene.version}, ${scene.made_utc}; tables within ${(1e3 * scene.bound_Nm).toPrecision(2)} mN m of the fit`));
    this.drawing = new Drawing(canvas);
    torque.append(html("h2", {}, "Torque over the opening"), html("p", { class: "note" }, torqueNote(scene)), this.bladesNote);
    time.append(html("h2", {}, "The last 8 seconds"));
    this.torque = new TorqueChart(torque, scene);
    this.time = new TimeChart(time, scene, this.largestTorque, server !== null);
    this.readout = new Readout(now, scene, server !== null);
    this.controls = new Controls(law, scene, () => this.changed());
    this.panel = server ? new RigPanel(rig, server, (samples) => this.follow(samples)) : null;
    takeInput(canvas, this.rig, scene, this.acts);
    for (const name of ["pointerdown", "keydown"]) canvas.addEventListener(name, () => this.begun());
    this.changed();
    this.rig.freshSheet();
  }

  run(): void {
    for (const name of STIRS) window.addEventListener(name, () => this.stir(), { capture: true });
    window.addEventListener("pointermove", (event) => event.buttons && this.stir(), { capture: true });
    this.next();
  }

  /** Torque (N m) of the average law: what open_package(...).torque gives at these places. */
  torqueAt(openings: number[], rate: number, contact: number): number[] {
    this.average.load(inPart(this.laws.fitted, this.controls.choices.parts));
    return Array.from(this.average.torque(Float32Array.from(openings), rate, contact));
  }

  /** Sixty pictures a second while something moves, four at rest: then each would cost as much for nothing. */
  private frame(now: number): void {
    const { rig } = this;
    this.pass(now);
    this.frames.count += 1;
    this.ripple.released(rig.released, rig.step.torque / this.largestTorque);
    rig.released = 0;
    this.draw();
    this.readout.show(rig, now, rig.isFollowing ? this.panel?.recent.newestTorque : undefined);
    if (now - this.chartedAt >= CHARTS_EVERY_ms) this.chart(now);
    if (rig.isStill && now - this.stirredAt > AT_REST_ms) this.resting = window.setTimeout(() => this.next(), AT_REST_ms);
    else this.next();
  }

  private next(): void {
    this.resting = 0;
    requestAnimationFrame((now) => this.frame(now));
  }

  /** Something may move now: the time until then has passed at rest. */
  private stir(): void {
    this.stirredAt = performance.now();
    if (!this.resting) return;
    window.clearTimeout(this.resting);
    this.pass(performance.now());
    this.next();
  }

  private pass(now: number): void {
    const seconds = this.before ? Math.max(now - this.before, 0) / 1e3 : 0;
    this.before = Math.max(now, this.before);
    this.frames.seconds += seconds;
    this.rig.pass(seconds);
  }

  private follow(samples: RigSamples): void {
    this.stir();
    this.rig.follow(samples);
  }

  private chart(now: number): void {
    const { rig } = this;
    this.chartedAt = now;
    this.frames.charts += 1;
    if (rig.strokeContact !== this.curvesAt) this.showCurves();
    this.torque.draw(rig);
    this.time.draw(rig.recent, rig.time, this.panel && rig.isFollowing ? this.panel.recent.columns : null);
  }

  private draw(): void {
    const { rig, scene } = this;
    const law = this.laws[rig.active];
    const kernel = rig.kernels[rig.active];
    const view: View = {
      scene, law, step: rig.step, crack: rig.crackMost, pose: rig.pose, wanted: rig.wanted,
      pieces: rig.pieces, cracks: rig.pieces && kernel.cracks(rig.pieces.length), drawn: this.drawn,
    };
    if (this.view3d && !this.solid.hidden) this.view3d.draw(view);
    else this.drawing.draw(view);
  }

  /** A choice of the law changed: load both laws, and draw their curves. */
  private changed(): void {
    const { choices } = this.controls;
    this.stir();
    const other = choices.draw === null
      ? whatIf(this.scene, this.fitted, choices.values) : ofDraw(this.scene, this.fitted, choices.draw);
    this.laws = { fitted: this.withBlades(this.fitted), whatIf: this.withBlades(other) };
    this.rig.active = choices.active;
    const names = { fitted: "as fitted", whatIf: "what if" };
    const refused = (["whatIf", "fitted"] as const).filter(
      (which) => !this.rig.load(which, inPart(this.laws[which], choices.parts), this.largestTorque),
    );
    this.controls.refuse(refused.map((which) => names[which]));
    this.showCurves();
  }

  /** Curves of both laws at the contact where the present stroke began. */
  private showCurves(): void {
    const { choices } = this.controls;
    const isMoved = choices.values.size > 0 || choices.draw !== null;
    this.curvesAt = this.rig.strokeContact;
    const material = { ...choices.parts, friction: false };
    const curve = (law: Law): Float32Array | null => {
      const rate = -Math.max(this.scene.opening_rate_rad_per_s[0], 1e-3);
      const isSound = this.average.load(inPart(law, material));
      return isSound ? this.average.torque(this.torque.openings, rate, this.rig.strokeContact) : null;
    };
    const moved = isMoved ? curve(this.laws.whatIf) : null;
    const curves: Curves = {
      fitted: curve(this.laws.fitted), whatIf: choices.draw === null ? moved : null, draw: choices.draw === null ? null : moved,
    };
    this.torque.show(curves);
  }

  /** The law with the drawn edge, which ends where the blade does. */
  private withBlades(law: Law): Law {
    if (!this.edge) return law;
    const numbers = [...law.numbers];
    numbers[AT.tipStation] = Math.fround(1e-3 * this.edge.length_mm);
    return { ...law, numbers, tables: { ...law.tables, edge: edgeTable(this.edge, law.tables.edge.x) } };
  }

  /** Somebody moves the blades: what to do first need not be said any more. */
  private begun(): void {
    this.hint.hidden = true;
  }

  private stroke(): void {
    this.begun();
    this.rig.play(oneStroke(this.scene, this.rig.pose));
  }

  private header(): HTMLElement {
    const { scene } = this;
    return html("header", {},
      html("h1", {}, scene.name),
      this.states(),
      html("ul", { class: "key", "aria-label": "Colours" }, ...COLOURS.map(([name, label]) => html("li", { class: name }, label))));
  }

  /** One line of labels; opened, the sentences behind them and the next step. */
  private states(): HTMLElement | null {
    const { states, next_step } = this.scene;
    if (!states.length && !next_step) return null;
    const labels = [...new Set(states.map(({ label }) => label))];
    return html("details", { class: "states" },
      html("summary", {}, ...(labels.length ? labels : ["next step"]).map((label) => html("span", { class: "state" }, label))),
      ...states.map(({ label, sentence }) => html("p", {}, html("strong", {}, `${label}: `), sentence)),
      next_step ? html("p", { class: "next" }, html("strong", {}, "next: "), html("code", {}, next_step)) : null);
  }

  private actions(): HTMLElement {
    const button = (label: string, click: () => void): HTMLElement => html("button", { type: "button", click }, label);
    const box = (label: string, changed: (isOn: boolean) => void): HTMLElement =>
      html("label", {}, html("input", { type: "checkbox", change: (event) => changed((event.target as HTMLInputElement).checked) }), label);
    return html("div", { class: "row actions", role: "toolbar", "aria-label": "Hands and views" },
      button("One stroke", () => this.stroke()),
      button("Strokes", () => this.play(madeHand(this.scene, this.rig.start))),
      ...this.scene.hands.map((hand) => button(shortName(hand.name), () => this.play(recordedHand(hand)))),
      button("Fresh sheet", () => this.rig.freshSheet()),
      box("3-D", (isOn) => this.show3d(isOn)), this.bladesBox, box("sound", (isOn) => this.ripple.sound(isOn)), box("rumble", (isOn) => this.ripple.rumble(isOn)));
  }

  private play(script: Parameters<Rig["play"]>[0]): void {
    this.begun();
    this.rig.freshSheet();
    this.rig.play(script);
  }

  private show3d(isOn: boolean): void {
    this.begun();
    this.solid.hidden = !isOn;
    this.drawing.canvas.hidden = isOn;
    if (isOn && !this.view3d) this.open3d();
    this.bladesBox.hidden = !isOn || !this.view3d?.canvas;
  }

  private open3d(): void {
    const view = this.view3d = new View3d(this.solid);
    if (view.canvas) takeInput(view.canvas, this.rig, this.scene, this.acts, { movesBlades: () => view.movesBlades, way: () => view.way });
  }

  private moveBlades(isOn: boolean): void {
    if (this.view3d) this.view3d.movesBlades = isOn;
  }

  private openDesign(details: HTMLDetailsElement, section: HTMLElement): void {
    if (!details.open || section.childElementCount) return;
    mountDesign(section, this.scene, (pieces: Piece[] | null, applied) => {
      this.drawn = applied?.drawn ?? packagePlate(this.scene);
      this.edge = applied?.edge ?? null;
      this.bladesNote.hidden = !this.edge;
      this.rig.cut(pieces ?? this.scene.pieces);
      this.changed();
      this.rig.freshSheet();
    });
  }
}

/** Torque at which the blades lag most behind the hand: the largest of the scene's band. */
function largestOf(scene: Scene): number {
  const highs = scene.bands.flatMap((band) => Array.from(unpack(band.high)));
  return highs.reduce((most, high) => Math.max(most, high), 0) || scene.torque_limit_Nm;
}

function torqueNote(scene: Scene): string {
  return `Of the uniform sheet, without friction; shaded: 90 % interval.${scene.strokes.length ? "" : " No measured strokes."}`;
}

/** A recording without the seconds of its time, which no two of one day share. */
function shortName(name: string): string {
  const [, kind, day, hour, minute] = /^(\w+)-\d{4}(\d{4})T(\d{2})(\d{2})\d{2}Z$/.exec(name) ?? [];
  return kind ? `Replay ${kind} ${day.slice(0, 2)}-${day.slice(2)} ${hour}:${minute}` : `Replay ${name}`;
}

function keyHelp(): HTMLElement {
  return html("details", { class: "keys" }, html("summary", {}, "Mouse, touch and keys"),
    html("dl", {}, ...KEYS.flatMap(([key, what]) => [html("dt", {}, key), html("dd", {}, what)])));
}

// The parts of the page together: what each frame does, and what follows from a change.

import { edgeTable } from "./blade_edge";
import { Curves, TimeChart, TorqueChart } from "./charts";
import { Controls } from "./controls";
import { mountDesign } from "./design";
import { Drawing } from "./drawing";
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
import { View, View3d } from "./view3d";

const CHARTS_EVERY_ms = 100; // as often as the numbers; twice as often, both took 17 % of a processor
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
  private drawn: Drawn | null = null;
  /** Edge of the blades that a person drew; null: as fitted. */
  private edge: Edge | null = null;
  private readonly bladesNote = html("p", { class: "note", hidden: true }, "The blades are drawn: both curves are the law with these, and sliders and draws of the fitted edge do nothing; the shaded interval and the measured lines are of the blades as fitted.");
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
        html("section", { class: "stage" }, this.actions(), canvas, this.solid, keyHelp()),
        torque, now, time, law, server ? rig : null,
        html("details", { class: "designer", toggle: (event) => this.openDesign(event.target as HTMLDetailsElement, design) }, html("summary", {}, "Draw plates and blades"), design)),
      html("footer", { class: "note" }, `${scene.name}, page made ${scene.made_utc} by scissorcal ${scene.version}. Tables within ${(1e3 * scene.bound_Nm).toPrecision(2)} mN m of the fitted law.`));
    this.drawing = new Drawing(canvas);
    torque.append(html("h2", {}, "Torque over the opening"), html("p", { class: "note" }, torqueNote(scene)), this.bladesNote);
    time.append(html("h2", {}, "The last 8 seconds"));
    this.torque = new TorqueChart(torque, scene);
    this.time = new TimeChart(time, scene, this.largestTorque, server !== null);
    this.readout = new Readout(now, scene, server !== null);
    this.controls = new Controls(law, scene, () => this.changed());
    this.panel = server ? new RigPanel(rig, server, (samples) => this.follow(samples)) : null;
    takeInput(canvas, this.rig, scene, this.acts);
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

  private stroke(): void {
    this.rig.play(oneStroke(this.scene, this.rig.pose));
  }

  private header(): HTMLElement {
    const { scene } = this;
    return html("header", {},
      html("h1", {}, scene.name),
      ...scene.warnings.map((sentence) => html("p", { class: "warning" }, sentence)),
      html("p", { class: "note" }, "Blue is the fitted model, orange what if, grey measured, and the last closing stroke that of the blades on this page: a model, too, on the C core that renders on the rig."));
  }

  private actions(): HTMLElement {
    const button = (label: string, click: () => void): HTMLElement => html("button", { type: "button", click }, label);
    const box = (label: string, changed: (isOn: boolean) => void): HTMLElement =>
      html("label", {}, html("input", { type: "checkbox", change: (event) => changed((event.target as HTMLInputElement).checked) }), label);
    return html("div", { class: "row actions", role: "toolbar", "aria-label": "Hands and views" },
      button("One stroke", () => this.stroke()),
      button("Strokes", () => this.play(madeHand(this.scene, this.rig.start))),
      ...this.scene.hands.map((hand) => button(`Hand of ${hand.name}`, () => this.play(recordedHand(hand)))),
      button("Fresh sheet", () => this.rig.freshSheet()),
      box("3-D", (isOn) => this.show3d(isOn)), this.bladesBox, box("sound", (isOn) => this.ripple.sound(isOn)), box("gamepad rumble", (isOn) => this.ripple.rumble(isOn)));
  }

  private play(script: Parameters<Rig["play"]>[0]): void {
    this.rig.freshSheet();
    this.rig.play(script);
  }

  private show3d(isOn: boolean): void {
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
      this.drawn = applied?.drawn ?? null;
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
  const measured = scene.strokes.length ? "grey lines are measured closing strokes with friction taken off" : "this package brings no measured strokes";
  return `Shaded: the model's 90 % interval at the contact where the stroke began; ${measured}. The curves leave out the rig's friction, and of a drawn plate they show the uniform sheet.`;
}

function keyHelp(): HTMLElement {
  return html("details", { class: "keys" }, html("summary", {}, "Mouse, touch and keys"),
    html("dl", {}, ...KEYS.flatMap(([key, what]) => [html("dt", {}, key), html("dd", {}, what)])));
}

// The rig on the page: two laws (as fitted, what if) stepped by one hand at the loop's rate.

import { AT, Kernel, Step } from "./kernel";
import { Coupling, Pose, Script } from "./hand";
import { asFitted, bladeLength, freeFrom, Law } from "./law";
import { Piece } from "./pieces";
import { Scene, unpack } from "./scene";
import { RigSamples } from "./socket";

export type Which = "fitted" | "whatIf";

export interface Energy {
  hand: number;
  stored: number;
  fracture: number;
  arrest: number;
  friction: number;
}

/** One sample of a stroke or of the last seconds. */
export interface Sample {
  time: number;
  opening: number;
  torque: number;
  force: number;
  friction: number;
}

const MOST_STEPS = 100; // a frame, so that a page that slept does not catch up
const FREE_m = 0.001; // from the blades to the sheet in front of them
const KEPT_s = 8;
const EVERY = 4; // ticks from one kept sample to the next
const STILL_m = 1e-9; // in a tick
const TURN_rad = 0.004;
const FOLLOWED_s = 1; // without samples for so long, nothing is followed any more
const MOST_SAMPLES = 4000; // of one stroke: 16 s

export class Rig {
  readonly kernels: Record<Which, Kernel>;
  pose: Pose;
  wanted: Pose;
  rate = 0;
  time = 0;
  active: Which = "fitted";
  /** Of the law that the hand feels, and of the one beside it on the same motion. */
  step: Step;
  beside: Step | null = null;
  energy: Energy = none();
  /** Samples of the last seconds, and of the last closing stroke. */
  recent: Sample[] = [];
  stroke: Sample[] = [];
  strokeContact: number;
  sound: Record<Which, boolean> = { fitted: false, whatIf: false };
  /** Energy that cracks released since it was read last, for sound and rumble. */
  released = 0;
  pieces: readonly Piece[] | null = null;
  bladeLength_m: number;
  private script: Script | null = null;
  private scriptBegan = 0;
  private slid = 0;
  private tick = 0;
  private left = 0;
  private closing = false;
  private storedBefore = 0;
  private turnedAt: number;
  private coupling: Coupling | null = null;
  private followed = { recording: "", time: 0, quiet_s: Infinity };

  /** Where the blades are over a fresh sheet: open, and free of it. */
  start: Pose;

  constructor(readonly scene: Scene, module: WebAssembly.Module) {
    this.kernels = { fitted: new Kernel(module), whatIf: new Kernel(module) };
    this.start = this.pose = this.wanted = startOf(scene, asFitted(scene));
    this.bladeLength_m = scene.blade_length_m;
    this.turnedAt = this.pose.opening;
    this.strokeContact = -this.pose.advance;
    this.step = { ...NOTHING };
  }

  /** Take a law, its cracks where they were; the energies begin anew where it is the one that is felt. */
  load(which: Which, law: Law, largestTorque: number): boolean {
    const kernel = this.kernels[which];
    const crack = kernel.crack;
    const cracks = this.pieces ? kernel.cracks(this.pieces.length) : [];
    const isSound = kernel.load(law.tables, law.numbers) && kernel.cut(this.scaled(law));
    kernel.reset(crack);
    kernel.putCracks(cracks);
    this.sound[which] = isSound;
    this.bladeLength_m = bladeLength(law);
    if (which === this.active) this.start = startOf(this.scene, law);
    if (which === this.active && isSound) {
      this.coupling = new Coupling(this.scene, law, largestTorque);
      this.rest();
    }
    return isSound;
  }

  /** Cut a plate of pieces, null: the uniform sheet. The laws have to be loaded again, and the sheet be fresh. */
  cut(pieces: readonly Piece[] | null): void {
    this.pieces = pieces;
  }

  /** The pieces under a law whose fracture energy is not the fitted one: in the same ratio to it. */
  private scaled(law: Law): Piece[] | null {
    const fitted = this.scene.numbers[AT.fractureEnergy];
    const share = fitted > 0 ? law.numbers[AT.fractureEnergy] / fitted : 1;
    return this.pieces && this.pieces.map((piece) => ({
      ...piece,
      strips: piece.strips.map((strip) => ({ ...strip, fracture_energy_J_per_m: share * strip.fracture_energy_J_per_m })),
    }));
  }

  freshSheet(): void {
    this.script = null;
    this.kernels.fitted.reset();
    this.kernels.whatIf.reset();
    if (!this.isFollowing) this.pose = this.wanted = this.start;
    this.recent = [];
    this.rest();
    this.beginStroke();
  }

  /** Whether the blades are where a running rig has them. */
  get isFollowing(): boolean {
    return this.followed.quiet_s < FOLLOWED_s;
  }

  /**
   * Move the blades as a running rig moves them, straight from sample to sample in ticks of the loop.
   *
   * The laws cut what the rig cuts, from a fresh sheet at the first sample of a recording.
   */
  follow({ recording, time_s, opening_rad, advance_m }: RigSamples): void {
    const tick = 1 / this.scene.loop_rate_Hz;
    time_s.forEach((time, i) => {
      const to = { opening: opening_rad[i], advance: advance_m[i] };
      const passed = time - this.followed.time;
      const isNew = recording !== this.followed.recording || passed <= 0;
      const wasElsewhere = !this.isFollowing;
      this.followed = { recording, time, quiet_s: 0 };
      if (isNew || wasElsewhere) this.pose = to;
      if (isNew) return this.freshSheet();
      if (wasElsewhere) return this.rest();
      const from = this.pose;
      const ticks = Math.min(Math.max(Math.round(passed / tick), 1), MOST_STEPS);
      for (let k = 1; k <= ticks; k++) this.take(between(from, to, k / ticks), passed / ticks);
    });
    this.wanted = this.pose;
    this.script = null;
  }

  /** Let a hand move the blades from now on; null gives them back to the pointer. */
  play(script: Script | null): void {
    if (script || this.script) this.wanted = this.pose; // else keys pressed in a row add up
    this.script = script;
    this.scriptBegan = this.time;
  }

  /** Whether nobody and nothing moves the blades. */
  get isStill(): boolean {
    return !this.script && this.rate === 0 && Math.abs(this.slid) < STILL_m;
  }

  /** Farthest place to which the active law has cut, m. */
  get crackMost(): number {
    const kernel = this.kernels[this.active];
    if (!this.pieces) return kernel.crack;
    const cracks = kernel.cracks(this.pieces.length).filter((at, i) => at > this.pieces![i].begin_m + 1e-6); // float32
    return Math.max(0, ...cracks);
  }

  get plays(): boolean {
    return this.script !== null;
  }

  /** Let time pass, in ticks of the loop. While the page slept, none did. */
  pass(seconds: number): void {
    const dt = 1 / this.scene.loop_rate_Hz;
    const awake = Math.min(seconds, MOST_STEPS * dt);
    this.followed.quiet_s += awake;
    if (this.isFollowing) return;
    this.left += awake;
    while (this.left >= dt) {
      this.left -= dt;
      this.one(dt);
    }
  }

  private one(dt: number): void {
    if (!this.sound[this.active] || !this.coupling) return;
    let next: Pose;
    const played = this.script?.(this.time + dt - this.scriptBegan);
    if (this.script && !played) this.script = null;
    if (played) {
      next = this.wanted = played;
    } else {
      next = this.coupling.moved(this.pose, this.wanted, this.step.torque - this.step.friction_torque, this.step.force, dt);
    }
    this.take(next, dt);
  }

  /** Step both laws to where the blades are after dt, and keep the books. */
  private take(next: Pose, dt: number): void {
    const last = this.pose;
    this.time += dt;
    this.rate = (next.opening - last.opening) / dt;
    this.slid = next.advance - last.advance;
    this.pose = next;
    if (!this.sound[this.active]) return;
    const other = this.active === "fitted" ? "whatIf" : "fitted";
    const before = this.step;
    this.beside = this.sound[other] ? this.kernels[other].step(next.opening, this.rate, next.advance) : null;
    this.step = this.kernels[this.active].step(next.opening, this.rate, next.advance);
    this.account(last, next, before);
    if (this.tick++ % EVERY === 0) this.keep();
  }

  /** Stand still where the blades are, with books that begin at 0. */
  private rest(): void {
    this.rate = 0;
    this.energy = none();
    this.step = this.kernels[this.active].step(this.pose.opening, 0, this.pose.advance);
    this.storedBefore = this.step.stored_J;
  }

  private account(last: Pose, next: Pose, before: Step): void {
    const [turned, moved] = [next.opening - last.opening, next.advance - last.advance];
    const { step, energy } = this;
    energy.hand -= 0.5 * (step.torque + before.torque) * turned + 0.5 * (step.force + before.force) * moved;
    energy.friction -= 0.5 * (step.friction_torque + before.friction_torque) * turned;
    energy.fracture += step.fracture_J;
    energy.arrest += step.arrest_J;
    energy.stored = step.stored_J - this.storedBefore;
    this.released += step.fracture_J + step.arrest_J;
  }

  private keep(): void {
    const sample = {
      time: this.time, opening: this.pose.opening, torque: this.step.torque, force: this.step.force,
      friction: this.step.friction_torque,
    };
    const way = this.closing ? 1 : -1;
    if (way * (this.pose.opening - this.turnedAt) < 0) this.turnedAt = this.pose.opening;
    if (way * (this.pose.opening - this.turnedAt) > TURN_rad) {
      this.closing = !this.closing;
      this.turnedAt = this.pose.opening;
      if (this.closing) this.beginStroke();
    }
    if (this.closing && this.stroke.length < MOST_SAMPLES) this.stroke.push(sample);
    this.recent.push(sample);
    while (this.recent[0].time < this.time - KEPT_s) this.recent.shift();
  }

  private beginStroke(): void {
    this.stroke = [];
    this.strokeContact = this.kernels[this.active].crack - this.pose.advance;
  }
}

function between(from: Pose, to: Pose, share: number): Pose {
  return { opening: from.opening + share * (to.opening - from.opening), advance: from.advance + share * (to.advance - from.advance) };
}

const NOTHING: Step = {
  torque: 0, force: 0, contact: 0, indentation: 0, height: 0, response: 0, friction_torque: 0,
  stored_J: 0, fracture_J: 0, arrest_J: 0, flags: 0,
};

function none(): Energy {
  return { hand: 0, stored: 0, fracture: 0, arrest: 0, friction: 0 };
}

/** Open, with the material's edge where measured strokes began, or farther where only there the blades are free of it. */
function startOf(scene: Scene, law: Law): Pose {
  const [near, far] = scene.contact_m;
  const measured = measuredStart(scene);
  const contact = measured === null
    ? Math.max(near + 0.25 * (far - near), freeFrom(scene, law) + FREE_m) : Math.max(measured, freeFrom(scene, law));
  return { opening: scene.opening_rad[1], advance: -contact };
}

/** Median contact (m) at which the measured closing strokes began; null without any. */
function measuredStart({ strokes }: Scene): number | null {
  const began = strokes.filter(({ kind }) => kind === "closing").map((stroke) => unpack(stroke.contact)[0]).sort((a, b) => a - b);
  return began.length ? began[Math.floor(began.length / 2)] : null;
}

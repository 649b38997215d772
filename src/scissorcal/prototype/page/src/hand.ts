// The hand that moves the blades: by pointer and keys through a spring, or one that is replayed.

import { AT } from "./kernel";
import { heldValue, Law } from "./law";
import { Hand, Scene, unpack } from "./scene";

export interface Pose {
  opening: number;
  advance: number;
}

/** What a hand wants at a time (s), null once it has ended. */
export type Script = (time: number) => Pose | null;

const LAG_rad = 0.15; // by which the blades stay behind the hand at the largest torque of the scene
const LAG_m = 0.003;
const SETTLES_s = 0.03;
const HELD = 5; // times the largest torque: what a hand at the other end of the scene's openings can give
const PUSH_N = 3;
const STILL_rad_per_s = 1e-4; // a hand that would move the blades no faster lets them rest

const FASTEST_rad_per_s = 0.6; // of a made hand
const STEEPEST = 0.5 * Math.PI; // of an eased motion, against a steady one

/** A hand that holds the handles by a spring: it feels by how far the blades stay behind. */
export class Coupling {
  private readonly stiffness: number;
  private readonly damping: number;
  private readonly push = PUSH_N / LAG_m;

  constructor(scene: Scene, private readonly law: Law, largestTorque: number) {
    this.stiffness = largestTorque / LAG_rad;
    // A step is stable while damping exceeds half of what the material's stiffness does in a tick.
    const material = materialStiffness(scene, law, HELD * largestTorque) / scene.loop_rate_Hz;
    this.damping = Math.max(this.stiffness * SETTLES_s, material);
  }

  /**
   * The pose after dt, of blades that feel the material's torque (positive opens) and a force along the cut.
   *
   * Dry friction is not fed back through the torque of the tick before, which would make resting blades
   * chatter: it holds them until hand and material exceed it, and takes its level off then.
   */
  moved(at: Pose, wanted: Pose, torque: number, force: number, dt: number): Pose {
    const drive = this.stiffness * (wanted.opening - at.opening) + torque;
    const held = this.friction(at.opening, drive, Math.abs(drive) / this.damping);
    const left = Math.abs(drive) - held;
    const turn = left > STILL_rad_per_s * this.damping ? (Math.sign(drive) * left) / this.damping : 0;
    const slide = (this.push * (wanted.advance - at.advance) + force) / (this.push * SETTLES_s);
    return { opening: at.opening + dt * turn, advance: at.advance + dt * slide };
  }

  /** Level of the law's friction (N m) at a speed, on the side to which the blades are driven. */
  private friction(opening: number, drive: number, speed: number): number {
    const { tables, numbers } = this.law;
    if (!numbers[AT.renderFriction]) return 0;
    const side = drive > 0 ? tables.friction_opening : tables.friction_closing;
    return heldValue(side, speed) * heldValue(tables.friction_angle, opening);
  }
}

/** Largest stiffness (N m/rad) with which the material resists closing, up to a torque. */
function materialStiffness(scene: Scene, law: Law, torque: number): number {
  const { y, slope } = law.tables.response;
  const [near, far] = scene.contact_m;
  const strongest = torque / near;
  let stiffest = 0;
  for (let i = 0; i < y.length; i++) if (i === 0 || y[i - 1] < strongest) stiffest = Math.max(stiffest, slope[i]);
  return (stiffest * far * far) / scene.moving_blades;
}

/** One stroke from where the blades are: close, and open again. */
export function oneStroke(scene: Scene, from: Pose): Script {
  const [closed, open] = scene.opening_rad;
  const [down, up] = [durationOf(from.opening - closed, scene), durationOf(open - closed, scene)];
  return (time) => {
    if (time >= down + up) return null;
    const opening = time < down
      ? closed + (from.opening - closed) * eased(1 - time / down)
      : closed + (open - closed) * eased((time - down) / up);
    return { opening, advance: from.advance };
  };
}

/** Strokes as a lab makes them: close, open, move on by what was cut, over and over. */
export function madeHand(scene: Scene, start: Pose, strokes = 3): Script {
  const [closed, open] = scene.opening_rad;
  const half = durationOf(open - closed, scene);
  const [near, far] = scene.contact_m;
  const step = 0.6 * (far - near);
  return (time) => {
    const number = Math.floor(time / (2 * half + 0.3));
    if (number >= strokes) return null;
    const within = time - number * (2 * half + 0.3);
    const share = within < half ? within / half : Math.max(0, 2 - within / half);
    const moving = Math.min(Math.max((within - 2 * half) / 0.3, 0), 1);
    return { opening: open - (open - closed) * eased(Math.min(share, 1)), advance: start.advance + step * (number + moving) };
  };
}

/** A hand that was recorded. */
export function recordedHand(hand: Hand): Script {
  const [time, opening, advance] = [unpack(hand.time), unpack(hand.opening), unpack(hand.advance)];
  let i = 0;
  return (now) => {
    if (now >= time[time.length - 1]) return null;
    if (time[i] > now) i = 0;
    while (time[i + 1] < now) i++;
    const share = (now - time[i]) / (time[i + 1] - time[i]);
    return {
      opening: opening[i] + share * (opening[i + 1] - opening[i]),
      advance: advance[i] + share * (advance[i + 1] - advance[i]),
    };
  };
}

/** Seconds of an eased turn that is fastest, in its middle, at the fastest rate of a hand or of the scene. */
function durationOf(turn: number, scene: Scene): number {
  return (STEEPEST * Math.max(turn, 0)) / Math.min(FASTEST_rad_per_s, scene.opening_rate_rad_per_s[1]);
}

/** From 0 to 1, beginning and ending at rest, steepest in the middle. */
function eased(share: number): number {
  return 0.5 - 0.5 * Math.cos(Math.PI * share);
}

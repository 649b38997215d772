// Numbers beside the pictures, for everybody and for screen readers.

import { html, refilled } from "./elements";
import { FLAG } from "./kernel";
import { Rig } from "./rig";
import { Scene } from "./scene";

const SAID_EVERY_ms = 2000;
const SHOWN_EVERY_ms = 100;

const DEG = 180 / Math.PI;
/** What stands beside the law that is felt: the other one, on the same motion. */
const BESIDE = { fitted: "torque, what if", whatIf: "torque, as fitted" };
const LEANING = "The edge leans back at this opening: no torque.";
const BEYOND = "Outside the range of the package: not checked.";

/** The state in numbers: shown ten times a second, told to screen readers every two seconds. */
export class Readout {
  private readonly state = html("dl", { class: "numbers" });
  private readonly energy = html("dl", { class: "numbers" });
  private readonly said = html("p", { class: "said", "aria-live": "polite" });
  private readonly warning = html("p", { class: "warning", hidden: true });
  private shownAt = 0;
  private saidAt = 0;
  private before = "";

  constructor(container: HTMLElement, private readonly scene: Scene, private readonly isServed: boolean) {
    container.append(
      html("h2", {}, "Now"), this.warning, this.state, html("h3", {}, "Energy"), this.energy, this.said);
  }

  /** `measured`: torque (N m) of the rig whose motion the model makes, if one is followed. */
  show(rig: Rig, now: number, measured: number | undefined): void {
    if (now - this.shownAt < SHOWN_EVERY_ms) return;
    this.shownAt = now;
    const { step, energy, scene } = { step: rig.step, energy: rig.energy, scene: this.scene };
    const cut_mm = 1e3 * rig.crackMost;
    const rows: [string, string, string][] = [
      ["torque", (1e3 * step.torque).toFixed(1), "mN m"],
      ["of it friction", (1e3 * step.friction_torque).toFixed(1), "mN m"],
      [BESIDE[rig.active], rig.beside ? (1e3 * rig.beside.torque).toFixed(1) : "–", "mN m"],
      ["handle force", (step.torque / scene.handle_radius_m).toFixed(2), "N"],
      ["force along the cut", step.force.toFixed(2), "N"],
      ["opening", (DEG * rig.pose.opening).toFixed(1), "°"],
      ["opening rate", rig.rate.toFixed(2), "rad/s"],
      ["advance", (1e3 * rig.pose.advance).toFixed(1), "mm"],
      ["contact", (1e3 * step.contact).toFixed(1), "mm"],
      ["indentation", (1e3 * Math.max(step.indentation, 0)).toFixed(3), "mm"],
      ["crack", cut_mm.toFixed(1), "mm"],
    ];
    if (this.isServed) rows.push(["torque of the rig", measured === undefined ? "–" : (1e3 * measured).toFixed(1), "mN m"]);
    list(this.state, rows);
    const warning = step.flags & FLAG.invalid ? LEANING : step.flags & FLAG.outOfRange ? BEYOND : "";
    this.warning.hidden = !warning;
    if (warning && this.warning.textContent !== warning) this.warning.textContent = warning;
    const error = energy.hand - energy.stored - energy.fracture - energy.arrest - energy.friction;
    list(this.energy, (["hand", "stored", "fracture", "arrest", "friction"] as const)
      .map((name): [string, string, string] => [name === "hand" ? "work of the hand" : name, (1e3 * energy[name]).toFixed(2), "mJ"])
      .concat([["error", (1e3 * error).toFixed(2), "mJ"]]));
    this.say(rig, cut_mm, now);
  }

  private say(rig: Rig, cut_mm: number, now: number): void {
    if (now - this.saidAt < SAID_EVERY_ms) return;
    const flags = rig.step.flags;
    const beyond = flags & FLAG.invalid ? "The edge leans back. " : flags & FLAG.outOfRange ? "Outside the range of the package. " : "";
    const text = `${beyond}Torque ${(1e3 * rig.step.torque).toFixed(0)} millinewton metres, opening ${(DEG * rig.pose.opening).toFixed(0)} degrees, crack at ${cut_mm.toFixed(0)} mm.`;
    if (text === this.before) return;
    this.saidAt = now;
    this.before = text;
    refilled(this.said, text);
  }
}

/** Fill a list of named numbers; elements stay where they are, so that reading is not interrupted. */
function list(into: HTMLElement, rows: [string, string, string][]): void {
  rows.forEach(([name, value, unit], i) => {
    let entry = into.children[i] as HTMLElement | undefined;
    if (!entry) {
      entry = html("div", { "data-number": name }, html("dt", {}, name), html("dd", {}));
      into.append(entry);
    }
    const text = `${isZero(value) ? value.replace("-", "") : value.replace("-", "−")} ${unit}`;
    if (entry.dataset.number !== name) [entry.dataset.number, entry.firstChild!.textContent] = [name, name];
    if (entry.lastChild!.textContent !== text) entry.lastChild!.textContent = text;
  });
}

/** Of a rounded number: minus nothing is nothing. */
function isZero(value: string): boolean {
  return Number(value) === 0;
}

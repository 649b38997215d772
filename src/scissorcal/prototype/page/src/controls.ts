// What a person changes: parts of the law, parameters, draws of the posterior, hands.

import { html, numberField, refilled } from "./elements";
import { Parts } from "./law";
import { Which } from "./rig";
import { Scene, Slider, unpack } from "./scene";

export interface Choices {
  parts: Parts;
  active: Which;
  /** Values of moved sliders, SI. */
  values: Map<string, number>;
  draw: number | null;
}

const STEPS = 400;
const PARTS: [keyof Parts, string][] = [["response", "response"], ["fracture", "fracture"], ["friction", "friction"]];

/** The controls of the law; `changed` is called after each change of the choices. */
export class Controls {
  readonly choices: Choices = {
    parts: { response: true, fracture: true, friction: true }, active: "fitted", values: new Map(), draw: null,
  };
  private readonly felt = html("div", { class: "row", role: "radiogroup", "aria-label": "Law that the hand feels" });
  private readonly sliders = html("div", { class: "sliders" });
  private readonly draws = html("div", { class: "row" });
  private readonly refusal = html("p", { class: "warning", role: "status" });
  private playing = 0;

  constructor(container: HTMLElement, private readonly scene: Scene, private readonly changed: () => void) {
    container.append(
      html("h2", {}, "Law"), this.felt,
      html("div", { class: "row", role: "group", "aria-label": "Parts of the law" }, ...PARTS.map(([name, label]) => this.part(name, label))),
      this.draws, this.refusal,
      html("h3", {}, "What if"),
      html("p", { class: "note" }, "Bar: 5 to 95 %; tick: fitted."),
      this.sliders,
    );
    if (!scene.numbers.length) return;
    this.refill();
  }

  /** Swap the law that is felt: as fitted, or what if. */
  swap(): void {
    this.choices.active = this.choices.active === "fitted" ? "whatIf" : "fitted";
    this.refill();
    this.changed();
  }

  /** Name the laws that the kernel did not take, such as one whose response has no stiffness. */
  refuse(names: string[]): void {
    refilled(this.refusal, names.length ? `The kernel refuses this law (${names.join(", ")}): move the parameters back.` : null);
    this.refusal.hidden = !names.length;
  }

  reset(): void {
    this.stopPlaying();
    this.choices.values.clear();
    this.choices.draw = null;
    this.choices.active = "fitted";
    this.refill();
    this.changed();
  }

  private refill(): void {
    const { choices } = this;
    const radio = (which: Which, label: string): HTMLElement => html("label", {}, html("input", {
      type: "radio", name: "felt", checked: choices.active === which, "data-key": which,
      change: () => {
        choices.active = which;
        this.refill();
        this.changed();
      },
    }), label);
    refilled(this.felt, "felt: ", radio("fitted", "as fitted"), radio("whatIf", "what if"),
      html("button", { type: "button", click: () => this.reset(), "data-key": "reset" }, "Reset what if"));
    this.fillDraws();
    refilled(this.sliders, ...this.scene.sliders.map((slider) => this.slider(slider)));
  }

  private part(name: keyof Parts, label: string): HTMLElement {
    return html("label", {}, html("input", {
      type: "checkbox", checked: true, "data-part": name,
      change: (event) => {
        this.choices.parts[name] = (event.target as HTMLInputElement).checked;
        this.changed();
      },
    }), label);
  }

  /** What a slider changed is no draw any more, and no further one takes its place. */
  private leaveDraws(): void {
    this.stopPlaying();
    this.choices.draw = null;
    this.fillDraws();
  }

  private stopPlaying(): void {
    window.clearInterval(this.playing);
    this.playing = 0;
  }

  private fillDraws(): void {
    const count = this.scene.draws ? this.scene.draws.values.shape[0] : 0;
    if (!count) return;
    const { choices } = this;
    const chosen = (draw: number | null): void => {
      choices.draw = draw;
      choices.values.clear();
      if (draw !== null) {
        const values = unpack(this.scene.draws!.values);
        const columns = this.scene.draws!.values.shape[1];
        for (const slider of this.scene.sliders) choices.values.set(slider.name, values[draw * columns + slider.column]);
      }
      this.refill();
      this.changed();
    };
    const next = (): void => chosen(choices.draw === null ? 0 : (choices.draw + 1) % count);
    const play = (): void => {
      if (this.playing) this.stopPlaying();
      else this.playing = window.setInterval(next, 600);
      this.fillDraws();
    };
    refilled(this.draws,
      numberField(`posterior draw, 1 to ${count}`, choices.draw === null ? 0 : choices.draw + 1, { key: "draw", least: 0, most: count }, (value) => chosen(value < 0.5 ? null : Math.round(value) - 1)),
      html("button", { type: "button", click: next, "data-key": "next" }, "Next draw"),
      html("button", { type: "button", click: play, "data-key": "play", "aria-pressed": String(this.playing !== 0) }, this.playing ? "Stop" : "Play draws"));
  }

  private slider(slider: Slider): HTMLElement {
    const nodes = unpack(slider.nodes);
    const [low, high] = [nodes[0], nodes[nodes.length - 1]];
    const value = this.choices.values.get(slider.name) ?? slider.value;
    const share = (at: number): number => Math.min(Math.max((at - low) / (high - low), 0), 1);
    const [scale, unit] = [slider.scale, slider.unit === "1" ? "" : slider.unit];
    const decimals = decimalsOf(scale * slider.sd);
    const shown = (at: number): string => `${(scale * at).toFixed(decimals).replace("-", "−")} ${raised(unit)}`.trim();
    const output = html("output", {}, shown(value));
    const input = html("input", {
      type: "range", min: 0, max: STEPS, step: "any", value: STEPS * share(value), "aria-label": slider.meaning || slider.name,
      "aria-valuetext": shown(value), "data-slider": slider.name, "data-key": slider.name,
      input: (event) => {
        const moved = event.currentTarget as HTMLInputElement;
        const wanted = low + (Number(moved.value) / STEPS) * (high - low);
        this.choices.values.set(slider.name, wanted);
        if (this.choices.draw !== null || this.playing) this.leaveDraws();
        output.textContent = shown(wanted);
        moved.setAttribute("aria-valuetext", shown(wanted));
        this.changed();
      },
    });
    const range = html("span", { class: "range", "aria-hidden": "true" }, html("span", { class: "interval" }), html("span", { class: "tick" }));
    const [interval, tick] = range.children as unknown as HTMLElement[];
    interval.style.left = `${100 * share(slider.q05)}%`;
    interval.style.width = `${Math.max(100 * (share(slider.q95) - share(slider.q05)), 0.7)}%`;
    tick.style.left = `${100 * share(slider.value)}%`;
    const interval_text = `${slider.name}: fitted ${shown(slider.value)}, 5 to 95 % ${shown(slider.q05)} to ${shown(slider.q95)}`;
    return html("div", { class: "slider", title: interval_text },
      html("span", { class: "name" }, slider.meaning || slider.name), output, input, range);
  }
}

/** Places after the point that two digits of a posterior's sd reach: more would be invented. */
function decimalsOf(sd: number): number {
  return sd > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(sd)), 0), 8) : 4;
}

/** A unit with raised exponents, "1/rad^2" as "1/rad²". */
function raised(unit: string): string {
  return unit.replace(/\^(-?\d+)/g, (_, power: string) => Array.from(power, (one) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(one)]).join(""));
}

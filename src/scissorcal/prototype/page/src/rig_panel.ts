// A running rig: its state, what a person confirms, and its samples.

import { html, refilled } from "./elements";
import { connect, Line, Recent, RigSamples, RigState, Server } from "./socket";

/** The section of a rig; only served pages have one. */
export class RigPanel {
  readonly recent = new Recent();
  private readonly line: Line;
  private readonly state = html("p", { class: "rig-state", role: "status" }, "Connecting.");
  private readonly following = html("p", { class: "note" });
  private readonly buttons = html("div", { class: "row" });
  private readonly refusal = html("p", { class: "warning", role: "alert" });
  private armed = "";

  constructor(container: HTMLElement, server: Server, follow: (samples: RigSamples) => void) {
    container.append(html("h2", {}, "Rig"), this.state, this.following, this.buttons, this.refusal,
      html("p", { class: "note" }, "Stop here is a convenience, not an emergency stop: keep the rig's own at hand."));
    this.line = connect(server, {
      connected: (isConnected, sentence) => {
        if (isConnected) return;
        this.state.textContent = sentence;
        this.following.textContent = "";
        refilled(this.buttons);
      },
      state: (state) => this.show(state),
      samples: (samples) => {
        this.recent.add(samples);
        follow(samples);
      },
      refused: (sentence) => (this.refusal.textContent = sentence),
    });
  }

  private show(state: RigState): void {
    this.refusal.textContent = "";
    const what = state.command ? `${state.command}: ` : "";
    const code = state.code === null ? "" : ` (exit code ${state.code})`;
    this.state.textContent = `${what}${state.state}. ${state.sentence}${code}`;
    this.following.textContent = state.following;
    const { request } = state;
    const button = (label: string, click: () => void, kind = ""): HTMLElement => html("button", { type: "button", class: kind, click }, label);
    const arm = (command: string): HTMLElement => button(`Arm ${command}`, () => {
      this.armed = command;
      this.line.arm(command);
    });
    const confirm = request === null ? [] : [
      html("p", { class: "request" }, request),
      button(`That is done: start ${state.command ?? this.armed}`, () => this.line.start(state.command ?? this.armed, state.question), "primary"),
    ];
    refilled(this.buttons, ...confirm,
      ...(state.state === "idle" && request === null ? state.commands.map(arm) : []),
      state.state === "idle" && request === null ? null : button("Stop", () => this.line.stop(), "stop"));
  }
}

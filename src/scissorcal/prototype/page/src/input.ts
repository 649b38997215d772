// Pointer and keys that move the blades, of the plain drawing and of the 3-D view.

import { LENGTHS_ACROSS } from "./drawing";
import { Pose } from "./hand";
import { Rig } from "./rig";
import { Scene } from "./scene";

const TURN_rad = 0.035;
const SLIDE_m = 0.001;

export const KEYS: [string, string][] = [ // in the 3-D view, drags and arrows where the box is ticked
  ["drag up and down", "opens and closes the blades; they lag behind the pointer by the force"],
  ["drag left and right", "moves the scissors along the cut"],
  ["Down, Up", "close, open by 2° (Shift: 10°)"],
  ["Right, Left", "advance, go back by 1 mm (Shift: 5 mm)"],
  ["Space", "one stroke from here"],
  ["F", "fresh sheet"],
  ["S", "swap the law that is felt: as fitted, what if"],
  ["3-D: drag, arrow keys", "turn the view; with “move the blades” ticked they move the blades, as above"],
  ["3-D: two fingers, + and −", "zoom (the wheel, too, once the view has the focus); Home sets the view back"],
];

export interface Acts {
  stroke(): void;
  freshSheet(): void;
  swap(): void;
}

/** How a picture is seen: whether drags and arrows move the blades, and where the cut runs, 1 to the right. */
export interface Seen {
  movesBlades(): boolean;
  way(): 1 | -1;
}

const PLAIN: Seen = { movesBlades: () => true, way: () => 1 };

/** Let a person move the rig on a picture of it. A second finger is not one that moves the blades. */
export function takeInput(canvas: HTMLElement, rig: Rig, scene: Scene, acts: Acts, seen = PLAIN): void {
  let began: { x: number; y: number; pose: Pose } | null = null;
  canvas.addEventListener("pointerdown", (event) => {
    began = null;
    if (!event.isPrimary || !seen.movesBlades()) return;
    canvas.setPointerCapture(event.pointerId);
    rig.play(null);
    began = { x: event.offsetX, y: event.offsetY, pose: rig.wanted };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!began || !event.isPrimary) return;
    const [closed, open] = scene.opening_rad;
    const opening = began.pose.opening - ((event.offsetY - began.y) / canvas.clientHeight) * 2 * (open - closed);
    const across = (LENGTHS_ACROSS * scene.blade_length_m) / canvas.clientWidth;
    const advance = began.pose.advance + seen.way() * across * (event.offsetX - began.x);
    rig.wanted = { opening: Math.min(Math.max(opening, 0.5 * closed), open), advance };
  });
  for (const name of ["pointerup", "pointercancel"] as const) canvas.addEventListener(name, () => (began = null));
  canvas.addEventListener("keydown", (event) => {
    const share = event.shiftKey ? 5 : 1;
    const by = (opening: number, advance: number) => (): void => {
      rig.play(null);
      const [closed, open] = scene.opening_rad;
      rig.wanted = {
        opening: Math.min(Math.max(rig.wanted.opening + share * opening, 0.5 * closed), open),
        advance: rig.wanted.advance + share * advance,
      };
    };
    const keys: Record<string, () => void> = {
      ArrowDown: by(-TURN_rad, 0), ArrowUp: by(TURN_rad, 0), ArrowRight: by(0, seen.way() * SLIDE_m), ArrowLeft: by(0, -seen.way() * SLIDE_m),
      " ": acts.stroke, f: acts.freshSheet, s: acts.swap,
    };
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key.startsWith("Arrow") && !seen.movesBlades()) return;
    event.preventDefault();
    act();
  });
}

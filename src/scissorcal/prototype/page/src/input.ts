// Pointer and keys that move the blades.

import { Drawing } from "./drawing";
import { Pose } from "./hand";
import { Rig } from "./rig";
import { Scene } from "./scene";

const TURN_rad = 0.035;
const SLIDE_m = 0.001;

export const KEYS: [string, string][] = [
  ["drag up and down", "opens and closes the blades; they lag behind the pointer by the force"],
  ["drag left and right", "moves the scissors along the cut"],
  ["Down, Up", "close, open by 2° (Shift: 10°)"],
  ["Right, Left", "advance, go back by 1 mm (Shift: 5 mm)"],
  ["Space", "one stroke from here"],
  ["F", "fresh sheet"],
  ["S", "swap the law that is felt: as fitted, what if"],
];

export interface Acts {
  stroke(): void;
  freshSheet(): void;
  swap(): void;
}

/** Let a person move the rig of a drawing. */
export function takeInput(drawing: Drawing, rig: Rig, scene: Scene, acts: Acts): void {
  const { canvas } = drawing;
  let began: { x: number; y: number; pose: Pose } | null = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    rig.play(null);
    began = { x: event.offsetX, y: event.offsetY, pose: rig.wanted };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (began) rig.wanted = drawing.poseAt(event.offsetX, scene, event.offsetY, began);
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
      ArrowDown: by(-TURN_rad, 0), ArrowUp: by(TURN_rad, 0), ArrowRight: by(0, SLIDE_m), ArrowLeft: by(0, -SLIDE_m),
      " ": acts.stroke, f: acts.freshSheet, s: acts.swap,
    };
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
}

// The drawing by keyboard: corners are chosen, moved, added and removed; each step is said.

import { Design, nameOf } from "./design_state";
import { middle, Point } from "./outline";

export const HELP = "Page Up and Page Down choose a corner, arrows move it by 1 mm (Shift: 10, Alt: 0.1), A adds a corner, "
  + "Delete removes it, Escape chooses the whole outline, Enter adds a shape of the chosen tool or closes a polygon, "
  + "plus and minus zoom.";

interface Canvas {
  enter(): void;
  leave(): void;
  zoom(factor: number): void;
}

type Say = (sentence: string) => void;

/** What each key does. */
export function keysOf(canvas: Canvas, design: Design, say: Say, event: KeyboardEvent): Record<string, (() => void) | undefined> {
  const step = event.shiftKey ? 10 : event.altKey ? 0.1 : 1;
  const add = (): void => addCorner(design, say);
  const away = (): void => removeCorner(design, say);
  return {
    ArrowLeft: () => move(design, say, [-step, 0]),
    ArrowRight: () => move(design, say, [step, 0]),
    ArrowDown: () => move(design, say, [0, -step]),
    ArrowUp: () => move(design, say, [0, step]),
    PageDown: () => turn(design, say, 1),
    PageUp: () => turn(design, say, -1),
    a: add,
    A: add,
    Delete: away,
    Backspace: away,
    Escape: () => {
      canvas.leave();
      design.choose(design.part);
    },
    Enter: () => canvas.enter(),
    "+": () => canvas.zoom(1.25),
    "-": () => canvas.zoom(0.8),
  };
}

export function addCorner(design: Design, say: Say): void {
  const { outline, corner, part } = design;
  if (corner === null) return say("Choose the corner behind which a new one goes.");
  const isEnd = part.kind === "edge" && corner === outline.length - 1;
  const from = isEnd ? corner - 1 : corner;
  const place = middle(outline[from], outline[(from + 1) % outline.length]);
  design.corner = from + 1;
  design.reshape([...outline.slice(0, from + 1), place, ...outline.slice(from + 1)]);
  sayCorner(design, say);
}

export function removeCorner(design: Design, say: Say): void {
  if (design.corner === null) return say("Choose a corner to remove; a whole part is removed in the list of layers.");
  if (design.outline.length <= (design.part.kind === "edge" ? 2 : 3)) return say("No corner less: too few would be left.");
  design.reshape(design.outline.filter((_, i) => i !== design.corner));
  sayCorner(design, say);
}

function move(design: Design, say: Say, [dx, dy]: Point): void {
  const { outline, corner } = design;
  if (!outline.length) return;
  const add = ([x, y]: Point): Point => [Number((x + dx).toFixed(4)), Number((y + dy).toFixed(4))];
  design.reshape(outline.map((point, i) => (corner === null || i === corner ? add(point) : point)));
  sayCorner(design, say);
}

function turn(design: Design, say: Say, by: number): void {
  const { outline, part, corner } = design;
  if (!outline.length) return;
  const next = corner === null ? (by > 0 ? 0 : outline.length - 1) : (corner + by + outline.length) % outline.length;
  design.choose(part, next);
  sayCorner(design, say);
}

function sayCorner({ outline, corner, drawn, part }: Design, say: Say): void {
  const name = nameOf(drawn, part);
  if (corner === null) return say(`${name} moved.`);
  const [x, y] = outline[corner];
  say(`${name}, corner ${corner + 1} of ${outline.length}: x ${x.toFixed(1)} mm, y ${y.toFixed(1)} mm.`);
}

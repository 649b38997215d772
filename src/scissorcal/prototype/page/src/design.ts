// The designer: a person draws plates and blades, and cuts them at once on the page.

import { DesignCanvas, Tool } from "./design_canvas";
import { drawnFromPlate, openDrawing, savedFile } from "./design_files";
import { Design, Kind, plainSheet } from "./design_state";
import { calibratedText, cornerTable, layerList, pieceTable } from "./design_tables";
import { Blades, edgePanel } from "./edge_panel";
import { html, refilled } from "./elements";
import { tableOf } from "./law";
import { Calibrated, Drawn, Edge, Piece, piecesOf } from "./pieces";
import { calibratedOf, drawnFromRecipe, Obstacle, obstacleOf, recipeText } from "./recipe_text";
import { Scene, unpack } from "./scene";
import { svgOf } from "./svg_file";

const PULL = "Pull it out on the drawing, or press Enter there.";
const FROM_FILES = "The package's plate, from its SVG files; their y points down, and up here.";
const TOOLS: [Tool, string, string][] = [
  ["move", "Move", ""], ["polygon", "Polygon", "Click the corners; a double click or Enter closes it."],
  ["rectangle", "Rectangle", PULL], ["circle", "Circle", PULL],
];
const KINDS: [Kind, string][] = [
  ["outline", "a plate or layer"], ["hole", "a hole in the chosen layer"],
  ["region", "a tougher or weaker part of it"], ["edge", "the edge of the blades"],
];

/** Also told: the drawing and the blade's edge, for pictures and tables. */
export interface Applied {
  drawn: Drawn;
  edge: Edge | null;
}

type Apply = (pieces: Piece[] | null, applied: Applied | null) => void;

/**
 * Put the designer into a container. `apply` gets the pieces at each change, null for the sheet as
 * it was calibrated; its second argument is what they were made of.
 */
export function mountDesign(container: HTMLElement, scene: Scene, apply: Apply): void {
  new Designer(container, scene, apply);
}

/** The drawing of the package's plate; null where it has none or it cannot be drawn. */
export function packagePlate(scene: Scene): Drawn | null {
  try {
    return scene.pieces ? ownPlate(scene) : null;
  } catch {
    return null; // the designer gives the reason
  }
}

function ownPlate(scene: Scene): Drawn | null {
  if (scene.drawn_plate) return drawnFromPlate(scene.drawn_plate);
  const own = drawnFromRecipe(scene.recipe ?? "");
  return own.layers.length ? { ...own, edge: null, edge_points: [] } : null;
}

class Designer {
  private readonly calibrated: Calibrated;
  private readonly fitted: Blades;
  private readonly design: Design;
  private readonly canvas: DesignCanvas;
  private readonly status = html("p", { class: "design-status", role: "status" });
  private readonly obstacle = html("p", { class: "design-obstacle", hidden: true });
  private readonly side = html("div", { class: "design-side" });
  private readonly tools = html("div", { class: "row", role: "toolbar", "aria-label": "Tools of the drawing" });
  private readonly cuts = html("input", { type: "checkbox", change: () => {
    this.told();
    this.refresh();
  } });
  private pieces: Piece[] | null = null;
  private refusal = "";
  private taken: [Piece[], Applied] | null = null;
  private timer = 0;

  constructor(container: HTMLElement, private readonly scene: Scene, private readonly apply: Apply) {
    this.calibrated = calibratedOf(scene);
    this.fitted = { table: tableOf(unpack(scene.tables.edge)), length_m: scene.blade_length_m };
    const begun = this.begun();
    this.design = new Design(begun.drawn, (isDone) => this.changed(isDone), scene.recipe ?? null);
    const paper = html("div", { class: "design-paper" });
    const say = (sentence: string): void => this.say(sentence);
    this.canvas = new DesignCanvas(paper, this.design, this.calibrated, say);
    container.classList.add("design");
    container.addEventListener("keydown", (event) => undoKeys(event, this.design));
    container.replaceChildren(
      this.obstacle,
      html("p", {}, `Plates from above, against the calibrated ${calibratedText(this.calibrated)}.`),
      html("div", { class: "row" }, html("label", { class: "field" }, "The next shape is ", this.kinds()), this.tools),
      this.files(), this.status, html("div", { class: "design-both" }, paper, this.side),
    );
    this.canvas.fit();
    this.meet();
    this.tables();
    if (begun.sentence) this.say(begun.sentence);
  }

  /** What is drawn first: the package's own plate where its recipe holds one, else the plain sheet. */
  private begun(): { drawn: Drawn; sentence: string } {
    const { scene } = this;
    const drawn = packagePlate(scene);
    if (drawn) return { drawn, sentence: scene.drawn_plate ? FROM_FILES : "" };
    const plain = plainSheet(this.calibrated, scene.blade_length_m);
    if (!scene.pieces) return { drawn: plain, sentence: "" };
    try {
      ownPlate(scene);
    } catch (error) {
      return { drawn: plain, sentence: `The plate of the package cannot be drawn here: ${(error as Error).message}` };
    }
    return { drawn: plain, sentence: "The package does not hold the drawing of its plate: this is a plain sheet." };
  }

  private say(sentence: string): void {
    this.status.textContent = sentence;
  }

  /** The drawing changed, or what is chosen of it. */
  private changed(isDone: boolean): void {
    this.canvas.redraw();
    if (!isDone && this.canvas.isDragging) return;
    this.meet();
    this.refresh();
    if (!isDone) return;
    this.cuts.checked = !this.design.isUniform;
    this.told();
  }

  /** Why the model does not have the blades that are drawn; "" where it has. */
  private unfelt(): string {
    if (!this.cuts.checked) return "The model on this page cuts with the blades as fitted, until it cuts this drawing (the box above).";
    return this.pieces ? "" : "The model takes these blades together with the plate, which it refuses.";
  }

  private told(): void {
    if (!this.cuts.checked) this.apply(null, null);
    else {
      if (this.pieces) this.taken = [this.pieces, { drawn: this.design.drawn, edge: this.design.drawn.edge }];
      if (this.taken) this.apply(...this.taken); // of a plate that is refused, the last that was taken
    }
  }

  /** What the blades meet of the drawing, or why the kernel does not take it. */
  private meet(): void {
    this.pieces = null;
    this.refusal = "";
    try {
      this.pieces = piecesOf(this.design.drawn, this.calibrated);
    } catch (error) {
      this.refusal = (error as Error).message;
    }
  }

  /** Show the tables anew, once for all that changes now; what is typed meanwhile stays in its field. */
  private refresh(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.tables());
  }

  private tables(): void {
    const { design } = this;
    const say = (sentence: string): void => this.say(sentence);
    refilled(this.side,
      layerList(design), pieceTable(this.pieces, this.refusal),
      cornerTable(design, say), edgePanel(design, this.fitted, say, this.unfelt()));
    this.buttons();
    this.obstruct();
  }

  /** What would keep the drawing out of the recipe is offered to be changed before one draws. */
  private obstruct(): void {
    const { design } = this;
    let found: Obstacle | null = null;
    try {
      found = obstacleOf(design.base);
    } catch {
      // no recipe at all: saving it gives the reason
    }
    this.obstacle.hidden = !found;
    refilled(this.obstacle, ...(found ? [`${found.sentence} `, html("button", { type: "button", "data-key": "obstacle", click: () => {
      design.replace(design.drawn, true, found.base, !this.cuts.checked); // a box that is not ticked stays so
      this.say(`${found.offer}: done. Undo takes it back.`);
    } }, found.offer)] : []));
  }

  private buttons(): void {
    const { canvas, design } = this;
    const button = (key: string, text: string, click: () => void, more: Record<string, string | boolean> = {}): HTMLElement =>
      html("button", { type: "button", "data-key": key, click, ...more }, text);
    refilled(this.tools,
      ...TOOLS.map(([tool, text, sentence]) => button(tool, text, () => {
        canvas.choose(tool);
        this.buttons();
        this.say(sentence);
      }, { "aria-pressed": String(canvas.tool === tool) })),
      button("undo", "Undo", () => design.undo(), { disabled: !design.canUndo }),
      button("redo", "Redo", () => design.redo(), { disabled: !design.canRedo }),
      button("in", "+", () => canvas.zoom(1.25), { "aria-label": "Zoom in" }),
      button("out", "−", () => canvas.zoom(0.8), { "aria-label": "Zoom out" }),
      button("fit", "Show all", () => canvas.fit()));
  }

  private kinds(): HTMLElement {
    const select = html("select", { change: () => (this.canvas.draws = select.value as Kind) },
      ...KINDS.map(([kind, text]) => html("option", { value: kind }, text)));
    return select;
  }

  private files(): HTMLElement {
    const file = html("input", {
      type: "file", accept: ".svg,.toml,image/svg+xml", "aria-label": "Load an SVG outline or a recipe",
      change: () => {
        const chosen = file.files?.[0];
        if (chosen) void this.load(chosen).finally(() => (file.value = ""));
      },
    });
    const { design, scene } = this;
    const saves = (name: string, type: string, text: () => string): HTMLElement =>
      html("button", { type: "button", click: () => this.tried(() => {
        savedFile(name, type, text());
        this.say(`${name} is saved.`);
      }) }, `Save ${name}`);
    return html("div", { class: "row" },
      html("label", { class: "button" }, "Load SVG or recipe ", file),
      saves("recipe.toml", "application/toml", () => recipeText(design.drawn, scene, design.base)),
      saves("drawing.svg", "image/svg+xml", () => svgOf(design.drawn)),
      html("label", { class: "field" }, this.cuts, ` cut this drawing instead of ${scene.pieces ? "the package's plate" : "the plain sheet"}`));
  }

  private async load(chosen: File): Promise<void> {
    const text = await chosen.text();
    this.tried(() => {
      const { design, canvas } = this;
      const found = openDrawing(chosen.name, text, design.drawn, {
        kind: canvas.draws, layer: design.part.layer, sheet: plainSheet(this.calibrated, this.scene.blade_length_m).layers[0],
      });
      design.part = found.part;
      design.corner = null;
      design.replace(found.drawn, true, found.base, found.isUniform);
      canvas.fit();
      this.say(found.sentence);
    });
  }

  /** Do what may be refused, and say why where it is. */
  private tried(action: () => void): void {
    try {
      action();
    } catch (error) {
      this.say((error as Error).message);
    }
  }
}

/** Control and Z, Y or Shift and Z, except in a field, which has its own. */
function undoKeys(event: KeyboardEvent, design: Design): void {
  const key = event.key.toLowerCase();
  if (!(event.ctrlKey || event.metaKey) || (key !== "z" && key !== "y")) return;
  if (event.target instanceof HTMLInputElement && event.target.type !== "checkbox") return;
  event.preventDefault();
  if (key === "y" || event.shiftKey) design.redo();
  else design.undo();
}

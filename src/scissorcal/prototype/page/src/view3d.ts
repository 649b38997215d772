// The 3-D look: blades, sheet or drawn plates with their crack, the plate in its pose.

import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, HemisphereLight,
  LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, MeshPhongMaterial, Quaternion, Scene as World, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { Blades } from "./blades3d";
import { coloursOf, heightOver, View } from "./drawing";
import { Table } from "./kernel";
import { bladeLength } from "./law";
import { Orbit } from "./orbit";
import { Interval, rectangle } from "./outline";
import { materialOf } from "./pieces";
import { Depth, Grid, Solid } from "./solids";
import { slabsOf, Tinted } from "./slabs";

const HALF_WIDTH_mm = 30; // of a plate that nobody drew
const CLEAR_mm = 0.3;
const THIN_mm = 1;
const MOST_BEND_mm = 14;
const CRACK_POINTS = 600;
const CRACK_STEP_mm = 1.5;
const FLOAT_m = 1e-6; // places of the kernel are float32
/** From the rig's frame (x along the cut, y up) to that of the view (y to the left of the cut, z up). */
const UPRIGHT = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), 0.5 * Math.PI);
const MOST_RATIO = 2; // pixels of a screen to one of the page
// Lines on a face are in front of it.
const PLATE = { side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 } as const;
const ZOOMS = "two fingers, + and − zoom, Home sets the view back.";
const HELP = [`Drag or arrow keys turn the view; ${ZOOMS}`, `Drag or arrow keys move the blades; ${ZOOMS}`];
const NONE = "This browser has no WebGL, which the 3-D view needs; the plain drawing shows the same.";

export class View3d {
  private readonly renderer: WebGLRenderer | null = null;
  private readonly world = new World();
  private readonly plate = new Group();
  private readonly orbit: Orbit | null = null;
  private readonly resizes: ResizeObserver | null = null;
  private readonly note = document.createElement("p");
  private readonly materials = {
    steel: new MeshPhongMaterial({ specular: 0x666666, shininess: 45 }),
    handle: new MeshPhongMaterial({ specular: 0x222222, shininess: 25 }),
    ghost: new MeshPhongMaterial({ transparent: true, opacity: 0.3, depthWrite: false }),
    upperEdge: new LineBasicMaterial(), lowerEdge: new LineBasicMaterial(), crack: new LineBasicMaterial(),
    grid: new LineBasicMaterial({ transparent: true, opacity: 0.35 }),
    contact: new MeshLambertMaterial(),
    sheet: new MeshLambertMaterial(PLATE),
    second: new MeshLambertMaterial(PLATE),
    tougher: new MeshLambertMaterial(PLATE),
    weaker: new MeshLambertMaterial(PLATE),
  };
  private readonly contact = new Mesh(new SphereGeometry(0.9, 16, 12), this.materials.contact);
  private readonly cracks: LineSegments[] = [];
  private blades: { of: Table; blades: Blades } | null = null;
  private solids: { of: unknown[]; solids: (Solid | Grid)[] } | null = null;
  private bent: unknown[] = [];
  /** Of the line along the crack; a thick plate shows the crack by its faces. */
  private crackHeight: number | null = null;
  private theme = "";
  private sized = "";
  private view: View | null = null;

  constructor(private readonly container: HTMLElement) {
    container.classList.add("view3d");
    container.append(this.note);
    try {
      this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    } catch {
      this.note.textContent = NONE;
      return;
    }
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    container.prepend(canvas);
    this.note.textContent = this.help;
    this.orbit = new Orbit(canvas, () => this.again());
    this.resizes = new ResizeObserver(() => this.again());
    this.resizes.observe(container);
    canvas.addEventListener("webglcontextlost", () => (this.note.textContent = "The 3-D view lost its graphics; it comes back with them."));
    canvas.addEventListener("webglcontextrestored", () => {
      this.note.textContent = this.help;
      this.again();
    });
    this.light();
    this.world.add(this.plate, this.contact);
    for (const _ of [1, -1]) {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * CRACK_POINTS), 3));
      const line = new LineSegments(geometry, this.materials.crack);
      line.frustumCulled = false;
      this.cracks.push(line);
      this.plate.add(line);
    }
  }

  /** What a person drags and steers by keys; null without WebGL. */
  get canvas(): HTMLElement | null {
    return this.renderer?.domElement ?? null;
  }

  /** Where the right of the picture points: 1 along the cut, -1 back. */
  get way(): 1 | -1 {
    return this.orbit?.way ?? 1;
  }

  get movesBlades(): boolean {
    return this.orbit?.movesBlades ?? false;
  }

  set movesBlades(isOn: boolean) {
    if (!this.orbit) return;
    this.orbit.movesBlades = isOn;
    this.note.textContent = this.help;
    this.again();
  }

  private get help(): string {
    return HELP[this.movesBlades ? 1 : 0];
  }

  draw(view: View): void {
    this.view = view;
    const { renderer, orbit } = this;
    const { clientWidth: width, clientHeight: height } = this.container;
    if (!renderer || !orbit || !width || !height) return;
    this.colour();
    this.shape(view);
    this.place(view);
    this.size(width, height);
    const length = 1e3 * bladeLength(view.law);
    orbit.aim(new Vector3(0.28 * length, 0, 0), 0.74 * length, width / height);
    renderer.render(this.world, orbit.camera);
    this.tell(view);
  }

  dispose(): void {
    this.resizes?.disconnect();
    this.orbit?.dispose();
    this.blades?.blades.dispose();
    this.solids?.solids.forEach((solid) => solid.dispose());
    this.cracks.forEach((line) => line.geometry.dispose());
    this.contact.geometry.dispose();
    Object.values(this.materials).forEach((material) => material.dispose());
    this.renderer?.domElement.remove();
    this.renderer?.dispose();
    this.renderer?.forceContextLoss(); // a browser keeps few, and takes away the oldest
    this.note.remove();
    this.container.classList.remove("view3d");
    this.view = null;
  }

  /** A canvas is cleared by each new size, also by the same. */
  private size(width: number, height: number): void {
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_RATIO);
    const size = [width, height, ratio].join();
    if (size === this.sized) return;
    this.sized = size;
    this.renderer?.setPixelRatio(ratio);
    this.renderer?.setSize(width, height, false);
  }

  private again(): void {
    if (this.view) this.draw(this.view);
  }

  private light(): void {
    const key = new DirectionalLight(0xffffff, 2.6);
    key.position.set(-0.9, -0.7, 1.3);
    const rim = new DirectionalLight(0xffffff, 0.9);
    rim.position.set(0.8, 1, 0.3);
    this.world.add(new HemisphereLight(0xffffff, 0x8f8a84, 1), key, rim);
  }

  /** Take the page's colours where the theme changed. */
  private colour(): void {
    const colours = coloursOf(this.container);
    const theme = JSON.stringify(colours);
    if (theme === this.theme) return;
    this.theme = theme;
    const context = document.createElement("canvas").getContext("2d");
    const read = (text: string): Color => {
      if (!context) return new Color(0x888888);
      context.fillStyle = "#888888";
      context.fillStyle = text;
      return new Color(context.fillStyle);
    };
    const { ink, muted, paper, hand, material } = colours;
    const { materials } = this;
    const steel = read(muted).lerp(new Color(0xffffff), 0.72);
    materials.steel.color = steel;
    materials.handle.color = read(muted).lerp(read(ink), 0.35);
    materials.ghost.color = read(hand);
    materials.upperEdge.color = read(ink);
    materials.lowerEdge.color = read(ink);
    materials.crack.color = read(ink);
    materials.grid.color = read(ink);
    materials.contact.color = read(ink);
    materials.sheet.color = read(material).lerp(read(paper), 0.25);
    materials.second.color = read(material).lerp(read(paper), 0.55);
    materials.tougher.color = read(material).lerp(new Color(0x000000), 0.45);
    materials.weaker.color = read(material).lerp(new Color(0xffffff), 0.75);
  }

  /** Make blades and plates anew where they are others than before. */
  private shape(view: View): void {
    const { scene, law } = view;
    const length = 1e3 * bladeLength(law);
    if (this.blades?.of !== law.tables.edge) {
      this.blades?.blades.dispose();
      const blades = new Blades(law.tables.edge, length, scene.moving_blades, this.materials);
      this.blades = { of: law.tables.edge, blades };
      this.world.add(blades.group);
    }
    const thickness = 1e3 * scene.upper_face_m * scene.moving_blades;
    const reach = length * (1 + Math.ceil((1e3 * view.pose.advance) / length + 1));
    const of = [view.drawn, view.pieces, scene, view.drawn || view.pieces ? 0 : reach];
    if (this.solids && of.every((one, i) => one === this.solids?.of[i])) return;
    const plain = { outline: rectangle([0, -HALF_WIDTH_mm], [reach, HALF_WIDTH_mm]), holes: [], low: 0, high: thickness, tint: "sheet" as const };
    const slabs: Tinted[] = slabsOf(view, HALF_WIDTH_mm) ?? [plain];
    const cut = view.drawn?.cut_line_mm ?? 0;
    this.solids?.solids.forEach((solid) => solid.dispose());
    this.plate.remove(...this.plate.children.filter((one) => (one instanceof Mesh || one instanceof LineSegments) && !this.cracks.includes(one as LineSegments)));
    const height = Math.max(...slabs.map((slab) => slab.high), 0);
    const base = scene.moving_blades === 2 ? 0.5 * height : -CLEAR_mm; // a blade that stands lies under it
    this.crackHeight = height < THIN_mm ? height - base + 0.1 : null;
    const solids = slabs.flatMap((slab) => {
      const own = { ...slab, low: slab.low - base, high: slab.high - base };
      const [solid, grid] = [new Solid(own, cut), new Grid(own, cut)];
      this.plate.add(new Mesh(solid.geometry, this.materials[slab.tint]), new LineSegments(grid.geometry, this.materials.grid));
      return [solid, grid];
    });
    this.solids = { of, solids };
  }

  private place(view: View): void {
    const { scene, pose, wanted } = view;
    this.blades?.blades.turn(pose.opening, wanted.opening);
    const cut = view.drawn?.cut_line_mm ?? 0;
    const at = scene.plate_pose;
    const turn = at ? new Vector3(...at.rotation_vector_rad) : new Vector3();
    this.plate.quaternion.setFromAxisAngle(turn.clone().normalize(), turn.length());
    if (at) this.plate.quaternion.premultiply(UPRIGHT);
    // Turned and raised as the pose says. Along and across, the model cuts it at its line of the cut.
    const origin = new Vector3(0, -cut, 0).applyQuaternion(this.plate.quaternion);
    this.plate.position.set(-1e3 * pose.advance, 0, at ? 1e3 * at.position_m[1] : 0).add(origin);
    const crack = crackOf(view);
    this.bend(view, crack);
    const contact = crack - pose.advance;
    this.contact.visible = view.step.response > 0 && contact > 0;
    this.contact.position.set(1e3 * contact, 0, 1e3 * heightOver(view, Math.max(contact, 0)));
  }

  /** Behind the crack the upper edge presses one flap down, and the lower lifts the other. */
  private bend(view: View, crack: number): void {
    const { pose, scene } = view;
    const now = [this.solids, this.blades, pose.opening, pose.advance, crack, view.drawn?.cut_line_mm];
    if (now.every((one, i) => one === this.bent[i])) return;
    this.bent = now;
    const face = 1e3 * scene.upper_face_m;
    const depth: Depth = (x) => {
      if (x >= 1e3 * crack) return 0;
      const place = Math.max(1e-3 * x - pose.advance, 0);
      const found = Math.min(Math.max(face - 1e3 * heightOver(view, place), 0), MOST_BEND_mm);
      return found + Math.min(found, CLEAR_mm);
    };
    const isBoth = scene.moving_blades === 2;
    this.solids?.solids.forEach((solid) => solid.bend(depth, isBoth));
    const material = materialUnder(view);
    this.cracks.forEach((line, i) => {
      const share = i === 0 ? -1 : isBoth ? 1 : 0;
      const places = line.geometry.getAttribute("position") as BufferAttribute;
      let count = 0;
      for (const [from, to] of material) {
        const end = Math.min(to, 1e3 * crack);
        const steps = Math.ceil((end - from) / CRACK_STEP_mm);
        for (let k = 0; k < steps && count + 2 <= places.count; k++) {
          for (const x of [from + (k * (end - from)) / steps, from + ((k + 1) * (end - from)) / steps]) {
            places.setXYZ(count++, x, view.drawn?.cut_line_mm ?? 0, (this.crackHeight ?? 0) + share * depth(x));
          }
        }
      }
      places.needsUpdate = true;
      line.geometry.setDrawRange(0, count);
      line.visible = this.crackHeight !== null;
    });
  }

  private tell(view: View): void {
    const degrees = Math.round((180 / Math.PI) * view.pose.opening);
    const text = `3-D view of the scissors: opening ${degrees} degrees, ${Math.round(1e3 * crackOf(view))} mm cut. ${this.help}`;
    const canvas = this.renderer?.domElement;
    if (canvas && canvas.getAttribute("aria-label") !== text) canvas.setAttribute("aria-label", text);
  }
}

/** The farthest place (m) to which something is cut; a piece that nothing touched has its crack at its begin. */
function crackOf({ crack, pieces, cracks }: View): number {
  if (!pieces || !cracks) return crack;
  return cracks.reduce((most, one, i) => (pieces[i] && one > pieces[i].begin_m + FLOAT_m ? Math.max(most, one) : most), 0);
}

/** Where there is material along the cut, in mm. */
function materialUnder({ drawn, pieces }: View): Interval[] {
  if (drawn) return drawn.layers.flatMap((layer) => materialOf(layer, drawn.cut_line_mm));
  if (pieces) return pieces.map((piece): Interval => [1e3 * piece.begin_m, 1e3 * piece.strips[piece.strips.length - 1].end_m]);
  return [[0, Infinity]];
}

// A camera that goes round a point: by dragging, by two fingers, by wheel and by keys.

import { PerspectiveCamera, Vector3 } from "three";

interface Place {
  round: number; // rad, from the right of the scissors towards their handles
  up: number; // rad above the plate
  distance: number; // as a multiple of what shows all
}

const HOME: Place = { round: 0.45, up: 0.6, distance: 1 };
const KEY_rad = 0.1;
const TURN_rad_per_px = 0.008;
const HIGHEST_rad = 1.5;

export class Orbit {
  readonly camera = new PerspectiveCamera(32, 1, 1, 4000);
  /** Whether drags and arrow keys move the blades, which others see to; zooming stays here. */
  movesBlades = false;
  private place = { ...HOME };
  private readonly pointers = new Map<number, PointerEvent>();
  private readonly ends = new AbortController();

  constructor(element: HTMLElement, private readonly changed: () => void) {
    const { signal } = this.ends;
    this.camera.up.set(0, 0, 1);
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, event);
    }, { signal });
    element.addEventListener("pointermove", (event) => this.dragged(event), { signal });
    for (const end of ["pointerup", "pointercancel"] as const) {
      element.addEventListener(end, (event) => this.pointers.delete(event.pointerId), { signal });
    }
    element.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== element) return; // the page scrolls
      event.preventDefault();
      this.turn(0, 0, Math.exp(0.0015 * event.deltaY));
    }, { signal, passive: false });
    element.addEventListener("keydown", (event) => this.keyed(event), { signal });
  }

  /** Where the right of the view points: 1 along the cut, -1 back. */
  get way(): 1 | -1 {
    return Math.cos(this.place.round) < 0 ? -1 : 1;
  }

  dispose(): void {
    this.ends.abort();
  }

  /** Look at a point from where a person turned to; radius is what must be seen about it. */
  aim(target: Vector3, radius: number, aspect: number): void {
    const { camera, place } = this;
    camera.aspect = aspect;
    const half = (0.5 * camera.fov * Math.PI) / 180;
    const narrow = Math.min(Math.tan(half), Math.tan(half) * aspect);
    const distance = (place.distance * radius) / narrow;
    const flat = distance * Math.cos(place.up);
    camera.position.set(
      target.x + flat * Math.sin(place.round), target.y - flat * Math.cos(place.round), target.z + distance * Math.sin(place.up),
    );
    camera.lookAt(target);
    camera.near = 0.02 * distance;
    camera.far = distance + 20 * radius;
    camera.updateProjectionMatrix();
  }

  private turn(round: number, up: number, nearer = 1): void {
    const { place } = this;
    place.round += round;
    place.up = Math.min(Math.max(place.up + up, -HIGHEST_rad), HIGHEST_rad);
    place.distance = Math.min(Math.max(place.distance * nearer, 0.08), 5);
    this.changed();
  }

  private dragged(event: PointerEvent): void {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    if (this.pointers.size === 1) {
      if (!this.movesBlades) this.turn(-TURN_rad_per_px * (event.clientX - before.clientX), TURN_rad_per_px * (event.clientY - before.clientY));
    } else {
      const apart = (a: PointerEvent, b: PointerEvent): number => Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      const other = [...this.pointers.values()].find((one) => one.pointerId !== event.pointerId);
      if (other) this.turn(0, 0, Math.max(apart(before, other), 1) / Math.max(apart(event, other), 1));
    }
    this.pointers.set(event.pointerId, event);
  }

  private keyed(event: KeyboardEvent): void {
    if (this.movesBlades && event.key.startsWith("Arrow")) return;
    const keys: Record<string, (() => void) | undefined> = {
      ArrowLeft: () => this.turn(-KEY_rad, 0), ArrowRight: () => this.turn(KEY_rad, 0),
      ArrowUp: () => this.turn(0, KEY_rad), ArrowDown: () => this.turn(0, -KEY_rad),
      "+": () => this.turn(0, 0, 0.85), "-": () => this.turn(0, 0, 1 / 0.85),
      Home: () => {
        this.place = { ...HOME };
        this.changed();
      },
    };
    const done = event.ctrlKey || event.metaKey ? undefined : keys[event.key];
    if (!done) return;
    done();
    event.preventDefault();
  }
}

// The C core as WebAssembly (scissorcal/kernel/web/sc_web.c): one instance holds one model.

import { Piece } from "./pieces";

export const TABLE_NAMES = [
  "edge", "response", "friction_opening", "friction_closing", "friction_angle",
] as const;

/** Places in the list of numbers that make a model, as scissorcal.kernel.web_module has them. */
export const AT = { renderFriction: 2, upperFace: 3, fractureEnergy: 4, kappa: 5, rateDamping: 6, tipStation: 9 } as const;

/** x, y and slope of one table, its knots in order. */
export interface Table {
  x: Float32Array;
  y: Float32Array;
  slope: Float32Array;
}

export type Tables = Record<string, Table>;

export interface Step {
  torque: number;
  force: number;
  contact: number;
  indentation: number;
  height: number;
  response: number;
  friction_torque: number;
  stored_J: number;
  fracture_J: number;
  arrest_J: number;
  flags: number;
}

export const FLAG = { invalid: 1, touching: 2, advanced: 4, outOfRange: 8, beyondTip: 16 } as const;

const STEP_NUMBERS = 11;

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  sc_web_table(which: number, size: number): number;
  sc_web_table_max(): number;
  sc_web_batch_max(): number;
  sc_web_make(...numbers: number[]): number;
  sc_web_reset(crack: number): void;
  sc_web_crack(): number;
  sc_web_places(): number;
  sc_web_outputs(): number;
  sc_web_steps(count: number): void;
  sc_web_settled(count: number): void;
  sc_web_pieces_clear(): void;
  sc_web_piece_begin(begin: number, upperFace: number, scale: number): number;
  sc_web_piece_strip(end: number, energy: number): number;
  sc_web_piece_crack(which: number): number;
  sc_web_piece_set_crack(which: number, at: number): number;
}

export class Kernel {
  /** Longest batch of steps. */
  readonly most: number;
  private readonly c: Exports;
  private readonly places: Float32Array;
  private readonly outputs: Float32Array;
  private readonly flags: Uint32Array;

  constructor(module: WebAssembly.Module) {
    this.c = new WebAssembly.Instance(module, {}).exports as unknown as Exports;
    this.c._initialize();
    this.most = this.c.sc_web_batch_max();
    const memory = this.c.memory.buffer;
    this.places = new Float32Array(memory, this.c.sc_web_places(), 3 * this.most);
    this.outputs = new Float32Array(memory, this.c.sc_web_outputs(), STEP_NUMBERS * this.most);
    this.flags = new Uint32Array(memory, this.c.sc_web_outputs(), STEP_NUMBERS * this.most);
  }

  /** Take a model, its crack at 0; false, and no model, where it is not sound. */
  load(tables: Tables, numbers: readonly number[]): boolean {
    const stride = this.c.sc_web_table_max();
    TABLE_NAMES.forEach((name, which) => {
      const { x, y, slope } = tables[name];
      const at = this.c.sc_web_table(which, x.length);
      [x, y, slope].forEach((row, i) => {
        new Float32Array(this.c.memory.buffer, at + 4 * stride * i, x.length).set(row);
      });
    });
    return this.c.sc_web_make(...numbers) === 1;
  }

  /** Cut these pieces from now on, null: the uniform sheet; false, and the sheet, where one is not sound. */
  cut(pieces: readonly Piece[] | null): boolean {
    this.c.sc_web_pieces_clear();
    const isSound = (pieces ?? []).every((piece) => this.c.sc_web_piece_begin(piece.begin_m, piece.upper_face_m, piece.scale)
      && piece.strips.every((strip) => this.c.sc_web_piece_strip(strip.end_m, strip.fracture_energy_J_per_m)));
    if (!isSound) this.c.sc_web_pieces_clear();
    return isSound;
  }

  /** Crack tip of each of so many pieces, m. */
  cracks(count: number): number[] {
    return Array.from({ length: count }, (_, i) => this.c.sc_web_piece_crack(i));
  }

  /** Put the cracks of the pieces where those of the same pieces were. */
  putCracks(cracks: readonly number[]): void {
    cracks.forEach((at, i) => this.c.sc_web_piece_set_crack(i, at));
  }

  reset(crack = 0): void {
    this.c.sc_web_reset(crack);
  }

  get crack(): number {
    return this.c.sc_web_crack();
  }

  step(opening: number, rate: number, advance: number): Step {
    this.places[0] = opening;
    this.places[1] = rate;
    this.places[2] = advance;
    this.c.sc_web_steps(1);
    const out = this.outputs;
    return {
      torque: out[0], force: out[1], contact: out[2], indentation: out[3], height: out[4],
      response: out[5], friction_torque: out[6], stored_J: out[7], fracture_J: out[8],
      arrest_J: out[9], flags: this.flags[10],
    };
  }

  /** Steps from triples of opening, rate and advance; their outputs, as the core's struct has them. */
  steps(triples: Float32Array): Uint32Array {
    const count = triples.length / 3;
    const done = new Uint32Array(STEP_NUMBERS * count);
    for (let start = 0; start < count; start += this.most) {
      const some = Math.min(this.most, count - start);
      this.places.set(triples.subarray(3 * start, 3 * (start + some)));
      this.c.sc_web_steps(some);
      done.set(this.flags.subarray(0, STEP_NUMBERS * some), STEP_NUMBERS * start);
    }
    return done;
  }

  /** Torque with the crack at each contact, or farther out where it settles. */
  settled(openings: Float32Array, rate: number, contact: number): Float32Array {
    const count = Math.min(openings.length, this.most);
    for (let i = 0; i < count; i++) {
      this.places[3 * i] = openings[i];
      this.places[3 * i + 1] = rate;
      this.places[3 * i + 2] = contact;
    }
    this.c.sc_web_settled(count);
    return Float32Array.from({ length: count }, (_, i) => this.outputs[STEP_NUMBERS * i]);
  }
}

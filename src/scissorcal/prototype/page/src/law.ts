// A law as the kernel takes it: as fitted, at other parameters, of a posterior draw, in part.

import { AT, Kernel, Table, Tables, TABLE_NAMES } from "./kernel";
import { Rows, Scene, unpack } from "./scene";

export interface Law {
  tables: Tables;
  numbers: number[];
  /** Mean energy of a rippled crack over the opening, and the energies that have a kernel. */
  mean: Table | null;
  levels: number[];
}

export interface Parts {
  response: boolean;
  fracture: boolean;
  friction: boolean;
}

const LEVELS = 9; // as scissorcal.package.average has them
const EVEN = 1e-6;
const PLACES = 400; // on the edge

export function asFitted(scene: Scene): Law {
  const tables: Tables = {};
  for (const name of TABLE_NAMES) tables[name] = tableOf(unpack(scene.tables[name]));
  return {
    tables,
    numbers: [...scene.numbers],
    mean: scene.mean_energy ? tableOf(unpack(scene.mean_energy)) : null,
    levels: [...scene.levels],
  };
}

/** The law with some sliders moved: differences from the fitted law add up, table by table. */
export function whatIf(scene: Scene, fitted: Law, values: ReadonlyMap<string, number>): Law {
  const law = copied(fitted);
  for (const slider of scene.sliders) {
    const value = values.get(slider.name);
    if (value === undefined || value === slider.value) continue;
    const nodes = unpack(slider.nodes);
    change(law, scene.centre, slider.rows, placeIn(nodes, value));
  }
  return settledLaw(law, fitted);
}

/** The law of a draw of the posterior, on the knots of the fitted tables. */
export function ofDraw(scene: Scene, fitted: Law, draw: number): Law {
  const law = copied(fitted);
  if (scene.draws) change(law, scene.centre, scene.draws.rows, { below: draw, share: 0 });
  return settledLaw(law, fitted);
}

/** Leave parts of the law out; without the response nothing touches and nothing is cut. */
export function inPart(law: Law, parts: Parts): Law {
  const found = copied(law);
  if (!parts.response) found.tables.response = flat(found.tables.response);
  if (!parts.response || !parts.fracture) {
    found.numbers[AT.fractureEnergy] = 0;
    found.mean = null;
    found.levels = [];
  }
  if (!parts.friction) found.numbers[AT.renderFriction] = 0;
  return found;
}

/** The average torque, ripple averaged out: what open_package(...).torque evaluates. */
export class Average {
  private readonly kernels: Kernel[] = [];
  private law: Law | null = null;

  constructor(private readonly module: WebAssembly.Module) {}

  load(law: Law): boolean {
    const energies = law.levels.length ? law.levels : [null];
    while (this.kernels.length < energies.length) this.kernels.push(new Kernel(this.module));
    this.law = law;
    return energies.every((energy, i) => {
      const numbers = [...law.numbers];
      if (energy !== null) {
        numbers[AT.fractureEnergy] = energy;
        numbers[AT.kappa] = 1;
      }
      return this.kernels[i].load(law.tables, numbers);
    });
  }

  torque(openings: Float32Array, rate: number, contact: number): Float32Array {
    const law = this.law;
    const count = law && law.mean && law.levels.length > 1 ? law.levels.length : 1;
    const each = this.kernels.slice(0, count).map((kernel) => kernel.settled(openings, rate, contact));
    if (count === 1 || !law || !law.mean) return each[0];
    const [lowest, highest] = [law.levels[0], law.levels[count - 1]];
    return openings.map((opening, i) => {
      const energy = heldValue(law.mean as Table, opening);
      const place = Math.min(Math.max(((energy - lowest) / (highest - lowest)) * (count - 1), 0), count - 1);
      const below = Math.min(Math.floor(place), count - 2);
      return each[below][i] + (place - below) * (each[below + 1][i] - each[below][i]);
    });
  }
}

/** Nearest place (m from the pivot) beyond which open blades stand above the sheet; the tip's where they do nowhere. */
export function freeFrom(scene: Scene, law: Law): number {
  const beta = scene.opening_rad[1] / scene.moving_blades;
  const [sine, cosine, length] = [Math.sin(beta), Math.cos(beta), bladeLength(law)];
  let free = length * cosine;
  for (let i = PLACES; i >= 0; i--) {
    const s = (length * i) / PLACES;
    const e = heldValue(law.tables.edge, s);
    if (s * sine + e * cosine < scene.upper_face_m) break;
    free = s * cosine - e * sine;
  }
  return free;
}

/** Length of the blades, m. */
export function bladeLength(law: Law): number {
  return law.numbers[AT.tipStation];
}

/** Value of a piecewise cubic table, held beyond its ends. */
export function heldValue(table: Table, at: number): number {
  const { x, y, slope } = table;
  const last = x.length - 1;
  if (at <= x[0]) return y[0];
  if (at >= x[last]) return y[last];
  let i = 0;
  while (x[i + 1] < at) i++;
  const width = x[i + 1] - x[i];
  const t = (at - x[i]) / width;
  const rise = y[i + 1] - y[i];
  const [first, end] = [slope[i] * width, slope[i + 1] * width];
  return y[i] + t * (first + t * (3 * rise - 2 * first - end + t * (first + end - 2 * rise)));
}

/** A table from its three rows, one after the other. */
export function tableOf(rows: Float32Array): Table {
  const size = rows.length / 3;
  return { x: rows.slice(0, size), y: rows.slice(size, 2 * size), slope: rows.slice(2 * size) };
}

function copied(law: Law): Law {
  const tables: Tables = {};
  for (const [name, { x, y, slope }] of Object.entries(law.tables)) {
    tables[name] = { x, y: y.slice(), slope: slope.slice() };
  }
  const mean = law.mean && { ...law.mean, y: law.mean.y.slice() };
  return { tables, numbers: [...law.numbers], mean, levels: [...law.levels] };
}

function flat(table: Table): Table {
  return { x: table.x, y: table.y.map(() => 0), slope: table.slope.map(() => 0) };
}

interface Place {
  below: number;
  share: number;
}

/** Between which nodes a value lies, and how far from the lower one. */
function placeIn(nodes: Float32Array, value: number): Place {
  const last = nodes.length - 1;
  let below = 0;
  while (below < last - 1 && nodes[below + 1] <= value) below++;
  const width = nodes[below + 1] - nodes[below];
  return { below, share: Math.min(Math.max((value - nodes[below]) / width, 0), 1) };
}

/** Add what the rows at a place differ from the fitted law's. */
function change(law: Law, centre: Rows, rows: Rows, at: Place): void {
  for (const [name, packed] of Object.entries(rows.tables)) {
    const table = name === "mean_energy" ? law.mean : law.tables[name];
    if (!table) continue;
    const [values, own] = [unpack(packed), unpack(centre.tables[name])];
    const size = table.x.length;
    for (let i = 0; i < size; i++) {
      table.y[i] += between(values, own.length, at, i) - own[i];
      if (name !== "mean_energy") {
        table.slope[i] += between(values, own.length, at, size + i) - own[size + i];
      }
    }
  }
  const named = [
    ["fracture_energy", AT.fractureEnergy], ["kappa", AT.kappa], ["rate_damping", AT.rateDamping],
  ] as const;
  for (const [name, place] of named) {
    law.numbers[place] += between(unpack(rows[name]), 1, at, 0) - unpack(centre[name])[0];
  }
}

function between(values: Float32Array, stride: number, at: Place, index: number): number {
  const low = values[at.below * stride + index];
  if (at.share === 0) return low;
  return low + at.share * (values[(at.below + 1) * stride + index] - low);
}

/** What added differences may have broken: a response that falls, an energy below 0, the levels. */
function settledLaw(law: Law, fitted: Law): Law {
  rising(law.tables.response);
  law.numbers[AT.fractureEnergy] = Math.max(law.numbers[AT.fractureEnergy], 0);
  law.numbers[AT.kappa] = Math.min(Math.max(law.numbers[AT.kappa], 1e-3), 1);
  law.numbers[AT.rateDamping] = Math.max(law.numbers[AT.rateDamping], 0);
  for (const name of ["friction_opening", "friction_closing", "friction_angle"]) {
    law.tables[name].y.forEach((value, i, all) => (all[i] = Math.max(value, 0)));
  }
  if (law.mean && fitted.mean) {
    const lowest = Math.max(Math.min(...law.mean.y), 0);
    const highest = Math.max(...law.mean.y);
    const count = highest - lowest <= EVEN * highest ? 1 : LEVELS;
    law.levels = Array.from({ length: count }, (_, i) => lowest + ((highest - lowest) * i) / Math.max(count - 1, 1));
  }
  return law;
}

/** A cubic that never falls: values ascend, slopes are at most three chords (Fritsch, Carlson 1980). */
function rising({ x, y, slope }: Table): void {
  for (let i = 1; i < x.length; i++) y[i] = Math.max(y[i], y[i - 1]);
  for (let i = 0; i < x.length; i++) {
    const before = i > 0 ? (y[i] - y[i - 1]) / (x[i] - x[i - 1]) : Infinity;
    const after = i < x.length - 1 ? (y[i + 1] - y[i]) / (x[i + 1] - x[i]) : Infinity;
    slope[i] = Math.min(Math.max(slope[i], 0), 3 * Math.min(before, after));
  }
}

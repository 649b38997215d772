// What the page is told (scissorcal/prototype/scene.py), with its arrays decoded.

import { Piece } from "./pieces";

export interface Packed {
  shape: number[];
  base64: string;
}

export interface Rows {
  tables: Record<string, Packed>;
  fracture_energy: Packed;
  kappa: Packed;
  rate_damping: Packed;
}

export interface Slider {
  name: string;
  /** Its place among the values of a draw. */
  column: number;
  meaning: string;
  unit: string;
  scale: number;
  value: number;
  sd: number;
  q05: number;
  q95: number;
  nodes: Packed;
  rows: Rows;
}

export interface Band {
  rate: number;
  /** With friction; else of the material alone, as measured strokes are. */
  friction: boolean;
  opening: Packed;
  contact: Packed;
  low: Packed;
  high: Packed;
}

export interface Stroke {
  recording: string;
  kind: "closing" | "opening";
  opening: Packed;
  contact: Packed;
  torque: Packed;
}

export interface Hand {
  name: string;
  time: Packed;
  opening: Packed;
  advance: Packed;
}

export interface PlatePose {
  position_m: [number, number, number];
  rotation_vector_rad: [number, number, number];
}

/** Closed contours in mm; inside is what lies within an odd number of them. */
export type Contours = [number, number][][];

export interface DrawnPlate {
  cut_line_mm: number;
  layers: {
    name: string;
    thickness_mm: number;
    toughness_ratio: number;
    outline: Contours;
    holes: Contours[];
    regions: { toughness_ratio: number; outline: Contours }[];
  }[];
}

export interface Scene {
  format: string;
  name: string;
  made_utc: string;
  version: string;
  states: { label: string; sentence: string }[];
  bound_Nm: number;
  torque_limit_Nm: number;
  opening_rad: [number, number];
  opening_rate_rad_per_s: [number, number];
  contact_m: [number, number];
  loop_rate_Hz: number;
  handle_radius_m: number;
  blade_length_m: number;
  upper_face_m: number;
  moving_blades: number;
  tables: Record<string, Packed>;
  numbers: number[];
  mean_energy: Packed | null;
  levels: number[];
  centre: Rows;
  sliders: Slider[];
  draws: { values: Packed; rows: Rows } | null;
  bands: Band[];
  strokes: Stroke[];
  hands: Hand[];
  /** The plate along the cut; null where it is a uniform sheet. */
  pieces: Piece[] | null;
  /** Text of the recipe that the package was built from, where it is known. */
  recipe?: string | null;
  /** The plate whose outlines stand in files beside that recipe. */
  drawn_plate?: DrawnPlate | null;
  /** Where the plate stands in the frame of the pivot, where a pose is known. */
  plate_pose?: PlatePose | null;
  /** The next command of the workspace; "" where it has none or is not known. */
  next_step?: string;
}

const FORMAT = "scissorcal-prototype/1";

export function readScene(text: string): Scene {
  const scene = JSON.parse(text) as Scene;
  if (scene.format !== FORMAT) {
    throw new Error(`This page shows ${FORMAT}, and was given ${String(scene.format)}.`);
  }
  return scene;
}

export function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

const unpacked = new WeakMap<Packed, Float32Array>();

/** The numbers of a packed array, row by row; always the same array, so not to be written to. */
export function unpack(packed: Packed): Float32Array {
  let found = unpacked.get(packed);
  if (!found) {
    found = new Float32Array(bytesOf(packed.base64).buffer);
    unpacked.set(packed, found);
  }
  return found;
}

// Values of a TOML file: read with a sentence where they are none of those wanted, and written.

import { TomlTableWithoutBigInt } from "smol-toml";
import { Outline, Point } from "./outline";

const POINTS_OF_A_LINE = 8;

export type Toml = TomlTableWithoutBigInt;

export function table(value: unknown, place: string): Toml {
  if (typeof value !== "object" || value === null || Array.isArray(value)) throw new Error(`${place} must be a table.`);
  return value as Toml;
}

export function list(value: unknown, place: string): unknown[] {
  if (!Array.isArray(value)) throw new Error(`${place} must be a list.`);
  return value;
}

export function numberOf(value: unknown, place: string): number {
  if (typeof value !== "number" || !Number.isFinite(value)) throw new Error(`${place} must be a number.`);
  return value;
}

export function positive(value: unknown, place: string): number {
  const number = numberOf(value, place);
  if (number <= 0) throw new Error(`${place} must be above 0.`);
  return number;
}

/** Points in square brackets, each number as `text` has it. */
export function pointsText(outline: Outline, text = shown): string {
  const points = outline.map(([x, y]) => `[${text(x)}, ${text(y)}]`);
  const lines: string[] = [];
  for (let i = 0; i < points.length; i += POINTS_OF_A_LINE) lines.push(points.slice(i, i + POINTS_OF_A_LINE).join(", "));
  return lines.length === 1 ? `[${lines[0]}]` : `[\n  ${lines.join(",\n  ")},\n]`;
}

/** Any number so that it is read back as it is. */
export function exact(value: number): string {
  return String(value + 0);
}

export function shown(value: number): string {
  return String(Number(value.toFixed(6)) + 0);
}

export function quoted(text: string): string {
  return JSON.stringify(text).replaceAll("\u007f", "\\u007f");
}

/** Pairs of numbers. */
export function pointsOf(value: unknown, place: string): Outline {
  return list(value, place).map((one): Point => {
    const pair = list(one, place);
    if (pair.length !== 2) throw new Error(`${place} has a point that is not [x, y].`);
    return [numberOf(pair[0], place), numberOf(pair[1], place)];
  });
}

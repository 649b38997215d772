// Which elements of an SVG file are shown shapes; what is not understood is refused by its name.
// As recipe/svg/elements.py, with the same names.

import lists from "../../../recipe/svg/names.json";

const NAMESPACE = "http://www.w3.org/2000/svg";
const LOOKS = words(lists.looks);
const LOOKS_BEGIN = lists.looks_begin.split(" ");
const NOTHING = words(lists.may_be_none);
const PASSED_OVER = words(lists.passed_over);
const CONTAINERS = words(lists.containers);
const HIDING = lists.hiding as Record<string, string | undefined>;
const SHAPES = lists.shapes as Record<string, string | undefined>;
const ANYWHERE = lists.refused_anywhere as Record<string, string | undefined>;
const WHERE_SHOWN = lists.refused_where_shown as Record<string, string | undefined>;
const VENDOR = /-(webkit|moz|ms|o)-/;
const ASIDE = /\/\*.*?(?:\*\/|$)|"[^"\n]*"|'[^'\n]*'|url\([^)]*(?:\)|$)/gis;

/** A shape with the transform of its style, and of those around it, from the outermost inward. */
export interface Shown {
  element: SVGGeometryElement;
  matrix: DOMMatrix;
}

/** What is shown of a file, in its order. Raises Error, of words that begin with "it has". */
export function shownShapes(page: Document): Shown[] {
  const found: Shown[] = [];
  for (const node of page.childNodes) {
    if (node.nodeName === "xml-stylesheet") throw new Error(`it refers to a style sheet (${node.nodeValue?.slice(0, 60)}): save it as plain SVG`);
  }
  visit(page.documentElement, new DOMMatrix(), "", true, found);
  return found;
}

function visit(element: Element, outer: DOMMatrix, around: string, isOuterShown: boolean, found: Shown[]): void {
  const [tag, isRoot] = [element.localName, !element.parentElement];
  if (has(ANYWHERE, tag)) throw new Error(ANYWHERE[tag]);
  for (const { localName, value } of element.attributes) refuseAnywhere(localName, value);
  if (tag === "style") refuseStyleSheet(element.textContent ?? "");
  let [isShown, visibility, matrix] = [isOuterShown && element.namespaceURI === NAMESPACE && !PASSED_OVER.has(tag), around, outer];
  if (isShown) {
    if (has(WHERE_SHOWN, tag) && !isRoot) throw new Error(WHERE_SHOWN[tag]);
    const own = new Map([...element.attributes].filter((one) => !one.prefix && one.name !== "xmlns").map((one) => [one.name, one.value]));
    const style = styleProperties(own.get("style") ?? "");
    const said = (key: string): string => {
      const value = (style.get(key) ?? own.get(key) ?? "").trim().toLowerCase();
      return value === "inherit" ? "" : value;
    };
    isShown = said("display") !== "none";
    visibility = said("visibility") || around;
    const isUnseen = has(SHAPES, tag) && ["hidden", "collapse"].includes(visibility);
    if (isShown && !isUnseen) {
      if (!has(SHAPES, tag) && !CONTAINERS.has(tag)) throw new Error(`it has <${tag.slice(0, 40)}>, which is not read: remove it`);
      refuseAttributes(tag, own, isRoot);
      if (isRoot && (style.get("transform") ?? "none").toLowerCase() !== "none") throw new Error("it has transform in a style of its root: apply the transforms to the shapes");
      matrix = outer.multiply(transformOf(element as SVGGraphicsElement, style.get("transform")));
      if (has(SHAPES, tag)) found.push({ element: element as SVGGeometryElement, matrix });
    }
  }
  for (const child of element.children) visit(child, matrix, visibility, isShown, found);
}

/** The transform of one element, of its style or else of its attribute. */
function transformOf(element: SVGGraphicsElement, styled: string | undefined): DOMMatrix {
  const text = (styled ?? element.getAttribute("transform") ?? "").trim();
  const refused = new Error(`its transform="${text.slice(0, 60)}" is not understood: save it as plain SVG, transforms applied to the shapes`);
  if (!text || text === "none") return new DOMMatrix();
  if (styled === undefined) {
    const list = element.transform.baseVal;
    const own = list.numberOfItems ? list.consolidate()?.matrix : undefined;
    if (!own) throw refused;
    return new DOMMatrix([own.a, own.b, own.c, own.d, own.e, own.f]);
  }
  let matrix: DOMMatrix;
  try {
    matrix = new DOMMatrix(text);
  } catch {
    throw refused;
  }
  if (!matrix.is2D) throw refused;
  return matrix;
}

function refuseAnywhere(key: string, value: string): void {
  if (key.toLowerCase() === "href" && !/^(#|data:image\/)/.test(value)) throw new Error(`it refers to another file (${value.slice(0, 60)}): embed or remove it`);
  if (key.toLowerCase().startsWith("on")) throw new Error(`it has a script (${key.slice(0, 60)}): save it as plain SVG`);
}

function refuseAttributes(tag: string, own: Map<string, string>, isRoot: boolean): void {
  const ofTag = SHAPES[tag] ?? (isRoot ? lists.root_attributes : tag === "a" ? lists.link_attributes : "");
  const known = words(`${ofTag} ${lists.any_attributes}`);
  for (const [key, value] of own) {
    if (key === "transform" && isRoot) throw new Error("it has transform as an attribute of its root: apply the transforms to the shapes");
    if (!known.has(key) && !/^(data|aria)-/.test(key)) refuseProperty(key, value, `as an attribute of <${tag}>`);
  }
}

/** Properties of a style attribute that place or hide a shape. */
function styleProperties(style: string): Map<string, string> {
  const found = new Map<string, string>();
  for (const [key, value] of declarations(style, "in a style")) {
    if (["display", "visibility", "transform"].includes(key)) {
      if (found.has(key)) throw new Error(`it has ${key} twice in a style: keep one`);
      found.set(key, value);
    }
    if (key !== "transform") refuseProperty(key, value, "in a style");
  }
  return found;
}

function refuseStyleSheet(text: string): void {
  for (const [key, value] of declarations(text, "in a <style>")) {
    if (has(HIDING, key)) throw refusal(key, "in a <style>");
    refuseProperty(key, value, "in a <style>");
  }
}

/** Properties, in lower case, with their values; of a sheet those of all its rules. */
function declarations(text: string, where: string): [string, string][] {
  if (text.includes("\\")) throw new Error(`it has an escape (\\) ${where}: save it as plain SVG`);
  const plain = text.replace(ASIDE, (one) => (one.startsWith("/*") ? " " : "_"));
  if (/["']/.test(plain)) throw new Error(`it has a quote that is not closed ${where}: save it as plain SVG`);
  const found: [string, string][] = [];
  for (const [, statement, end] of plain.matchAll(/([^{};]*)([{};]|$)/g)) {
    const said = statement.trim();
    if (said.slice(0, 7).toLowerCase() === "@import") throw new Error("it refers to another file (@import): embed or remove it");
    const colon = said.indexOf(":");
    if (end !== "{" && colon >= 0) found.push([said.slice(0, colon).trim().toLowerCase(), said.slice(colon + 1).split("!")[0].trim()]);
  }
  return found;
}

function refuseProperty(key: string, value: string, where: string): void {
  const [bare, said] = [key.replace(VENDOR, ""), value.trim().toLowerCase()];
  if (LOOKS.has(bare) || LOOKS_BEGIN.some((begin) => bare.startsWith(begin)) || (said === "none" && NOTHING.has(bare))) return;
  if (has(HIDING, key) && (!said || words(HIDING[key] ?? "").has(said))) return;
  throw refusal(key, where);
}

function refusal(key: string, where: string): Error {
  const bare = key.replace(VENDOR, "");
  const remedy = lists.remedies.find(([names]) => new RegExp(`^(?:${names})$`).test(bare))?.[1];
  return new Error(`it has ${key.slice(0, 40)} ${where}, which is not read: ${remedy ?? `remove ${key.slice(0, 40)}`}`);
}

function has(table: Record<string, unknown>, key: string): boolean {
  return Object.hasOwn(table, key);
}

function words(text: string): Set<string> {
  return new Set(text.split(" ").filter(Boolean));
}

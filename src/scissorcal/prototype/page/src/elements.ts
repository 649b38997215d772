// Elements of the page, made without markup: text stays text.

type Child = Node | string | null;
type Attributes = Record<string, string | number | boolean | null | ((event: Event) => void)>;

/** An HTML element; functions listen to the event of their name, false and null leave a thing out. */
export function html<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[Tag] {
  return filled(document.createElement(tag), attributes, children);
}

export function svg<Tag extends keyof SVGElementTagNameMap>(
  tag: Tag, attributes: Attributes = {}, ...children: Child[]
): SVGElementTagNameMap[Tag] {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

function filled<Kind extends Element>(element: Kind, attributes: Attributes, children: Child[]): Kind {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") listen(element, name, value);
    else if (value !== false && value !== null) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null));
  return element;
}

/** What an element does at its events, so that `refilled` can give it another thing to do. */
const listeners = new WeakMap<Element, Map<string, (event: Event) => void>>();

function listen(element: Element, name: string, does: (event: Event) => void): void {
  const own = listeners.get(element) ?? new Map<string, (event: Event) => void>();
  listeners.set(element, own);
  if (!own.has(name)) element.addEventListener(name, (event) => own.get(name)?.(event));
  own.set(name, does);
}

/** A labelled number; `changed` gets finite values within the bounds only. */
export function numberField(
  label: string, value: number,
  options: { key: string; unit?: string; least?: number; most?: number; hideLabel?: boolean },
  changed: (value: number) => void,
): HTMLLabelElement {
  const input = html("input", {
    type: "number", step: "any", value: String(Number(value.toFixed(4))), "data-key": options.key,
    min: options.least ?? null, max: options.most ?? null, inputmode: "decimal",
    "aria-label": options.unit ? `${label}, ${options.unit}` : label,
    change: (event) => {
      const input = event.currentTarget as HTMLInputElement;
      const typed = input.valueAsNumber;
      const isWithin = Number.isFinite(typed) && input.checkValidity();
      if (isWithin) changed(typed);
      else input.value = String(value);
    },
  });
  return html("label", { class: "field" }, options.hideLabel ? null : `${label} `, input, options.unit && !options.hideLabel ? ` ${options.unit}` : null);
}

/**
 * Put other children into an element, but leave what has the focus in its place, with what is typed and
 * selected in it: it only gets the attributes and listeners of its successor, the element with the
 * same data-key. Where that is gone or disabled, its like of the number before gets the focus, else the
 * nearest of its kind. Listeners take their element from the event.
 */
export function refilled(element: HTMLElement, ...children: Child[]): void {
  const active = document.activeElement;
  const focused = active instanceof HTMLElement && element.contains(active) && active.dataset.key !== undefined ? active : null;
  const keys = focused ? keysNear(element, focused) : [];
  const fresh = html("div", {}, ...children);
  const next = focused ? enabled(fresh, keys[0]) : null;
  if (focused && next) return renew(element, fresh, focused, next);
  element.replaceChildren(...fresh.childNodes);
  for (const key of keys) {
    const found = enabled(element, key);
    if (found) return found.focus();
  }
}

function enabled(element: HTMLElement, key: string): HTMLElement | null {
  return element.querySelector<HTMLElement>(`[data-key="${CSS.escape(key)}"]:not(:disabled)`);
}

/** Keys where the focus may go from an element, the best first: buttons from a button, fields from a field. */
function keysNear(element: HTMLElement, active: HTMLElement): string[] {
  const all = [...element.querySelectorAll<HTMLElement>("[data-key]")];
  const at = all.indexOf(active);
  const near = [...all.slice(0, at).reverse(), ...all.slice(at + 1)];
  const alike = near.filter((one) => one.tagName === active.tagName);
  const key = active.dataset.key as string;
  const before = key.replace(/\d+$/, (number) => String(Number(number) - 1));
  return [key, before, ...[...alike, ...near].map((one) => one.dataset.key as string)];
}

/** Children of `fresh` in the place of those of `old`, but on the way to `focused`, which stays for `next`. */
function renew(old: Element, fresh: Element, focused: HTMLElement, next: HTMLElement): void {
  const kept = [...old.children].find((child) => child.contains(focused));
  const other = [...fresh.children].find((child) => child.contains(next));
  if (!kept || !other || kept.tagName !== other.tagName || (kept === focused) !== (other === next)) {
    old.replaceChildren(...fresh.childNodes);
    if (old.contains(next)) next.focus();
    return;
  }
  const nodes = [...fresh.childNodes];
  const place = nodes.indexOf(other);
  while (kept.previousSibling) kept.previousSibling.remove();
  while (kept.nextSibling) kept.nextSibling.remove();
  kept.before(...nodes.slice(0, place));
  kept.after(...nodes.slice(place + 1));
  succeed(kept, other);
  if (kept !== focused) return renew(kept, other, focused, next);
  if (kept.innerHTML !== other.innerHTML) kept.replaceChildren(...other.childNodes);
  if (other instanceof HTMLSelectElement) (kept as HTMLSelectElement).value = other.value;
}

/** Attributes and listeners of a successor; what is typed and not yet taken stays as it is. */
function succeed(kept: Element, other: Element): void {
  const isTyped = kept instanceof HTMLInputElement && kept.type !== "range" && kept.value !== kept.defaultValue;
  for (const { name } of [...kept.attributes]) if (!other.hasAttribute(name)) kept.removeAttribute(name);
  for (const { name, value } of other.attributes) if (kept.getAttribute(name) !== value) kept.setAttribute(name, value);
  if (other instanceof HTMLInputElement && kept instanceof HTMLInputElement) {
    kept.checked = other.checked;
    if (!isTyped && kept.value !== other.value) kept.value = other.value;
  }
  const [own, others] = [listeners.get(kept), listeners.get(other)];
  for (const name of own?.keys() ?? []) if (!others?.has(name)) own?.delete(name);
  for (const [name, does] of others ?? []) listen(kept, name, does);
}

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
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value !== false && value !== null) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null));
  return element;
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
    change: () => {
      const typed = input.valueAsNumber;
      const isWithin = Number.isFinite(typed) && input.checkValidity();
      if (isWithin) changed(typed);
      else input.value = String(value);
    },
  });
  return html("label", { class: "field" }, options.hideLabel ? null : `${label} `, input, options.unit && !options.hideLabel ? ` ${options.unit}` : null);
}

/**
 * Put other children into an element; what had the focus has it again, by its data-key. Where that is
 * gone or disabled, its like of the number before takes its place, else the nearest of its kind.
 */
export function refilled(element: HTMLElement, ...children: Child[]): void {
  const active = document.activeElement;
  const isIn = active instanceof HTMLElement && element.contains(active) && active.dataset.key !== undefined;
  const keys = isIn ? keysNear(element, active) : [];
  element.replaceChildren(...children.filter((child): child is Node | string => child !== null));
  for (const key of keys) {
    const found = element.querySelector<HTMLElement>(`[data-key="${CSS.escape(key)}"]:not(:disabled)`);
    if (found) return found.focus();
  }
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

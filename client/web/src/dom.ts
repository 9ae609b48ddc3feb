// The elements of the page.

// An element of index.html by its id. Throws if there is none: a defect of the page.
export function element<T extends Element = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`index.html has no #${id}`);
  return found as Element as T;
}

export const input = (id: string): HTMLInputElement => element<HTMLInputElement>(id);

export function onClick(id: string, run: () => void): void {
  element(id).addEventListener('click', run);
}

// Leaves equal text alone: a screen reader would announce it again.
export function setText(target: Element, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

type Tags = HTMLElementTagNameMap;

export function createSvg<T extends keyof SVGElementTagNameMap>(tag: T, attributes: Record<string, string>): SVGElementTagNameMap[T] {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

// A new element with these properties and children.
export function create<T extends keyof Tags>(tag: T, properties: Partial<Tags[T]>, ...children: (Node | string)[]): Tags[T] {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

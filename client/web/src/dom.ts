// Elements of index.html by their ids. Throws if there is none: a defect of the page.
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`index.html has no #${id}`);
  return found as T;
}

export const input = (id: string): HTMLInputElement => element<HTMLInputElement>(id);

export function onClick(id: string, run: () => void): void {
  element(id).addEventListener('click', run);
}

// Leaves equal text alone: a screen reader would announce it again.
export function setText(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

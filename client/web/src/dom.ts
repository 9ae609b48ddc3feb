// Elements of index.html by their ids. One that is missing is our own bug.
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`index.html has no #${id}`);
  return found as T;
}

export const input = (id: string): HTMLInputElement => element<HTMLInputElement>(id);

export function onClick(id: string, run: () => void): void {
  element(id).addEventListener('click', run);
}

// Changes text only where it differs, or a screen reader says it again.
export function setText(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

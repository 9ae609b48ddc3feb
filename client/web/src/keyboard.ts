// The keyboard. Letters work everywhere except in text fields; arrows, plus and minus only while the canvas has focus.
import { orbited, panned, zoomed } from '../package/src/camera';
import { create } from './dom';
import type { Viewer } from './viewer';

export interface Command {
  key: string; // upper case
  description: string; // for the help
  run: () => void;
}

const kRotateStep = Math.PI / 24; // radians
const kPanStep = 40; // pixels
const kZoomStep = 1.15; // factor
const kArrows: Record<string, [right: number, up: number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
const kZooms: Record<string, number> = { '+': 1 / kZoomStep, '=': 1 / kZoomStep, '-': kZoomStep, _: kZoomStep };

const isShortcut = (event: KeyboardEvent): boolean => event.ctrlKey || event.metaKey || event.altKey; // of the browser

// Calls `move` for each press of an arrow key, with -1, 0 or 1 steps.
export function watchArrows(target: HTMLElement, move: (right: number, up: number, withShift: boolean) => void): void {
  target.addEventListener('keydown', (event) => {
    const arrow = kArrows[event.key];
    if (!arrow || isShortcut(event)) return;
    event.preventDefault();
    move(...arrow, event.shiftKey);
  });
}

export function watchKeys(canvas: HTMLElement, viewer: Viewer, commands: Command[]): void {
  watchArrows(canvas, (right, up, withShift) =>
    viewer.move((pose, _, height) =>
      withShift
        ? panned(pose, right * kPanStep, -up * kPanStep, height)
        : orbited(pose, right * kRotateStep, -up * kRotateStep),
    ),
  );
  canvas.addEventListener('keydown', (event) => {
    const factor = kZooms[event.key];
    if (!factor || isShortcut(event)) return;
    event.preventDefault();
    viewer.move((pose, _, height) => zoomed(pose, factor, [0, 0], height));
  });
  document.addEventListener('keydown', (event) => {
    if (isShortcut(event) || event.repeat || document.querySelector('dialog[open]')) return;
    if (event.target instanceof HTMLInputElement && ['password', 'number', 'text'].includes(event.target.type)) return;
    const key = event.key === '?' ? 'H' : event.key.toUpperCase();
    const command = commands.find((one) => one.key === key);
    if (!command) return;
    event.preventDefault();
    command.run();
  });
}

// Fills the help's list of keys.
export function listKeys(list: HTMLElement, commands: Command[]): void {
  const rows: [string[], string][] = [
    [['←', '→', '↑', '↓'], 'Rotate'],
    [['Shift', '←', '→', '↑', '↓'], 'Pan'],
    [['+', '−'], 'Zoom'],
    ...commands.map(({ key, description }): [string[], string] => [[key], description]),
    [['Tab'], 'Next control or handle'],
  ];
  for (const [keys, description] of rows) {
    list.append(create('dt', {}, ...keys.map((key) => create('kbd', {}, key))), create('dd', {}, description));
  }
}

// Keys. Letters work wherever one is, but where text is typed; arrows, plus and minus only on the picture.
import { orbited, panned, type Pose, zoomed } from './camera';
import type { Movable } from './pointer';

export interface Command {
  key: string; // upper case
  does: string; // for people
  run: () => void;
}

const kStep = Math.PI / 24;
const kStepPixels = 40;
const kZoomStep = 1.15;

const kMoves: Record<string, { plain: (pose: Pose) => Pose; shifted: (pose: Pose, height: number) => Pose }> = {
  ArrowLeft: { plain: (pose) => orbited(pose, -kStep, 0), shifted: (pose, height) => panned(pose, -kStepPixels, 0, height) },
  ArrowRight: { plain: (pose) => orbited(pose, kStep, 0), shifted: (pose, height) => panned(pose, kStepPixels, 0, height) },
  ArrowUp: { plain: (pose) => orbited(pose, 0, -kStep), shifted: (pose, height) => panned(pose, 0, -kStepPixels, height) },
  ArrowDown: { plain: (pose) => orbited(pose, 0, kStep), shifted: (pose, height) => panned(pose, 0, kStepPixels, height) },
};

export function watchKeys(canvas: HTMLCanvasElement, movable: Movable, commands: Command[]): void {
  const zoom = (factor: number) => (pose: Pose, height: number) => zoomed(pose, factor, [0, 0], height);

  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = kMoves[event.key];
    const change = arrow
      ? event.shiftKey
        ? arrow.shifted
        : arrow.plain
      : event.key === '+' || event.key === '='
        ? zoom(1 / kZoomStep)
        : event.key === '-' || event.key === '_'
          ? zoom(kZoomStep)
          : null;
    const pose = movable.pose();
    if (!change || !pose) return;
    event.preventDefault();
    movable.move(change(pose, canvas.clientHeight));
  });

  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || document.querySelector('dialog[open]')) return;
    if (event.target instanceof HTMLInputElement && ['password', 'number', 'text'].includes(event.target.type)) return;
    const key = event.key === '?' ? 'H' : event.key.toUpperCase();
    const command = commands.find((one) => one.key === key);
    if (!command) return;
    event.preventDefault();
    command.run();
  });
}

// The list of all keys, for the help.
export function listKeys(list: HTMLElement, commands: Command[]): void {
  const rows: [string[], string][] = [
    [['←', '→', '↑', '↓'], 'Turn'],
    [['Shift', '←', '→', '↑', '↓'], 'Move'],
    [['+', '−'], 'Zoom'],
    ...commands.map(({ key, does }): [string[], string] => [[key], does]),
    [['Tab'], 'To the next control or handle'],
  ];
  for (const [keys, does] of rows) {
    const term = document.createElement('dt');
    term.append(...keys.map((key) => Object.assign(document.createElement('kbd'), { textContent: key })));
    list.append(term, Object.assign(document.createElement('dd'), { textContent: does }));
  }
}

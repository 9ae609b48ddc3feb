// The keyboard. Letters work everywhere except in text fields; arrows, plus and minus only while the canvas has focus.
import { orbited, panned, type Pose, zoomed } from './camera';
import type { CameraController } from './pointer';

export interface Command {
  key: string; // upper case
  description: string; // for the help
  run: () => void;
}

const kRotateStep = Math.PI / 24; // radians
const kPanStep = 40; // pixels
const kZoomStep = 1.15; // factor

const kMoves: Record<string, { plain: (pose: Pose) => Pose; shifted: (pose: Pose, height: number) => Pose }> = {
  ArrowLeft: { plain: (pose) => orbited(pose, -kRotateStep, 0), shifted: (pose, height) => panned(pose, -kPanStep, 0, height) },
  ArrowRight: { plain: (pose) => orbited(pose, kRotateStep, 0), shifted: (pose, height) => panned(pose, kPanStep, 0, height) },
  ArrowUp: { plain: (pose) => orbited(pose, 0, -kRotateStep), shifted: (pose, height) => panned(pose, 0, -kPanStep, height) },
  ArrowDown: { plain: (pose) => orbited(pose, 0, kRotateStep), shifted: (pose, height) => panned(pose, 0, kPanStep, height) },
};

export function watchKeys(canvas: HTMLCanvasElement, controller: CameraController, commands: Command[]): void {
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
    const pose = controller.pose();
    if (!change || !pose) return;
    event.preventDefault();
    controller.move(change(pose, canvas.clientHeight));
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
    const term = document.createElement('dt');
    term.append(...keys.map((key) => Object.assign(document.createElement('kbd'), { textContent: key })));
    list.append(term, Object.assign(document.createElement('dd'), { textContent: description }));
  }
}

// Mouse, pen and touch on the canvas: rotate, pan, zoom, roll.
import { orbited, panned, type Pose, rolled, zoomed } from './camera.js';
import { clamp } from './vec.js';

const kRotation = Math.PI; // radians, for a drag across the canvas's shorter side
const kWheel = 0.0016; // natural logarithm of the zoom factor, per pixel of the wheel

export interface Moved {
  move(make: (pose: Pose, width: number, height: number) => Pose): void; // from where the camera is, and the size of the canvas, CSS pixels
  centerOn?(x: number, y: number): void; // makes what is drawn there, CSS pixels of the canvas, the centre of rotation
}

export function watchPointers(canvas: HTMLCanvasElement, viewer: Moved): void {
  const down = new Map<number, { x: number; y: number }>();

  const fromCenter = (x: number, y: number): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [x - box.left - box.width / 2, y - box.top - box.height / 2];
  };

  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.classList.add('moving');
  });

  canvas.addEventListener('pointermove', (event) => {
    const last = down.get(event.pointerId);
    if (!last) return;
    const now = { x: event.clientX, y: event.clientY };
    const [dx, dy] = [now.x - last.x, now.y - last.y];
    if (down.size === 1) {
      const pans = event.shiftKey || (event.buttons & 6) !== 0;
      viewer.move((pose, width, height) => {
        const angle = kRotation / Math.min(width, height);
        return pans ? panned(pose, dx, dy, height) : orbited(pose, dx * angle, dy * angle);
      });
    } else if (down.size === 2) {
      const other = [...down].find(([id]) => id !== event.pointerId)![1];
      const before = [last.x - other.x, last.y - other.y] as const;
      const after = [now.x - other.x, now.y - other.y] as const;
      const factor = Math.hypot(...before) / Math.max(1, Math.hypot(...after));
      const angle = Math.atan2(after[1], after[0]) - Math.atan2(before[1], before[0]);
      const at = fromCenter((now.x + other.x) / 2, (now.y + other.y) / 2);
      const wrapped = Math.atan2(Math.sin(angle), Math.cos(angle)); // to (-π, π]
      viewer.move((pose, _, height) => {
        const moved = panned(pose, dx / 2, dy / 2, height);
        return rolled(zoomed(moved, factor, at, height), wrapped);
      });
    }
    down.set(event.pointerId, now);
  });

  const up = (event: PointerEvent) => {
    down.delete(event.pointerId);
    if (down.size === 0) canvas.classList.remove('moving');
  };
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', up);
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());

  const zoom = (event: WheelEvent) => {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1) * (event.ctrlKey ? 5 : 1);
    const at = fromCenter(event.clientX, event.clientY);
    viewer.move((pose, _, height) => zoomed(pose, Math.exp(clamp(pixels, -300, 300) * kWheel), at, height));
  };
  canvas.addEventListener('wheel', zoom, { passive: false });

  canvas.addEventListener('dblclick', (event) => {
    const box = canvas.getBoundingClientRect();
    viewer.centerOn?.(event.clientX - box.left, event.clientY - box.top);
  });
}

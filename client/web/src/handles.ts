// Handles over the picture: buttons, so that they can be reached by Tab, moved by arrow keys and dragged by a finger.
import { axes, type Pose, projected, unitsPerPixel } from './camera';
import type { Vec3 } from './messages';
import { add, dot, length, scale, sub } from './vec';

export interface Handle {
  label: string;
  icon?: string; // of index.html's symbols
  at: () => Vec3 | null; // world; null: not there now
  // by: how far it was dragged in the plane of the picture, in world units at the depth of the handle, from where the drag began.
  drag: (by: Vec3, start: unknown) => void;
  begin: () => unknown; // what drag gets as start
  nudge: (right: number, up: number) => void; // by an arrow key: -1, 0 or 1; times 5 with Shift
}

export class Handles {
  private placed: { button: HTMLButtonElement; handle: Handle }[] = [];

  constructor(private layer: HTMLElement, private canvas: HTMLCanvasElement, private pose: () => Pose | null) {}

  add(handle: Handle): void {
    const button = document.createElement('button');
    button.type = 'button';
    button.className = handle.icon ? 'handle large' : 'handle';
    button.setAttribute('aria-label', handle.label);
    button.title = handle.label;
    button.hidden = true; // until it has a place
    if (handle.icon) button.append(icon(handle.icon));
    this.layer.append(button);
    this.placed.push({ button, handle });
    this.watch(button, handle);
  }

  // To be called whenever the camera or what the handles hold has changed.
  place(): void {
    const pose = this.pose();
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    for (const { button, handle } of this.placed) {
      const at = pose && handle.at();
      const spot = at ? projected(pose, at, width, height) : null;
      const inside = spot !== null && spot.depth > 0 && spot.x > -20 && spot.y > -20 && spot.x < width + 20 && spot.y < height + 20;
      if (button.hidden === inside) button.hidden = !inside;
      if (inside) button.style.translate = `${spot.x.toFixed(1)}px ${spot.y.toFixed(1)}px`;
    }
  }

  private watch(button: HTMLButtonElement, handle: Handle): void {
    let start: { x: number; y: number; what: unknown; at: Vec3 } | null = null;
    button.addEventListener('pointerdown', (event) => {
      const at = handle.at();
      if (event.button !== 0 || !at) return;
      button.setPointerCapture(event.pointerId);
      start = { x: event.clientX, y: event.clientY, what: handle.begin(), at };
    });
    button.addEventListener('pointermove', (event) => {
      const pose = this.pose();
      if (!start || !pose) return;
      const a = axes(pose);
      const depth = dot(scale(a.back, -1), sub(start.at, pose.eye)) / length(sub(pose.lookAt, pose.eye));
      const unitsHere = unitsPerPixel(pose, this.canvas.clientHeight) * depth;
      handle.drag(add(scale(a.right, (event.clientX - start.x) * unitsHere), scale(a.up, (start.y - event.clientY) * unitsHere)), start.what);
    });
    const end = () => (start = null);
    button.addEventListener('pointerup', end);
    button.addEventListener('pointercancel', end);
    button.addEventListener('keydown', (event) => {
      const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!by || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      const times = event.shiftKey ? 5 : 1;
      handle.nudge(by[0]! * times, by[1]! * times);
    });
  }
}

export function icon(name: string): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  const use = document.createElementNS('http://www.w3.org/2000/svg', 'use');
  use.setAttribute('href', `#i-${name}`);
  svg.append(use);
  return svg;
}

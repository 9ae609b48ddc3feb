// Handles over the picture. They are buttons: reached by Tab, moved by arrow keys, dragged by pointer or touch.
import { axes, type Pose, projected, unitsPerPixel } from './camera';
import type { Vec3 } from './messages';
import { add, dot, length, scale, sub } from './vec';

export interface Handle {
  label: string;
  icon?: string; // a symbol of index.html
  position: () => Vec3 | null; // world coordinates; null: hidden
  // A drag begins. Returns what follows it; by: since the drag began, in the view plane, in world units at the handle's
  // depth.
  grab: () => (by: Vec3) => void;
  nudge: (right: number, up: number) => void; // by an arrow key: -1, 0 or 1 steps; 5 with Shift
}

export class Handles {
  private items: { button: HTMLButtonElement; handle: Handle }[] = [];

  constructor(private layer: HTMLElement, private canvas: HTMLCanvasElement, private pose: () => Pose | null) {}

  add(handle: Handle): void {
    const button = document.createElement('button');
    button.type = 'button';
    button.className = handle.icon ? 'handle large' : 'handle';
    button.setAttribute('aria-label', handle.label);
    button.title = handle.label;
    button.hidden = true; // until place()
    if (handle.icon) button.append(icon(handle.icon));
    this.layer.append(button);
    this.items.push({ button, handle });
    this.watch(button, handle);
  }

  // Positions the buttons. To be called whenever the camera or the position of a handle has changed.
  place(): void {
    const pose = this.pose();
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    for (const { button, handle } of this.items) {
      const position = pose && handle.position();
      const at = position ? projected(pose, position, width, height) : null;
      const isVisible = at !== null && at.depth > 0 && at.x > -20 && at.y > -20 && at.x < width + 20 && at.y < height + 20;
      if (button.hidden === isVisible) button.hidden = !isVisible;
      if (isVisible) button.style.translate = `${at.x.toFixed(1)}px ${at.y.toFixed(1)}px`;
    }
  }

  private watch(button: HTMLButtonElement, handle: Handle): void {
    let start: { x: number; y: number; position: Vec3; drag: (by: Vec3) => void } | null = null;
    button.addEventListener('pointerdown', (event) => {
      const position = handle.position();
      if (event.button !== 0 || !position) return;
      button.setPointerCapture(event.pointerId);
      start = { x: event.clientX, y: event.clientY, position, drag: handle.grab() };
    });
    button.addEventListener('pointermove', (event) => {
      const pose = this.pose();
      if (!start || !pose) return;
      const a = axes(pose);
      const depth = dot(scale(a.back, -1), sub(start.position, pose.eye)) / length(sub(pose.lookAt, pose.eye));
      const perPixel = unitsPerPixel(pose, this.canvas.clientHeight) * depth;
      const [right, up] = [(event.clientX - start.x) * perPixel, (start.y - event.clientY) * perPixel];
      start.drag(add(scale(a.right, right), scale(a.up, up)));
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

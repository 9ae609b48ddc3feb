// Handles over the picture. They are buttons: reached by Tab, moved by arrow keys, dragged by pointer or touch.
import { inViewPlane, projected, unitsPerPixel } from '../package/src/camera';
import { create, element } from './dom';
import { watchArrows } from './keyboard';
import type { Vec3 } from '../package/src/messages';
import { length, sub } from '../package/src/vec';
import type { Viewer } from './viewer';

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
  private layer = element('handles');
  private items: { button: HTMLButtonElement; handle: Handle }[] = [];

  constructor(private viewer: Viewer) {}

  add(handle: Handle): void {
    const { label, icon } = handle;
    const button = create('button', { type: 'button', className: 'handle', title: label, ariaLabel: label });
    button.hidden = true; // until place()
    if (icon) {
      button.classList.add('large');
      button.innerHTML = `<svg><use href="#i-${icon}"/></svg>`;
    }
    this.layer.append(button);
    this.items.push({ button, handle });
    this.watch(button, handle);
  }

  // Positions the buttons. To be called whenever the camera or the position of a handle has changed.
  place(): void {
    const pose = this.viewer.pose();
    const { clientWidth: width, clientHeight: height } = this.viewer.picture.canvas;
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
      const pose = this.viewer.pose();
      if (!start || !pose) return;
      const { clientWidth: width, clientHeight: height } = this.viewer.picture.canvas;
      const { depth } = projected(pose, start.position, width, height);
      const perPixel = (unitsPerPixel(pose, height) * depth) / length(sub(pose.lookAt, pose.eye));
      start.drag(inViewPlane(pose, (event.clientX - start.x) * perPixel, (start.y - event.clientY) * perPixel));
    });
    const end = () => (start = null);
    button.addEventListener('pointerup', end);
    button.addEventListener('pointercancel', end);
    watchArrows(button, (right, up, withShift) => {
      const times = withShift ? 5 : 1;
      handle.nudge(right * times, up * times);
    });
  }
}

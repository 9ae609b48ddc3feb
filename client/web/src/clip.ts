// The clip plane: a switch, buttons, a slider, and two handles in the picture, one to move it and one to turn it.
import { axes, type Pose } from './camera';
import { element, input, onClick } from './dom';
import { short } from './format';
import type { Frame } from './frame';
import type { Handles } from './handles';
import type { Box, Plane, Vec3 } from './messages';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, along, corners, diagonal, dot, middle, scale, sub, turned, unit } from './vec';

const kStep = 0.01; // of the diagonal, by an arrow key
const kTurnStep = Math.PI / 60;
const kArm = 0.18; // of the diagonal, from one handle to the other

// The least and the greatest offset at which a plane with this normal touches the box.
export function extent(box: Box, normal: Vec3): [number, number] {
  const offsets = corners(box).map((corner) => dot(normal, corner));
  return [Math.min(...offsets), Math.max(...offsets)];
}

// Through the middle of the box, keeping what is on the side away from the normal.
export const throughMiddle = (box: Box, normal: Vec3): Plane => ({ normal: unit(normal), offset: dot(unit(normal), middle(box)) });

// Where the plane is held: nearest to the middle of the box.
export const holdOf = (box: Box, plane: Plane): Vec3 => along(middle(box), plane.normal, plane.offset - dot(plane.normal, middle(box)));

function clamped(box: Box, plane: Plane): Plane {
  const [least, most] = extent(box, plane.normal);
  return { normal: plane.normal, offset: Math.min(most, Math.max(least, plane.offset)) };
}

// Turned about the point where it is held.
function turnedTo(box: Box, plane: Plane, normal: Vec3): Plane {
  const n = unit(normal, plane.normal);
  return clamped(box, { normal: n, offset: dot(n, holdOf(box, plane)) });
}

export class ClipControls {
  private last: Plane | null = null; // where it was when it was switched off

  constructor(private view: Store<ViewState>, private frame: () => Frame | null, private pose: () => Pose | null, handles: Handles) {
    input('clip').addEventListener('change', () => this.toggle());
    ([['clip-x', [1, 0, 0]], ['clip-y', [0, 1, 0]], ['clip-z', [0, 0, 1]]] as [string, Vec3][]).forEach(([id, normal]) =>
      onClick(id, () => this.facing(normal)),
    );
    onClick('clip-view', () => {
      const pose = this.pose();
      if (pose) this.facing(axes(pose).back);
    });
    onClick('clip-flip', () => this.change((plane) => ({ normal: scale(plane.normal, -1), offset: -plane.offset })));
    input('clip-offset').addEventListener('input', () => {
      const t = input('clip-offset').valueAsNumber;
      this.change((plane, box) => {
        const [least, most] = extent(box, plane.normal);
        return { normal: plane.normal, offset: least + t * (most - least) };
      });
    });
    this.addHandles(handles);
    view.watch(['clip'], () => this.show());
  }

  toggle(): void {
    const frame = this.frame();
    const { clip } = this.view.value;
    if (clip) this.last = clip;
    const pose = this.pose();
    const towardsEye = pose && frame ? mainAxis(sub(pose.eye, middle(frame.box))) : ([1, 0, 0] as Vec3);
    this.view.set({ clip: clip || !frame ? null : (this.last ?? throughMiddle(frame.box, towardsEye)) });
    this.show();
  }

  forget(): void {
    this.last = null;
  }

  private facing(normal: Vec3): void {
    this.change((_, box) => throughMiddle(box, normal));
  }

  private change(make: (plane: Plane, box: Box) => Plane): void {
    const frame = this.frame();
    const { clip } = this.view.value;
    if (frame && clip) this.view.set({ clip: clamped(frame.box, make(clip, frame.box)) });
  }

  private show(): void {
    const { clip } = this.view.value;
    const frame = this.frame();
    input('clip').checked = clip !== null;
    element('clip-controls').hidden = clip === null;
    if (!clip || !frame) return;
    const [least, most] = extent(frame.box, clip.normal);
    input('clip-offset').value = String((clip.offset - least) / (most - least || 1));
    element('clip-offset-out').textContent = short(clip.offset);
  }

  private addHandles(handles: Handles): void {
    const held = (): { plane: Plane; at: Vec3; box: Box } | null => {
      const [frame, plane] = [this.frame(), this.view.value.clip];
      return frame && plane ? { plane, at: holdOf(frame.box, plane), box: frame.box } : null;
    };
    const arm = (box: Box) => kArm * diagonal(box);
    handles.add({
      label: 'Move the clip plane',
      icon: 'move',
      at: () => held()?.at ?? null,
      begin: held,
      drag: (by, start) => {
        const from = start as ReturnType<typeof held>;
        if (from) this.change(() => ({ normal: from.plane.normal, offset: from.plane.offset + this.dragged(by, from.plane.normal) }));
      },
      nudge: (right, up) => this.change((plane, box) => ({ normal: plane.normal, offset: plane.offset + (right + up) * kStep * diagonal(box) })),
    });
    handles.add({
      label: 'Turn the clip plane',
      icon: 'turn',
      at: () => {
        const now = held();
        return now && along(now.at, now.plane.normal, arm(now.box));
      },
      begin: held,
      drag: (by, start) => {
        const from = start as ReturnType<typeof held>;
        if (from) this.change((_, box) => turnedTo(box, from.plane, add(scale(from.plane.normal, arm(box)), by)));
      },
      nudge: (right, up) => {
        const pose = this.pose();
        if (!pose) return;
        const a = axes(pose);
        this.change((plane, box) => turnedTo(box, plane, turned(turned(plane.normal, a.up, right * kTurnStep), a.right, -up * kTurnStep)));
      },
    });
  }

  // How far along the normal a drag in the plane of the picture goes: so that the handle stays below the pointer. Where the normal points at the
  // eye, up in the picture is towards it.
  private dragged(by: Vec3, normal: Vec3): number {
    const pose = this.pose();
    if (!pose) return 0;
    const a = axes(pose);
    const seen = add(scale(a.right, dot(a.right, normal)), scale(a.up, dot(a.up, normal)));
    const part = dot(seen, seen);
    return part > 0.05 ? dot(by, seen) / part : dot(by, a.up);
  }
}

// The axis that v is nearest to, on v's side.
function mainAxis(v: Vec3): Vec3 {
  const i = [0, 1, 2].reduce((best, axis) => (Math.abs(v[axis]!) > Math.abs(v[best]!) ? axis : best), 0);
  return [0, 1, 2].map((axis) => (axis === i ? Math.sign(v[i]!) || 1 : 0)) as Vec3;
}

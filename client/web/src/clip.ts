// The clip plane: a switch, buttons, a slider, and two handles in the picture, one to move it and one to turn it.
import { axes, type Pose } from './camera';
import { element, input, onClick } from './dom';
import { short } from './format';
import type { Frame } from './frame';
import type { Handles } from './handles';
import type { Box, Plane, Vec3 } from './messages';
import { clamped, extent, holdOf, mainAxis, throughMiddle, tipOf, turnedTo } from './plane';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, diagonal, dot, middle, scale, sub, turned } from './vec';

const kStep = 0.01; // of the diagonal, by an arrow key
const kTurnStep = Math.PI / 60;

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

  // Another data set: where it was in the last means nothing in this.
  opened(): void {
    this.last = null;
    this.show();
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
        return now && tipOf(now.box, now.plane);
      },
      begin: held,
      drag: (by, start) => {
        const from = start as ReturnType<typeof held>;
        if (from) this.change((_, box) => turnedTo(box, from.plane, add(tipOf(box, from.plane), by)));
      },
      nudge: (right, up) => {
        const pose = this.pose();
        if (!pose) return;
        const a = axes(pose);
        this.change((plane, box) => {
          const normal = turned(turned(plane.normal, a.up, right * kTurnStep), a.right, -up * kTurnStep);
          return turnedTo(box, plane, add(holdOf(box, plane), normal));
        });
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

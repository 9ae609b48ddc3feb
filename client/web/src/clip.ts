// The controls of the clip plane: a switch, buttons, a slider, and two handles in the picture that move and rotate it.
import { axes, ontoViewPlane } from '../package/src/camera';
import { element, input, onClick } from './dom';
import { short } from './format';
import type { Handles } from './handles';
import type { Box, Plane, Vec3 } from '../package/src/messages';
import { clamped, facing, handlePosition, mainAxis, normalTip, offsetRange, rotatedTowards, throughCenter } from './plane';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, diagonal, dot, kAxes, rotated, scale, sub } from '../package/src/vec';
import type { Viewer } from './viewer';

const kMoveStep = 0.01; // per arrow key, as a fraction of the box's diagonal
const kRotateStep = Math.PI / 60; // per arrow key, radians

export class ClipControls {
  private last: Plane | null = null; // the plane when it was switched off

  constructor(private view: Store<ViewState>, private viewer: Viewer, handles: Handles) {
    input('clip').addEventListener('change', () => this.toggle());
    ['x', 'y', 'z'].forEach((name, axis) => onClick(`clip-${name}`, () => this.setNormal(kAxes[axis]!)));
    onClick('clip-view', () => {
      const pose = viewer.pose();
      if (pose) this.setNormal(axes(pose).back);
    });
    onClick('clip-flip', () => this.change((plane) => ({ normal: scale(plane.normal, -1), offset: -plane.offset })));
    input('clip-offset').addEventListener('input', () => {
      const t = input('clip-offset').valueAsNumber;
      this.change(({ normal }, box) => {
        const sign = facing(normal);
        const [least, greatest] = offsetRange(box, scale(normal, sign));
        return { normal, offset: sign * (least + t * (greatest - least)) };
      });
    });
    this.addMoveHandle(handles);
    this.addRotateHandle(handles);
    view.watch(['clip'], () => this.show());
  }

  // Without an earlier plane: through the centre of the box, facing the camera.
  toggle(): void {
    const { frame } = this.viewer;
    const { clip } = this.view.value;
    const pose = this.viewer.pose();
    if (clip) this.last = clip;
    const plane = frame && pose && (this.last ?? throughCenter(frame.box, mainAxis(sub(pose.eye, frame.center))));
    this.view.set({ clip: clip ? null : plane });
    this.show();
  }

  // A data set was opened: the plane of the last one does not apply to it.
  opened(): void {
    this.last = null;
    this.show();
  }

  private setNormal(normal: Vec3): void {
    this.change((_, box) => throughCenter(box, normal));
  }

  private change(make: (plane: Plane, box: Box) => Plane): void {
    const { frame } = this.viewer;
    const { clip } = this.view.value;
    if (frame && clip) this.view.set({ clip: clamped(frame.box, make(clip, frame.box)) });
  }

  private show(): void {
    const { frame } = this.viewer;
    const { clip } = this.view.value;
    input('clip').checked = clip !== null;
    element('clip-controls').hidden = clip === null;
    if (!clip || !frame) return;
    const sign = facing(clip.normal);
    const position = sign * clip.offset;
    const [least, greatest] = offsetRange(frame.box, scale(clip.normal, sign));
    input('clip-offset').value = String((position - least) / (greatest - least || 1));
    element('clip-offset-out').textContent = short(position);
  }

  private addMoveHandle(handles: Handles): void {
    handles.add({
      label: 'Move the clip plane',
      icon: 'move',
      position: () => this.at(handlePosition),
      grab: () => {
        const { normal, offset } = this.view.value.clip!;
        return (by) => this.change(() => ({ normal, offset: offset + this.alongNormal(by, normal) }));
      },
      nudge: (right, up) =>
        this.change(({ normal, offset }, box) => ({ normal, offset: offset + (right + up) * kMoveStep * diagonal(box) })),
    });
  }

  private addRotateHandle(handles: Handles): void {
    handles.add({
      label: 'Rotate the clip plane',
      icon: 'turn',
      position: () => this.at(normalTip),
      grab: () => {
        const plane = this.view.value.clip!;
        return (by) => this.change((_, box) => rotatedTowards(box, plane, add(normalTip(box, plane), by)));
      },
      nudge: (right, up) => {
        const pose = this.viewer.pose();
        if (!pose) return;
        const a = axes(pose);
        this.change((plane, box) => {
          const normal = rotated(rotated(plane.normal, a.up, right * kRotateStep), a.right, -up * kRotateStep);
          return rotatedTowards(box, plane, add(handlePosition(box, plane), normal));
        });
      },
    });
  }

  private at(position: (box: Box, plane: Plane) => Vec3): Vec3 | null {
    const { frame } = this.viewer;
    const { clip } = this.view.value;
    return frame && clip && position(frame.box, clip);
  }

  // The distance along the normal that keeps the handle under a pointer dragged by `by`. Where the normal points at the
  // eye, dragging up moves the plane towards it.
  private alongNormal(by: Vec3, normal: Vec3): number {
    const pose = this.viewer.pose();
    if (!pose) return 0;
    const projected = ontoViewPlane(pose, normal);
    const squared = dot(projected, projected);
    return squared > 0.05 ? dot(by, projected) / squared : dot(by, axes(pose).up);
  }
}

// The region of interest: a box in world coordinates that is refined to full detail. Its controls: a switch, six
// numbers, and seven handles, of its faces and of the whole box.
import { inViewPlane, ontoViewPlane } from '../package/src/camera';
import { create, element, input } from './dom';
import type { Handle, Handles } from './handles';
import type { Box, Vec3 } from '../package/src/messages';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, center, clamp, dot, kAxes, scale, sub } from '../package/src/vec';
import type { Viewer } from './viewer';

const kAxisNames = ['X', 'Y', 'Z'];
const kMoveStep = 0.02; // per arrow key, as a fraction of the data's box
const kLeastSize = 0.01; // the same

type End = 'min' | 'max';

// The box of half the size with the same centre.
export function middleHalf(box: Box): Box {
  const quarter = scale(sub(box.max, box.min), 0.25);
  return { min: add(box.min, quarter), max: sub(box.max, quarter) };
}

// With one face moved to a coordinate, clamped to the data's box and to the opposite face.
export function faceMoved(region: Box, data: Box, axis: number, end: End, to: number): Box {
  const moved: Box = { min: [...region.min], max: [...region.max] };
  const size = kLeastSize * (data.max[axis]! - data.min[axis]!);
  const [least, greatest] = end === 'min' ? [data.min[axis]!, region.max[axis]! - size] : [region.min[axis]! + size, data.max[axis]!];
  moved[end][axis] = clamp(to, least, greatest);
  return moved;
}

// Moved as a whole, clamped to the data's box.
export function wholeMoved(region: Box, data: Box, by: Vec3): Box {
  const step = by.map((d, i) => clamp(d, data.min[i]! - region.min[i]!, data.max[i]! - region.max[i]!)) as Vec3;
  return { min: add(region.min, step), max: add(region.max, step) };
}

export class RegionControls {
  private last: Box | null = null; // the region when it was switched off
  private fields: Record<End, HTMLInputElement[]> = { min: [], max: [] };

  constructor(private view: Store<ViewState>, private viewer: Viewer, handles: Handles) {
    input('region').addEventListener('change', () => this.toggle());
    input('tets').addEventListener('change', () => view.set({ tets: input('tets').checked }));
    input('shrink').addEventListener('input', () => view.set({ shrink: input('shrink').valueAsNumber }));
    this.addFields();
    handles.add(this.wholeHandle());
    for (const axis of [0, 1, 2]) for (const end of ['min', 'max'] as const) handles.add(this.faceHandle(axis, end));
    view.watch(['region', 'tets', 'shrink'], () => this.show());
  }

  toggle(): void {
    const { frame } = this.viewer;
    const { region } = this.view.value;
    if (region) this.last = region;
    this.view.set(region || !frame ? { region: null, tets: false } : { region: this.last ?? middleHalf(frame.box) });
    this.show();
  }

  // Switches the region on as well: tetrahedra are shown only in it.
  toggleTets(): void {
    if (!this.view.value.region) this.toggle();
    this.view.set({ tets: !this.view.value.tets && this.view.value.region !== null });
  }

  // A data set was opened: the region of the last one does not apply to it.
  opened(): void {
    this.last = null;
    this.show();
  }

  private change(make: (region: Box, data: Box) => Box): void {
    const { frame } = this.viewer;
    const { region } = this.view.value;
    if (frame && region) this.view.set({ region: make(region, frame.box) });
  }

  private show(): void {
    const { region, tets, shrink } = this.view.value;
    input('region').checked = region !== null;
    input('tets').checked = tets;
    element('region-controls').hidden = region === null;
    element('tets-controls').hidden = !tets;
    input('shrink').value = String(shrink);
    element('shrink-out').textContent = `${Math.round(shrink * 100)} %`;
    if (!region) return;
    for (const end of ['min', 'max'] as const) {
      this.fields[end].forEach((field, axis) => {
        if (document.activeElement !== field) field.value = String(Number(region[end][axis]!.toPrecision(5)));
      });
    }
  }

  private addFields(): void {
    const label = (text: string) => create('span', {}, text);
    const grid = element('region-fields');
    grid.append(label(''), label('From'), label('To'));
    kAxisNames.forEach((axisName, axis) => {
      grid.append(label(axisName));
      for (const [end, name] of [['min', 'From'], ['max', 'To']] as const) {
        const field = create('input', { type: 'number', step: 'any', ariaLabel: `${name} ${axisName}` });
        field.addEventListener('change', () => {
          const to = field.valueAsNumber;
          if (Number.isFinite(to)) this.change((region, data) => faceMoved(region, data, axis, end, to));
          this.show();
        });
        this.fields[end].push(field);
        grid.append(field);
      }
    });
  }

  private wholeHandle(): Handle {
    const region = () => this.view.value.region;
    return {
      label: 'Move the region',
      icon: 'move4',
      position: () => region() && center(region()!),
      grab: () => {
        const from = region()!;
        return (by) => this.change((_, data) => wholeMoved(from, data, by));
      },
      nudge: (right, up) => {
        const pose = this.viewer.pose();
        if (!pose) return;
        this.change((now, data) => {
          const step = kMoveStep * Math.max(...sub(data.max, data.min));
          return wholeMoved(now, data, inViewPlane(pose, right * step, up * step));
        });
      },
    };
  }

  private faceHandle(axis: number, end: End): Handle {
    const region = () => this.view.value.region;
    return {
      label: `Move the region's ${end === 'min' ? 'lower' : 'upper'} ${kAxisNames[axis]} face`,
      position: () => {
        const now = region();
        return now && (center(now).map((c, i) => (i === axis ? now[end][i]! : c)) as Vec3);
      },
      grab: () => {
        const from = region()!;
        return (by) => this.change((_, data) => faceMoved(from, data, axis, end, from[end][axis]! + this.alongAxis(by, axis)));
      },
      nudge: (right, up) =>
        this.change((now, data) => {
          const step = kMoveStep * (data.max[axis]! - data.min[axis]!);
          return faceMoved(now, data, axis, end, now[end][axis]! + (right + up) * step);
        }),
    };
  }

  // The distance along an axis that keeps the handle under a pointer dragged by `by`.
  private alongAxis(by: Vec3, axis: number): number {
    const pose = this.viewer.pose();
    if (!pose) return 0;
    const projected = ontoViewPlane(pose, kAxes[axis]!);
    return dot(by, projected) / Math.max(dot(projected, projected), 0.05);
  }
}

// The region of interest: a box in the world that is refined to the end. A switch, six numbers, and seven handles: its faces, and the whole.
import { axes, type Pose } from './camera';
import { element, input } from './dom';
import type { Frame } from './frame';
import type { Handles } from './handles';
import type { Box, Vec3 } from './messages';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, dot, middle, scale, sub } from './vec';

const kNames = ['X', 'Y', 'Z'];
const kStep = 0.02; // of the box's side, by an arrow key
const kThinnest = 0.01;

// The middle half of a box.
export function middleHalf(box: Box): Box {
  const quarter = scale(sub(box.max, box.min), 0.25);
  return { min: add(box.min, quarter), max: sub(box.max, quarter) };
}

// One face moved, within the box of the data and not past its opposite.
export function faceMoved(region: Box, within: Box, axis: number, end: 'min' | 'max', to: number): Box {
  const moved: Box = { min: [...region.min], max: [...region.max] };
  const thin = kThinnest * (within.max[axis]! - within.min[axis]!);
  const [least, most] = end === 'min' ? [within.min[axis]!, region.max[axis]! - thin] : [region.min[axis]! + thin, within.max[axis]!];
  moved[end][axis] = Math.min(most, Math.max(least, to));
  return moved;
}

// Moved as a whole, staying within the box of the data.
export function wholeMoved(region: Box, within: Box, by: Vec3): Box {
  const held = by.map((d, i) => Math.min(within.max[i]! - region.max[i]!, Math.max(within.min[i]! - region.min[i]!, d))) as Vec3;
  return { min: add(region.min, held), max: add(region.max, held) };
}

export class RegionControls {
  private last: Box | null = null;
  private fields: Record<'min' | 'max', HTMLInputElement[]> = { min: [], max: [] };

  constructor(private view: Store<ViewState>, private frame: () => Frame | null, private pose: () => Pose | null, handles: Handles) {
    input('region').addEventListener('change', () => this.toggle());
    input('tets').addEventListener('change', () => view.set({ tets: input('tets').checked }));
    input('shrink').addEventListener('input', () => view.set({ shrink: input('shrink').valueAsNumber }));
    this.addFields();
    this.addHandles(handles);
    view.watch(['region', 'tets', 'shrink'], () => this.show());
  }

  toggle(): void {
    const frame = this.frame();
    const { region } = this.view.value;
    if (region) this.last = region;
    this.view.set(region || !frame ? { region: null, tets: false } : { region: this.last ?? middleHalf(frame.box) });
    this.show();
  }

  // The tetrahedra need a region, so they bring one.
  toggleTets(): void {
    if (!this.view.value.region) this.toggle();
    this.view.set({ tets: !this.view.value.tets && this.view.value.region !== null });
  }

  // Another data set: where it was in the last means nothing in this.
  opened(): void {
    this.last = null;
    this.show();
  }

  private change(make: (region: Box, within: Box) => Box): void {
    const frame = this.frame();
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
    const grid = element('region-fields');
    grid.append(document.createElement('span'), ...kNames.map((name) => Object.assign(document.createElement('span'), { textContent: name })));
    for (const [end, name] of [['min', 'From'], ['max', 'To']] as const) {
      grid.append(Object.assign(document.createElement('span'), { textContent: name }));
      this.fields[end] = kNames.map((axis, i) => {
        const field = Object.assign(document.createElement('input'), { type: 'number', step: 'any', ariaLabel: `${name} ${axis}` });
        field.addEventListener('change', () => {
          if (Number.isFinite(field.valueAsNumber)) this.change((region, within) => faceMoved(region, within, i, end, field.valueAsNumber));
          this.show();
        });
        grid.append(field);
        return field;
      });
    }
  }

  private addHandles(handles: Handles): void {
    const region = () => this.view.value.region;
    handles.add({
      label: 'Move the region',
      icon: 'move4',
      at: () => region() && middle(region()!),
      begin: region,
      drag: (by, start) => this.change((_, within) => wholeMoved(start as Box, within, by)),
      nudge: (right, up) => {
        const pose = this.pose();
        if (!pose) return;
        const a = axes(pose);
        this.change((now, within) => {
          const step = kStep * Math.max(...sub(within.max, within.min));
          return wholeMoved(now, within, add(scale(a.right, right * step), scale(a.up, up * step)));
        });
      },
    });
    for (const axis of [0, 1, 2]) {
      for (const end of ['min', 'max'] as const) {
        handles.add({
          label: `Move the region's ${end === 'min' ? 'lower' : 'upper'} ${kNames[axis]} face`,
          at: () => {
            const now = region();
            if (!now) return null;
            const at = middle(now);
            at[axis] = now[end][axis]!;
            return at;
          },
          begin: region,
          drag: (by, start) => this.change((_, within) => faceMoved(start as Box, within, axis, end, (start as Box)[end][axis]! + this.alongAxis(by, axis))),
          nudge: (right, up) =>
            this.change((now, within) => {
              const step = kStep * (within.max[axis]! - within.min[axis]!);
              return faceMoved(now, within, axis, end, now[end][axis]! + (right + up) * step);
            }),
        });
      }
    }
  }

  // How far along an axis a drag in the plane of the picture goes.
  private alongAxis(by: Vec3, axis: number): number {
    const pose = this.pose();
    if (!pose) return 0;
    const a = axes(pose);
    const direction: Vec3 = [axis === 0 ? 1 : 0, axis === 1 ? 1 : 0, axis === 2 ? 1 : 0];
    const seen = add(scale(a.right, dot(a.right, direction)), scale(a.up, dot(a.up, direction)));
    return dot(by, seen) / Math.max(dot(seen, seen), 0.05);
  }
}

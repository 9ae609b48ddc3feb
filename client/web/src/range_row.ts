// The controls of one range: two number fields, of which an empty one is an infinite bound; two handles on the
// histogram; and where there are several ranges, its colour, its opacity and a button that removes it.
import type { Statistics } from '../package/src/datasets';
import { create, createSvg, element, setText } from './dom';
import { short } from './format';
import type { Range } from '../package/src/ranges';
import { rounded } from './range';
import type { SurfaceStyle } from './state';
import { clamp } from '../package/src/vec';

export type End = 0 | 1;
export const kEnds: readonly End[] = [0, 1];
export const kHeight = 48; // of the histogram's drawing; each bin is 1 wide
const kKeySteps: Record<string, number> = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -16, PageUp: 16 };

// What the row does, and asks for.
export interface RangeActions {
  statistics(): Statistics | null;
  bound(end: End): number; // NaN: there is no such range
  type(end: End, to: number): void; // into a field
  move(end: End, to: number): void; // by a handle
  rest(): void; // that handle was let go
  restyle(change: Partial<SurfaceStyle>): void;
  remove(): void;
}

export class RangeRow {
  private fields: HTMLInputElement[];
  private handles: HTMLElement[];
  private color: HTMLInputElement;
  private opacity: HTMLInputElement;
  private opacityOut = create('output', {});
  private selection = createSvg('rect', { y: '0', height: '100%' });
  private bars: SVGElement; // those in the range
  private looks: HTMLElement; // colour, opacity and the button
  private volume: HTMLElement;
  private root: HTMLElement;

  // index: from 0. The elements of the first row have ids that begin with "range-", those of the second with "range2-".
  constructor(index: number, private actions: RangeActions) {
    const [id, of] = [index === 0 ? 'range' : `range${index + 1}`, index === 0 ? '' : ` of range ${index + 1}`];
    this.fields = ['low', 'high'].map((name, end) =>
      create('input', { type: 'number', id: `${id}-${name}`, step: 'any', placeholder: end === 0 ? '−∞' : '∞' }),
    );
    this.handles = ['low', 'high'].map((name, end) => this.handle(`${id}-handle-${name}`, `${end === 0 ? 'Least' : 'Greatest'} value shown${of}`));
    this.color = create('input', { type: 'color', id: `${id}-color`, ariaLabel: `Colour of range ${index + 1}` });
    this.opacity = create('input', { type: 'range', id: `${id}-opacity`, min: '0', max: '1', step: '0.01', ariaLabel: `Opacity of range ${index + 1}` });
    const remove = create('button', { type: 'button', id: `${id}-remove`, className: 'icon', ariaLabel: `Remove range ${index + 1}`, title: 'Remove this range' }, '×');
    const [from, to] = ['From', 'To'].map((text, end) => create('label', {}, create('span', {}, text), this.fields[end]!));
    this.looks = create('div', { className: 'looks' }, this.color, this.opacity, this.opacityOut, remove);
    this.volume = create('p', { id: `${id}-volume`, className: 'hint' });
    this.root = create('div', { className: 'range' }, create('div', { className: 'pair' }, from!, to!), this.looks, this.volume);
    element('ranges').append(this.root);
    const clip = createSvg('clipPath', { id: `${id}-selected` });
    clip.append(this.selection);
    this.bars = createSvg('use', { href: '#histogram-bars', class: 'selected', 'clip-path': `url(#${clip.id})` });
    element('histogram-drawing').append(clip, this.bars);
    element('histogram').append(...this.handles);
    this.fields.forEach((field, end) => field.addEventListener('change', () => this.typed(field, end as End)));
    kEnds.forEach((end) => this.watchHandle(end));
    this.color.addEventListener('input', () => actions.restyle({ color: this.color.value }));
    this.opacity.addEventListener('input', () => actions.restyle({ opacity: this.opacity.valueAsNumber }));
    remove.addEventListener('click', () => actions.remove());
  }

  // range: null hides the row. style: null where there is one range only. enclosed: null if it is not known.
  show(range: Range | null, style: SurfaceStyle | null, statistics: Statistics | null, enclosed: string | null): void {
    this.root.hidden = range === null;
    this.bars.style.display = range ? '' : 'none';
    for (const handle of this.handles) handle.hidden = range === null;
    if (!range) return;
    kEnds.forEach((end) => {
      const bound = range[end];
      this.fields[end]!.value = Number.isFinite(bound) ? String(Number(bound.toPrecision(7))) : '';
    });
    this.looks.hidden = style === null;
    for (const part of [...this.handles, this.bars]) {
      if (style) part.style.setProperty('--range', style.color);
      else part.style.removeProperty('--range');
    }
    if (style) {
      this.color.value = style.color;
      this.opacity.value = String(style.opacity);
      setText(this.opacityOut, `${Math.round(style.opacity * 100)} %`);
    }
    this.volume.hidden = enclosed === null;
    setText(this.volume, enclosed ?? '');
    if (!statistics) return;
    kEnds.forEach((end) => placeHandle(this.handles[end]!, statistics, range[end]));
    const [from, to] = range.map((bound) => positionOf(statistics, bound));
    this.selection.setAttribute('x', String(from! * statistics.counts.length));
    this.selection.setAttribute('width', String((to! - from!) * statistics.counts.length));
  }

  private typed(field: HTMLInputElement, end: End): void {
    const to = field.value.trim() === '' ? (end === 0 ? -Infinity : Infinity) : field.valueAsNumber;
    this.actions.type(end, Number.isNaN(to) ? this.actions.bound(end) : to);
  }

  private handle(id: string, label: string): HTMLElement {
    return create('div', { id, className: 'bound', role: 'slider', tabIndex: 0, ariaLabel: label });
  }

  private watchHandle(end: End): void {
    const { statistics, bound, move, rest } = this.actions;
    const [handle, chart] = [this.handles[end]!, element('histogram')];
    const valueAt = (share: number): number => {
      const { least, width, counts } = statistics()!;
      return rounded(least + width * counts.length * clamp(share, 0, 1), width);
    };
    handle.addEventListener('pointerdown', (event) => {
      if (event.button === 0) handle.setPointerCapture(event.pointerId);
    });
    handle.addEventListener('pointermove', (event) => {
      if (!handle.hasPointerCapture(event.pointerId) || !statistics()) return;
      const { left, width } = chart.getBoundingClientRect();
      move(end, valueAt((event.clientX - left) / width));
    });
    handle.addEventListener('lostpointercapture', rest);
    handle.addEventListener('keydown', (event) => {
      const field = statistics();
      const steps = kKeySteps[event.key];
      if (!field || (steps === undefined && event.key !== 'Home' && event.key !== 'End')) return;
      event.preventDefault();
      const at = positionOf(field, bound(end));
      move(end, valueAt(event.key === 'Home' ? 0 : event.key === 'End' ? 1 : at + steps! / field.counts.length));
    });
  }
}

// Where a value lies between the ends of the histogram, 0 to 1.
const positionOf = ({ least, width, counts }: Statistics, value: number): number => clamp((value - least) / (width * counts.length), 0, 1);

function placeHandle(handle: HTMLElement, statistics: Statistics, value: number): void {
  handle.style.left = `${100 * positionOf(statistics, value)}%`;
  handle.setAttribute('aria-valuemin', String(statistics.least));
  handle.setAttribute('aria-valuemax', String(statistics.least + statistics.width * statistics.counts.length));
  handle.setAttribute('aria-valuenow', String(clamp(value, statistics.least, statistics.least + statistics.width * statistics.counts.length)));
  handle.setAttribute('aria-valuetext', short(value));
}

// The controls of volume rendering: a switch, and a strip under the histogram on which the points of the opacity curve
// are moved, added and removed. The strip is as high as the square root of the opacity: small ones matter most.
import type { ColorMap } from './color_maps';
import { create, createSvg, element, input, onClick, setText } from './dom';
import { count, short } from './format';
import { defaultOpacity, type OpacityCurve, opacityAt, pointAdded, pointMoved, pointRemoved } from './opacity';
import { type Range, spanOf } from '../package/src/ranges';
import { rounded } from './range';
import { exclusive, type ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import { clamp } from '../package/src/vec';
import type { Viewer } from './viewer';

export const kMostVolumeTets = 2e6; // drawn
const kSamples = 256; // of the curve as it is drawn
const kStops = 16; // of the gradient of colours
const kKeySteps: Record<string, readonly [value: number, height: number]> = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1], PageDown: [0, -10], PageUp: [0, 10],
};

// What colours values have, and of which ranges.
interface Colors {
  readonly ranges: Range[];
  readonly bar: { span: Range; colors: ColorMap } | null;
}

export class VolumeControls {
  private strip = element('opacity');
  private area = createSvg('path', { fill: 'url(#opacity-colors)', stroke: 'none' });
  private line = createSvg('path', { class: 'line', 'vector-effect': 'non-scaling-stroke' });
  private gradient = createSvg('linearGradient', { id: 'opacity-colors', gradientUnits: 'userSpaceOnUse', y1: '0', y2: '0' });
  private points: HTMLElement[] = [];

  constructor(private view: Store<ViewState>, private status: Store<Status>, private viewer: Viewer, private colors: Colors) {
    const { isAvailable } = viewer.picture.volume;
    input('volume').disabled = !isAvailable;
    input('volume').addEventListener('change', () => this.toggle());
    element('opacity-drawing').append(this.gradient, this.area, this.line);
    this.strip.addEventListener('dblclick', (event) => {
      if (event.target instanceof HTMLElement && event.target.classList.contains('opacity-point')) return;
      const place = this.placeOf(event);
      if (place) this.set(pointAdded(this.curve()!, place));
    });
    onClick('opacity-reset', () => view.set({ opacity: null }));
    view.watch(['render', 'opacity', 'maxTets'], () => this.update());
    status.watch(['statistics', 'progress'], () => this.update());
  }

  toggle(): void {
    if (!input('volume').disabled) this.view.set(exclusive({ render: this.view.value.render === 'volume' ? 'surface' : 'volume' }));
  }

  // The colours, the ranges, the curve or the data set have changed.
  update(): void {
    const { render, opacity } = this.view.value;
    const isOn = render === 'volume';
    input('volume').checked = isOn;
    element('volume-controls').hidden = !isOn;
    setText(element('volume-note'), this.note());
    const [values, curve, axis] = [this.values(), this.curve(), this.axis()];
    if (!isOn || !values || !curve || !axis) return;
    element<HTMLButtonElement>('opacity-reset').disabled = opacity === null;
    this.showCurve(curve, axis, values);
    this.showPoints(curve, axis);
    const { bar, ranges } = this.colors;
    if (!bar) return;
    this.viewer.picture.volume.setTransfer({ values, opacity: curve, ...bar }, ranges);
    this.showColors(bar, axis);
    this.viewer.invalidate();
  }

  private note(): string {
    const { progress } = this.status.value;
    if (input('volume').disabled) {
      return 'Volume rendering needs floating-point render targets (EXT_color_buffer_float), which this graphics card or driver does not support.';
    }
    const { render, maxTets, region } = this.view.value;
    if (render !== 'volume' || region || !progress || progress.updatesShown >= progress.updates || (maxTets !== null && maxTets < kMostVolumeTets)) return '';
    return `At most ${count(kMostVolumeTets)} tetrahedra are drawn: what was received is finer.`;
  }

  // Those with an opacity that counts: the ends of what is shown.
  private values(): Range | null {
    const { dataset } = this.status.value;
    if (!dataset) return null;
    const [low, high] = spanOf(dataset, this.colors.ranges, null);
    if (low < high) return [low, high];
    const [least, greatest] = dataset.values;
    return [least, Math.max(greatest, least + Number.MIN_VALUE)];
  }

  private curve(): OpacityCurve | null {
    const values = this.values();
    return this.view.value.opacity ?? (values && defaultOpacity(values));
  }

  // The histogram's.
  private axis(): Range | null {
    const { statistics, dataset } = this.status.value;
    if (statistics) return [statistics.least, statistics.least + statistics.width * statistics.counts.length];
    return dataset && [dataset.values[0], dataset.values[1]];
  }

  private set(opacity: OpacityCurve): void {
    this.view.set({ opacity });
  }

  private placeOf({ clientX, clientY }: MouseEvent): { value: number; opacity: number } | null {
    const axis = this.axis();
    const { left, top, width, height } = this.strip.getBoundingClientRect();
    return axis && this.at(axis, (clientX - left) / width, 1 - (clientY - top) / height);
  }

  // Shares of the strip's width and height; with few digits.
  private at([least, greatest]: Range, across: number, up: number): { value: number; opacity: number } {
    const value = least + clamp(across, 0, 1) * (greatest - least);
    return { value: rounded(value, (greatest - least) / 1000 || 1), opacity: Number((clamp(up, 0, 1) ** 2).toPrecision(3)) };
  }

  private move(index: number, place: { value: number; opacity: number }): void {
    const [curve, axis] = [this.curve(), this.axis()];
    if (curve && axis) this.set(pointMoved(curve, index, place, (axis[1] - axis[0]) * 1e-4));
  }

  private onKey(index: number, event: KeyboardEvent): void {
    const [curve, axis] = [this.curve(), this.axis()];
    const point = curve?.[index];
    if (!curve || !axis || !point) return;
    const step = kKeySteps[event.key];
    if (step) {
      const up = Math.sqrt(point.opacity) + step[1] / 50;
      const { value, opacity } = this.at(axis, share(axis, point.value) + step[0] / 128, up);
      this.move(index, { value: step[0] === 0 ? point.value : value, opacity: step[1] === 0 ? point.opacity : opacity });
    } else if (event.key === 'Enter') {
      const other = curve[index + 1] ?? { value: axis[1], opacity: point.opacity };
      const value = (point.value + other.value) / 2;
      this.set(pointAdded(curve, { value, opacity: opacityAt(curve, value) }));
    } else if (event.key === 'Delete' || event.key === 'Backspace') {
      this.set(pointRemoved(curve, index));
      this.points[Math.min(index, this.points.length - 1)]!.focus();
    } else return;
    event.preventDefault();
  }

  private showCurve(curve: OpacityCurve, axis: Range, values: Range): void {
    const at = (x: number) => `${(100 * x).toFixed(3)} ${(100 - 100 * Math.sqrt(opacityAt(curve, axis[0] + x * (axis[1] - axis[0])))).toFixed(3)}`;
    const through = (from: number, to: number) => Array.from({ length: kSamples + 1 }, (_, i) => at(from + (i / kSamples) * (to - from))).join('L');
    const [from, to] = values.map((value) => share(axis, value));
    this.line.setAttribute('d', `M${through(0, 1)}`);
    this.area.setAttribute('d', `M${100 * from!} 100L${through(from!, to!)}L${100 * to!} 100z`);
  }

  private showColors({ span, colors }: { span: Range; colors: ColorMap }, axis: Range): void {
    this.gradient.setAttribute('x1', String(100 * share(axis, span[0], false)));
    this.gradient.setAttribute('x2', String(100 * share(axis, span[1], false)));
    const stops = Array.from({ length: kStops + 1 }, (_, i) => {
      const [r, g, b] = colors[Math.round((i / kStops) * (colors.length - 1))]!;
      return createSvg('stop', { offset: String(i / kStops), 'stop-color': `rgb(${r * 255} ${g * 255} ${b * 255})` });
    });
    this.gradient.replaceChildren(...stops);
  }

  private showPoints(curve: OpacityCurve, axis: Range): void {
    while (this.points.length > curve.length) this.points.pop()!.remove();
    while (this.points.length < curve.length) this.addPoint();
    curve.forEach(({ value, opacity }, i) => {
      const point = this.points[i]!;
      point.style.left = `${100 * share(axis, value)}%`;
      point.style.top = `${100 * (1 - Math.sqrt(opacity))}%`;
      point.ariaLabel = `Opacity, point ${i + 1} of ${curve.length}`;
      point.setAttribute('aria-valuenow', String(opacity));
      point.setAttribute('aria-valuetext', `${short(opacity)} at ${short(value)}`);
    });
  }

  private addPoint(): void {
    const index = this.points.length;
    const point = create('div', { id: `opacity-point-${index + 1}`, className: 'opacity-point', role: 'slider', tabIndex: 0 });
    point.setAttribute('aria-valuemin', '0');
    point.setAttribute('aria-valuemax', '1');
    point.addEventListener('pointerdown', (event) => {
      if (event.button === 0) point.setPointerCapture(event.pointerId);
    });
    point.addEventListener('pointermove', (event) => {
      const place = point.hasPointerCapture(event.pointerId) ? this.placeOf(event) : null;
      if (place) this.move(index, place);
    });
    point.addEventListener('keydown', (event) => this.onKey(index, event));
    this.points.push(point);
    this.strip.append(point);
  }
}

// Where a value lies on an axis: 0 to 1, unless not to be clamped.
function share([least, greatest]: Range, value: number, isClamped = true): number {
  const at = (value - least) / (greatest - least || 1);
  return isClamped ? clamp(at, 0, 1) : at;
}

// The controls of the ranges: a row of number fields for each, and for data sets of every range the histogram of the
// field with two handles for each range, and buttons to show more of them. While a handle moves, the page shows what was
// received of its range; the server is asked when it rests.
import { boxVolume, type Dataset, type Statistics, volumeUnit } from '../package/src/datasets';
import { element, onClick, setText } from './dom';
import { short } from './format';
import type { Range } from '../package/src/ranges';
import { boundMoved, enclosedShare, freeRange, rangesOf } from './range';
import { type End, kHeight, RangeRow } from './range_row';
import { kRangeColors } from '../package/src/colors';
import { kMostRanges, type StyledRange, type SurfaceStyle, type ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';

const kRestMs = 250; // a handle that does not move for so long rests

// preview: shows ranges of what was received.
export function watchRanges(view: Store<ViewState>, status: Store<Status>, preview: (ranges: Range[]) => void): void {
  new RangeControls(view, status, preview);
}

class RangeControls {
  private rows = Array.from({ length: kMostRanges }, (_, index) => this.row(index));
  private moving: Range[] | null = null; // by a handle, and not yet in the view
  private restTimer = 0;
  private restFrame = 0;

  constructor(private view: Store<ViewState>, private status: Store<Status>, private preview: (ranges: Range[]) => void) {
    onClick('range-add', () => this.add());
    view.watch(['range', 'ranges', 'render'], () => this.show());
    status.watch(['dataset', 'statistics'], () => {
      this.moving = null;
      const { statistics } = status.value;
      if (statistics) draw(statistics);
      this.show();
    });
  }

  private row(index: number): RangeRow {
    return new RangeRow(index, {
      statistics: () => this.status.value.statistics,
      bound: (end) => this.current()[index]?.[end] ?? NaN,
      type: (end, to) => {
        const range = this.current()[index];
        if (range) this.set(this.replaced(index, boundMoved(range, end, to)));
        this.show();
      },
      move: (end, to) => this.move(index, end, to),
      rest: () => this.commit(),
      restyle: (change) => {
        const { ranges } = this.view.value;
        this.view.set({ ranges: ranges.map((one, i) => (i === index ? { ...one, style: { ...one.style, ...change } } : one)) });
      },
      remove: () => this.remove(index),
    });
  }

  // Of a data set of one range, that one.
  private current(): Range[] {
    const { dataset } = this.status.value;
    if (this.moving || !dataset) return this.moving ?? [];
    const ranges = rangesOf(dataset, this.view.value);
    return ranges.length > 0 ? ranges : [dataset.range];
  }

  private replaced = (index: number, range: Range): Range[] => this.current().map((one, i) => (i === index ? range : one));

  private set(to: Range[]): void {
    const { ranges } = this.view.value;
    if (ranges.length === to.length) this.view.set({ ranges: ranges.map(({ style }, i) => ({ range: to[i]!, style })) });
    else this.view.set({ range: to[0]! });
  }

  private add(): void {
    const { dataset } = this.status.value;
    const [now, { ranges, alpha }] = [this.current(), this.view.value];
    if (!dataset || now.length >= kMostRanges) return;
    const styled: readonly StyledRange[] = ranges.length > 0 ? ranges : [{ range: now[0]!, style: alpha }];
    const color = kRangeColors.find((one) => styled.every(({ style }) => style.color !== one)) ?? kRangeColors[0]!;
    this.view.set({ range: null, ranges: [...styled, { range: freeRange(dataset.values, now), style: { color, opacity: 1 } }] });
  }

  private remove(index: number): void {
    const ranges = this.view.value.ranges.filter((_, i) => i !== index);
    this.view.set(ranges.length > 1 ? { ranges } : { range: ranges[0]!.range, ranges: [] });
  }

  private move(index: number, end: End, to: number): void {
    const range = this.current()[index];
    if (!range) return;
    this.moving = this.replaced(index, boundMoved(range, end, to));
    this.preview(this.moving);
    this.show();
    this.cancelRest();
    // Moves arrive with frames: while one is drawn for longer than that, the handle may have moved on.
    this.restTimer = window.setTimeout(() => (this.restFrame = window.requestAnimationFrame(() => this.commit())), kRestMs);
  }

  private commit(): void {
    this.cancelRest();
    const { moving } = this;
    this.moving = null;
    if (moving) this.set(moving);
    this.show();
  }

  private cancelRest(): void {
    window.clearTimeout(this.restTimer);
    window.cancelAnimationFrame(this.restFrame);
  }

  private show(): void {
    const { dataset, statistics } = this.status.value;
    const [now, { ranges, render }] = [this.current(), this.view.value];
    element('range-section').hidden = !dataset?.hasRangesWithin && render !== 'volume';
    element('ranges').hidden = !dataset?.hasRangesWithin;
    setText(element('h-range'), now.length > 1 ? 'Ranges of values' : 'Range of values');
    element('histogram').hidden = !statistics;
    element('range-add').hidden = !dataset?.hasEveryRange || now.length >= kMostRanges;
    this.rows.forEach((row, i) => {
      const style: SurfaceStyle | null = now.length > 1 ? (ranges[i]?.style ?? null) : null;
      row.show(now[i] ?? null, style, statistics, dataset && statistics && now[i] ? enclosed(dataset, statistics, now[i]) : null);
    });
  }
}

function enclosed(dataset: Dataset, statistics: Statistics, range: Range): string {
  const share = enclosedShare(statistics, range);
  return `encloses ${short(share * boxVolume(dataset))} ${volumeUnit(dataset)}, ${(100 * share).toPrecision(3)} % of the box`;
}

// Bars as high as the cube root of their counts: small peaks are seen beside large ones.
function draw({ counts }: Statistics): void {
  const most = Math.cbrt(Math.max(1, ...counts));
  const bars = counts.map((n, i) => `M${i} ${kHeight}V${(kHeight * (1 - Math.cbrt(n) / most)).toFixed(2)}h1V${kHeight}z`);
  element('histogram-drawing').setAttribute('viewBox', `0 0 ${counts.length} ${kHeight}`);
  element('histogram-bars').setAttribute('d', bars.join(''));
}

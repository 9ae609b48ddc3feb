// The ranges of values that are shown. A data set of one range is shown in it; one that has more, in any range within;
// one of every range, in up to four of them. Pure functions.
import type { Dataset, Statistics } from '../package/src/datasets';
import { type Range, rangeOf } from '../package/src/ranges';
import type { ViewState } from './state';
import { clamp } from '../package/src/vec';

// The same of a view, for one range or several; none: its own range.
export function rangesOf(dataset: Dataset, { range, ranges }: Pick<ViewState, 'range' | 'ranges'>): Range[] {
  if (dataset.hasEveryRange && ranges.length > 0) return ranges.map((one) => one.range);
  const one = rangeOf(dataset, range);
  return one ? [one] : [];
}

// A range for one more: the middle of the widest part of the values that no range has.
export function freeRange([least, greatest]: Range, ranges: Range[]): Range {
  let end = least; // of what the ranges so far have
  let [from, to] = [greatest, greatest];
  for (const [low, high] of [...ranges].sort((a, b) => a[0] - b[0]).concat([[greatest, greatest]])) {
    if (low - end > to - from) [from, to] = [end, low];
    end = Math.max(end, high);
  }
  if (to <= from) [from, to] = [least, greatest];
  const step = (greatest - least) / 256 || 1;
  return [rounded(from + (to - from) / 3, step), rounded(to - (to - from) / 3, step)];
}

// The range with one bound changed; the other one follows if need be.
export function boundMoved(range: Range, end: 0 | 1, to: number): Range {
  return end === 0 ? [to, Math.max(to, range[1])] : [Math.min(to, range[0]), to];
}

// The value, off by half a step at most, with few digits. step: above 0.
export function rounded(value: number, step: number): number {
  if (Math.abs(value) <= step / 2) return 0;
  const place = (x: number) => Math.floor(Math.log10(x)); // of its first digit
  return Number(value.toPrecision(clamp(1 + place(Math.abs(value)) - place(step), 1, 17)));
}

// The share of the box, 0 to 1, in which the field is below a value, or not above it.
function share({ values, below, notAbove }: Statistics['volumes'], value: number, withEqual: boolean): number {
  const after = values.findIndex((at) => at >= value); // the first position that is not less
  if (after < 0) return 1;
  if (values[after] === value) return (withEqual ? notAbove : below)[after]!;
  if (after === 0) return 0;
  const [low, high] = [values[after - 1]!, values[after]!];
  const [from, to] = [notAbove[after - 1]!, below[after]!];
  return from + ((to - from) * (value - low)) / (high - low);
}

// The share of the box that a range encloses.
export const enclosedShare = ({ volumes }: Statistics, [low, high]: Range): number =>
  Math.max(0, share(volumes, high, true) - share(volumes, low, false));

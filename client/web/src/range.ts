// The range of values that is shown. A data set of one range is shown in it; one that has more, in any range within: then
// there are two number fields. An empty field is an infinite bound.
import { type Dataset } from './datasets';
import { element, input } from './dom';
import type { ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import { clamp } from './vec';

export type Range = [least: number, greatest: number];

// What is shown of a data set if this is asked for; null: its own range. Of every range, the upper half of the values
// unless asked otherwise.
export function rangeOf(dataset: Dataset, asked: Range | null): Range | null {
  if (!dataset.hasRangesWithin) return null;
  const [least, greatest] = dataset.values;
  const wanted: Range | null = asked ?? (dataset.hasEveryRange ? [(least + greatest) / 2, greatest] : null);
  const [low, high] = dataset.range;
  return wanted && [clamp(wanted[0], low, high), clamp(wanted[1], low, high)];
}

// The range with one bound changed; the other one follows if need be.
export function boundMoved(range: Range, end: 0 | 1, to: number): Range {
  return end === 0 ? [to, Math.max(to, range[1])] : [Math.min(to, range[0]), to];
}

export function watchRange(view: Store<ViewState>, status: Store<Status>): void {
  const fields = [input('range-low'), input('range-high')];
  const current = (): Range | null => {
    const { dataset } = status.value;
    return dataset && (rangeOf(dataset, view.value.range) ?? dataset.range);
  };
  const show = () => {
    const { dataset } = status.value;
    element('range-section').hidden = !dataset?.hasRangesWithin;
    const range = current();
    fields.forEach((field, end) => {
      const bound = range?.[end] ?? NaN;
      field.value = Number.isFinite(bound) ? String(Number(bound.toPrecision(7))) : '';
    });
  };
  fields.forEach((field, end) => {
    field.addEventListener('change', () => {
      const range = current();
      const to = field.value.trim() === '' ? (end === 0 ? -Infinity : Infinity) : field.valueAsNumber;
      if (range && !Number.isNaN(to)) view.set({ range: boundMoved(range, end === 0 ? 0 : 1, to) });
      show();
    });
  });
  view.watch(['range'], show);
  status.watch(['dataset'], show);
}

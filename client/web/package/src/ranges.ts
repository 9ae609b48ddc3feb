// Ranges of values: which of them are shown, and which values have colours. Pure functions.
import type { ChannelInfo, Dataset } from './datasets.js';
import { clamp } from './vec.js';

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

// The least and the greatest value that have colours of their own: those beyond have the colours of the ends. Unless
// asked otherwise, from the least to the greatest of the values that the ranges have and the field reaches; or all values
// of a channel. ranges: those shown; none: the data set's own.
export function spanOf(dataset: Dataset, ranges: Range[], asked: Range | null, channel: ChannelInfo | null = null): Range {
  if (asked) return asked;
  if (channel) return channel.values;
  const shown = ranges.length > 0 ? ranges : [dataset.range];
  const reached = (value: number) => clamp(value, ...dataset.values);
  return [reached(Math.min(...shown.map(([low]) => low))), reached(Math.max(...shown.map(([, high]) => high)))];
}

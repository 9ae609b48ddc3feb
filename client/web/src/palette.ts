// The palettes of the field's values, and the span of values that they colour. Pure functions.
import type { ColorMap } from './color_maps';
import type { ChannelInfo, Dataset } from './datasets';
import type { Palette } from './messages';
import type { Range } from './range';
import type { ViewState } from './state';
import { clamp } from './vec';

export interface NamedColors {
  name: string;
  colors: ColorMap; // 256
}

export function paletteOf({ name, colours }: Palette): NamedColors {
  const bytes = new Uint8Array(colours);
  const component = (i: number) => bytes[i]! / 255;
  return { name, colors: Array.from({ length: bytes.length / 3 }, (_, i) => [component(3 * i), component(3 * i + 1), component(3 * i + 2)]) };
}

// The one of this name, or else the default; null: there are none yet.
export const chosenPalette = (palettes: NamedColors[], name: string | null): NamedColors | null =>
  palettes.find((palette) => palette.name === name) ?? palettes[0] ?? null;

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

// The channel whose values are shown; null: the field's are, as in volume rendering always.
export const channelOf = (dataset: Dataset | null, { render, channel }: Pick<ViewState, 'render' | 'channel'>): ChannelInfo | null =>
  (render === 'volume' ? null : dataset?.channels.find(({ name }) => name === channel)) ?? null;

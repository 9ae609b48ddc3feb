// The palettes of the field's values, and the span of values that they colour. Pure functions.
import type { ColorMap } from './color_maps';
import type { Dataset } from './datasets';
import type { Palette } from './messages';
import { type Range, rangeOf } from './range';
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
// asked otherwise, the part of the range that the field's values reach. range: that is asked for, see rangeOf().
export function spanOf(dataset: Dataset, range: Range | null, asked: Range | null): Range {
  if (asked) return asked;
  const [low, high] = rangeOf(dataset, range) ?? dataset.range;
  return [clamp(low, ...dataset.values), clamp(high, ...dataset.values)];
}

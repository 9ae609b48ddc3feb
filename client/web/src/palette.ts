// The palettes of the field's values. Pure functions.
import type { ColorMap } from './color_maps';
import type { ChannelInfo, Dataset } from '../package/src/datasets';
import type { Palette } from '../package/src/messages';
import type { ViewState } from './state';

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

// The channel whose values are shown; null: the field's are, as in volume rendering always.
export const channelOf = (dataset: Dataset | null, { render, channel }: Pick<ViewState, 'render' | 'channel'>): ChannelInfo | null =>
  (render === 'volume' ? null : dataset?.channels.find(({ name }) => name === channel)) ?? null;

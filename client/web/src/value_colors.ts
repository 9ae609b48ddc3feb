// Colours of the values of the field or a channel: their controls, and the uniforms of the shaders.
import { DataTexture, LinearFilter } from 'three';
import type { ColorMap } from './color_maps';
import { create, element, input, onClick } from './dom';
import { shared } from './materials';
import { type Range, spanOf } from '../package/src/ranges';
import { channelOf, chosenPalette, type NamedColors } from './palette';
import { boundMoved, rangesOf } from './range';
import { type ColorBy, exclusive, showsValues, type ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';

const kChannel = 'channel:'; // begins the options of the choice that name channels

export class ValueColors {
  private fields = [input('span-low'), input('span-high')];
  private previewed: Range[] | null = null;
  private drawn: NamedColors | null = null; // in the texture

  // onChange: the picture is to be drawn again.
  constructor(private view: Store<ViewState>, private status: Store<Status>, private onChange: () => void) {
    const [by, palette] = [element<HTMLSelectElement>('color-by'), element<HTMLSelectElement>('palette')];
    by.addEventListener('change', () => {
      const [colorBy, channel] = by.value.startsWith(kChannel) ? (['value', by.value.slice(kChannel.length)] as const) : [by.value as ColorBy, null];
      view.set(exclusive({ colorBy, channel, ...(channel === view.value.channel ? {} : { span: null }) }));
    });
    palette.addEventListener('change', () => view.set({ palette: palette.value }));
    this.fields.forEach((field, end) => field.addEventListener('change', () => this.setEnd(end as 0 | 1, field.valueAsNumber)));
    onClick('span-reset', () => view.set({ span: null }));
    view.watch(['colorBy', 'channel', 'render', 'palette', 'span'], () => this.show());
    view.watch(['range', 'ranges'], () => this.preview(null));
    status.watch(['dataset'], ({ dataset }) => {
      for (const option of [...by.options].filter(({ value }) => value.startsWith(kChannel))) option.remove();
      by.append(...(dataset?.channels ?? []).map(({ name }) => create('option', { value: kChannel + name }, name)));
      this.preview(null);
    });
    status.watch(['palettes'], ({ palettes }) => {
      palette.replaceChildren(...palettes.map(({ name }) => create('option', { value: name }, name)));
      this.show();
    });
  }

  // The ranges that are shown while a handle moves; null: the view's.
  preview(ranges: Range[] | null): void {
    this.previewed = ranges;
    this.show();
  }

  // What the colour bar shows; null: there is nothing to show yet.
  get bar(): { span: Range; colors: ColorMap } | null {
    const span = this.span();
    return span && this.drawn && { span, colors: this.drawn.colors };
  }

  // Those that are shown.
  get ranges(): Range[] {
    const { dataset } = this.status.value;
    return this.previewed ?? (dataset ? rangesOf(dataset, this.view.value) : []);
  }

  private span(): Range | null {
    const { dataset } = this.status.value;
    return dataset && spanOf(dataset, this.ranges, this.view.value.span, channelOf(dataset, this.view.value));
  }

  // What is not a number leaves the end as it is.
  private setEnd(end: 0 | 1, to: number): void {
    const span = this.span();
    if (span && Number.isFinite(to)) this.view.set({ span: boundMoved(span, end, to) });
    this.show();
  }

  private show(): void {
    const { colorBy, palette, span: asked } = this.view.value;
    const channel = channelOf(this.status.value.dataset, this.view.value);
    element<HTMLSelectElement>('color-by').value = colorBy === 'value' && channel ? kChannel + channel.name : colorBy;
    element('value-controls').hidden = !showsValues(this.view.value);
    element<HTMLButtonElement>('span-reset').disabled = asked === null;
    const span = this.span();
    this.fields.forEach((field, end) => (field.value = span ? String(Number(span[end]!.toPrecision(7))) : ''));
    if (span) shared.span.value.set(span[0], 1 / Math.max(span[1] - span[0], 1e-30));
    this.usePalette(chosenPalette(this.status.value.palettes, palette));
    this.onChange();
  }

  private usePalette(palette: NamedColors | null): void {
    if (!palette || palette === this.drawn) return;
    this.drawn = palette;
    element<HTMLSelectElement>('palette').value = palette.name;
    const texels = Uint8Array.from(palette.colors.flatMap((color) => [...color, 1]), (x) => Math.round(255 * x));
    shared.palette.value?.dispose();
    shared.palette.value = new DataTexture(texels, palette.colors.length, 1);
    shared.palette.value.magFilter = shared.palette.value.minFilter = LinearFilter;
    shared.palette.value.needsUpdate = true;
  }
}

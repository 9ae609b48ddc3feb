// The probe: a label beside the pointer that tells the value of the field or of the channel that is shown, the position of
// what is drawn there, and the values of the others, which the worker finds in its mesh.
import type { ChannelInfo, Dataset } from '../package/src/datasets';
import { element, setText } from './dom';
import { withDigits } from './format';
import type { Frame } from '../package/src/frame';
import type { LiveMesh } from '../package/src/live_mesh';
import { channelOf } from './palette';
import type { Probed } from './picture';
import { rounded } from './range';
import type { ViewState } from './state';
import type { Status } from './status';
import type { Store } from './store';
import type { Viewer } from './viewer';

const kTapPixels = 8; // a finger that moves less than this taps
const kAgainMs = 250; // between questions for values that are still to come
const kOffset = 14; // of the label from the pointer, CSS pixels

export class Probe {
  private at: readonly [x: number, y: number] | null = null; // CSS pixels of the canvas; null: nothing is probed
  private found: Probed | null = null; // shown
  private others: number[] = []; // there, of the field and of the channels
  private pressed: readonly [x: number, y: number] | null = null; // where a finger or a button went down

  constructor(private view: Store<ViewState>, private status: Store<Status>, private viewer: Viewer, private mesh: LiveMesh) {
    const { canvas } = viewer.picture;
    const place = (event: PointerEvent) => [event.offsetX, event.offsetY] as const;
    canvas.addEventListener('pointermove', (event) => {
      if (event.pointerType !== 'touch' && event.buttons === 0) this.move(place(event));
    });
    canvas.addEventListener('pointerdown', (event) => {
      this.pressed = place(event);
      this.move(null);
    });
    canvas.addEventListener('pointerup', (event) => {
      const [[x, y], [fromX, fromY]] = [place(event), this.pressed ?? [Infinity, Infinity]];
      if (event.pointerType !== 'touch' || Math.hypot(x - fromX, y - fromY) < kTapPixels) this.move([x, y]);
    });
    canvas.addEventListener('pointerleave', (event) => {
      if (event.pointerType !== 'touch') this.move(null);
    });
    view.watch(['probe'], () => this.refresh());
    viewer.onProbed = (found) => this.show(found);
  }

  // The picture has changed.
  refresh(): void {
    if (!this.view.value.probe) this.show(null);
    this.viewer.probe(this.view.value.probe ? this.at : null);
  }

  private move(at: readonly [x: number, y: number] | null): void {
    this.at = at;
    if (!at) this.show(null);
    this.refresh();
  }

  private show(found: Probed | null): void {
    const label = element('probe-label');
    const [{ dataset }, { frame }] = [this.status.value, this.viewer];
    label.hidden = !found || !this.at || !dataset || !frame;
    if (label.hidden) this.found = null;
    if (!found || !this.at || !dataset || !frame) return;
    const [x, y] = this.at;
    setText(element('probe-value'), found.value === null ? '' : valueText(dataset, channelOf(dataset, this.view.value), found.value));
    setText(element('probe-position'), positionText(dataset, frame, found));
    void this.tellOthers(dataset, found);
    const { clientWidth, clientHeight } = this.viewer.picture.canvas;
    const beside = (at: number, size: number, end: number) => Math.max(0, at + kOffset + size <= end ? at + kOffset : at - kOffset - size);
    label.style.left = `${beside(x, label.offsetWidth, clientWidth)}px`;
    label.style.top = `${beside(y, label.offsetHeight, clientHeight)}px`;
  }

  // Of the field and the channels, but for the one that is shown. Those that the server still sends are asked for again.
  private async tellOthers(dataset: Dataset, found: Probed): Promise<void> {
    const shown = channelOf(dataset, this.view.value);
    const all = [null, ...dataset.channels]; // null: the field
    const tell = (values: number[]) =>
      setText(element('probe-others'), all.flatMap((one, i) => (one === shown ? [] : [valueText(dataset, one, values[i] ?? NaN)])).join('\n'));
    if (this.found?.at.some((x, i) => x !== found.at[i])) this.others = [];
    this.found = found;
    tell(this.others);
    while (all.length > 1 && this.found === found) {
      const values = await this.mesh.valuesAt(found.at).catch(() => null);
      if (!values || this.found !== found) return;
      tell((this.others = values));
      if (!values.some(Number.isNaN)) return;
      await new Promise((resolve) => setTimeout(resolve, kAgainMs));
    }
  }
}

// With the digits that single precision leaves after interpolation between values of the field. NaN: it is still to come.
function valueText(dataset: Dataset, channel: ChannelInfo | null, value: number): string {
  const { name, unit, values } = channel ?? { name: dataset.field || 'field', unit: dataset.fieldUnit, values: dataset.values };
  if (Number.isNaN(value)) return `${name} = …`;
  const step = Math.max(...values.map(Math.abs)) / 2 ** 15;
  return `${name} = ${withDigits(rounded(value, step), 6)} ${unit}`.trimEnd();
}

// To a hundredth of the distance of samples.
const positionText = ({ unit }: Dataset, { leastSpacing }: Frame, { at }: Probed): string =>
  `${at.map((x) => withDigits(rounded(x, leastSpacing / 100), 15)).join(', ')} ${unit}`.trimEnd();

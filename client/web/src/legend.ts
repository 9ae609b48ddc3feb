// The legend (a colour bar), where colours show values of the field or a channel, thickness or levels of detail.
import { type ColorMap, kLevelColors, kThicknessColors } from './color_maps';
import type { Dataset } from '../package/src/datasets';
import { element } from './dom';
import { short } from './format';
import { channelOf } from './palette';
import type { Range } from '../package/src/ranges';
import { showsValues, type ViewState } from './state';
import type { Thickness } from './thickness';

let drawn: ColorMap | null = null; // in the legend's bar

// bar: of values; null: not known yet.
export function showLegend(
  view: Readonly<ViewState>,
  { isAvailable, isKnown, maximum }: Thickness,
  dataset: Dataset | null,
  bar: { span: Range; colors: ColorMap } | null,
): void {
  const showsThickness = view.thickness && isAvailable;
  const values = showsValues(view) ? bar : null;
  element('legend').hidden = !showsThickness && !view.levels && !values;
  if (values) {
    const [low, high] = values.span;
    const channel = channelOf(dataset, view);
    const title = (channel ? [channel.name, channel.unit] : [dataset?.field || 'Field', dataset?.fieldUnit]).filter(Boolean).join(', ');
    fill(title, [low, (low + high) / 2, high].map(short), values.colors);
  } else if (showsThickness) {
    const labels = isKnown ? ['0', short(maximum / 2), `${short(maximum)} or more`] : ['0', '', ''];
    fill(`Thickness along the line of sight, ${dataset?.unit || 'world units'}`, labels, kThicknessColors);
  } else if (view.levels) {
    fill('Level of detail', ['finest', '', 'coarsest'], kLevelColors);
  }
}

function fill(title: string, labels: string[], colors: ColorMap): void {
  element('legend-title').textContent = title;
  ['low', 'middle', 'high'].forEach((name, i) => (element(`legend-${name}`).textContent = labels[i]!));
  if (colors === drawn) return;
  drawn = colors;
  const canvas = element<HTMLCanvasElement>('legend-ramp');
  const context = canvas.getContext('2d');
  if (!context) return;
  const gradient = context.createLinearGradient(0, 0, canvas.width, 0);
  colors.forEach(([r, g, b], i) => gradient.addColorStop(i / (colors.length - 1), `rgb(${r * 255} ${g * 255} ${b * 255})`));
  context.fillStyle = gradient;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

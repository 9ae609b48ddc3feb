// The legend (a colour bar), where colours show thickness or levels of detail.
import { type ColorMap, kLevelColors, kThicknessColors } from './color_maps';
import { element } from './dom';
import { short } from './format';
import type { ViewState } from './state';
import type { Thickness } from './thickness';

// unit: of length.
export function showLegend(view: Readonly<ViewState>, { isAvailable, isKnown, maximum }: Thickness, unit: string): void {
  const showsThickness = view.thickness && isAvailable;
  element('legend').hidden = !showsThickness && !view.levels;
  if (showsThickness) {
    const labels = isKnown ? ['0', short(maximum / 2), `${short(maximum)} or more`] : ['0', '', ''];
    fill(`Thickness along the line of sight, ${unit}`, labels, kThicknessColors);
  } else if (view.levels) {
    fill('Level of detail', ['finest', '', 'coarsest'], kLevelColors);
  }
}

function fill(title: string, labels: string[], colors: ColorMap): void {
  element('legend-title').textContent = title;
  ['low', 'middle', 'high'].forEach((name, i) => (element(`legend-${name}`).textContent = labels[i]!));
  const canvas = element<HTMLCanvasElement>('legend-ramp');
  const context = canvas.getContext('2d');
  if (!context) return;
  const gradient = context.createLinearGradient(0, 0, canvas.width, 0);
  colors.forEach(([r, g, b], i) => gradient.addColorStop(i / (colors.length - 1), `rgb(${r * 255} ${g * 255} ${b * 255})`));
  context.fillStyle = gradient;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

// The legend (a colour bar), where colours show thickness or levels of detail.
import { type ColorMap, kLevelColors, kThicknessColors } from './color_maps';
import { element } from './dom';
import { short } from './format';
import type { ViewState } from './state';

// maxThickness: world units at the end of the colour map.
export function showLegend(view: Readonly<ViewState>, maxThickness: number): void {
  const shown = view.thickness ? 'thickness' : view.levels ? 'levels' : null;
  element('legend').hidden = shown === null;
  if (!shown) return;
  const put = (id: string, text: string) => (element(id).textContent = text);
  put('legend-title', shown === 'thickness' ? 'Thickness along the line of sight, world units' : 'Level of detail');
  put('legend-low', shown === 'thickness' ? '0' : 'finest');
  put('legend-middle', shown === 'thickness' ? short(maxThickness / 2) : '');
  put('legend-high', shown === 'thickness' ? `${short(maxThickness)} or more` : 'coarsest');
  paint(shown === 'thickness' ? kThicknessColors : kLevelColors);
}

function paint(colors: ColorMap): void {
  const canvas = element<HTMLCanvasElement>('legend-ramp');
  const context = canvas.getContext('2d');
  if (!context) return;
  const gradient = context.createLinearGradient(0, 0, canvas.width, 0);
  colors.forEach(([r, g, b], i) => gradient.addColorStop(i / (colors.length - 1), `rgb(${r * 255} ${g * 255} ${b * 255})`));
  context.fillStyle = gradient;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

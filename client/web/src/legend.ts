// What colours stand for, where they stand for something: thickness, or levels of detail.
import { element } from './dom';
import { short } from './format';
import { kLevelRamp, kThicknessRamp, type Ramp } from './shaders';
import type { ViewState } from './state';

export function showLegend(view: Readonly<ViewState>, thicknessMost: number): void {
  const shown = view.thickness ? 'thickness' : view.levels ? 'levels' : null;
  element('legend').hidden = shown === null;
  if (!shown) return;
  const say = (id: string, text: string) => (element(id).textContent = text);
  say('legend-title', shown === 'thickness' ? 'Thickness along the line of sight, units' : 'Level of detail');
  say('legend-low', shown === 'thickness' ? '0' : 'finest');
  say('legend-middle', shown === 'thickness' ? short(thicknessMost / 2) : '');
  say('legend-high', shown === 'thickness' ? `${short(thicknessMost)} or more` : 'coarsest');
  paint(shown === 'thickness' ? kThicknessRamp : kLevelRamp);
}

function paint(stops: Ramp): void {
  const canvas = element<HTMLCanvasElement>('legend-ramp');
  const context = canvas.getContext('2d');
  if (!context) return;
  const ramp = context.createLinearGradient(0, 0, canvas.width, 0);
  stops.forEach(([r, g, b], i) => ramp.addColorStop(i / (stops.length - 1), `rgb(${r * 255} ${g * 255} ${b * 255})`));
  context.fillStyle = ramp;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

// What colours stand for, where they stand for something: thickness, or levels of detail.
import { element } from './dom';
import { short } from './format';
import { kRamp } from './shaders';
import type { ViewState } from './state';

type Rgb = readonly [number, number, number];

// The same stops as the picture's shader has.
const kInferno: Rgb[] = [
  [0.02, 0.02, 0.1],
  [0.13, 0.05, 0.3],
  [0.34, 0.06, 0.43],
  [0.54, 0.13, 0.42],
  [0.74, 0.21, 0.33],
  [0.9, 0.36, 0.2],
  [0.98, 0.55, 0.04],
  [0.98, 0.78, 0.17],
  [0.97, 0.98, 0.62],
];

export function showLegend(view: Readonly<ViewState>, thicknessMost: number): void {
  const shown = view.thickness ? 'thickness' : view.levels ? 'levels' : null;
  element('legend').hidden = shown === null;
  if (!shown) return;
  const say = (id: string, text: string) => (element(id).textContent = text);
  say('legend-title', shown === 'thickness' ? 'Thickness along the line of sight, units' : 'Level of detail');
  say('legend-low', shown === 'thickness' ? '0' : 'finest');
  say('legend-middle', shown === 'thickness' ? short(thicknessMost / 2) : '');
  say('legend-high', shown === 'thickness' ? `${short(thicknessMost)} or more` : 'coarsest');
  paint(shown === 'thickness' ? kInferno : kRamp);
}

function paint(stops: readonly Rgb[]): void {
  const canvas = element<HTMLCanvasElement>('legend-ramp');
  const context = canvas.getContext('2d');
  if (!context) return;
  const ramp = context.createLinearGradient(0, 0, canvas.width, 0);
  stops.forEach(([r, g, b], i) => ramp.addColorStop(i / (stops.length - 1), `rgb(${r * 255} ${g * 255} ${b * 255})`));
  context.fillStyle = ramp;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

// How opaque values are in volume rendering, and what rays are drawn with. Pure functions, as those of the native program
// (common/view/transfer_function.h).
import type { ColorMap } from './color_maps';
import type { Range } from '../package/src/ranges';
import { clamp } from '../package/src/vec';

// A value, and the opacity of a hundredth of the box's diagonal that is filled with it: 0 lets all light pass, 1 none.
export interface OpacityPoint {
  value: number;
  opacity: number;
}
// Linear between its points, of which there is at least one; constant beyond the first and the last. Values ascend.
export type OpacityCurve = readonly OpacityPoint[];

export const kMostPoints = 256;
const kMostByDefault = 0.3;

// From nothing at the least value to as much at the greatest as shows what is behind, too. low < high.
export const defaultOpacity = ([low, high]: Range): OpacityCurve => [{ value: low, opacity: 0 }, { value: high, opacity: kMostByDefault }];

export const writeOpacity = (curve: OpacityCurve): string => curve.map(({ value, opacity }) => `${value}:${opacity}`).join(',');

// "VALUE:OPACITY,VALUE:OPACITY,..."; null if it is not valid.
export function readOpacity(text: string | null): OpacityCurve | null {
  if (!text) return null;
  const numbers = text.split(',').map((point) => point.split(':').map((word) => (word.trim() === '' ? NaN : Number(word))));
  const curve = numbers.map(([value, opacity]) => ({ value: value!, opacity: opacity! }));
  const isValid = ({ value, opacity }: OpacityPoint, i: number) =>
    numbers[i]!.length === 2 && Number.isFinite(value) && opacity >= 0 && opacity <= 1 && (i === 0 || curve[i - 1]!.value < value);
  return curve.length <= kMostPoints && curve.every(isValid) ? curve : null;
}

export function opacityAt(curve: OpacityCurve, value: number): number {
  const after = curve.findIndex((point) => point.value > value);
  if (after === 0) return curve[0]!.opacity;
  if (after < 0) return curve.at(-1)!.opacity;
  const [low, high] = [curve[after - 1]!, curve[after]!];
  return low.opacity + ((value - low.value) / (high.value - low.value)) * (high.opacity - low.opacity);
}

// With a point moved, but not past its neighbours, of which it stays `apart`.
export function pointMoved(curve: OpacityCurve, index: number, { value, opacity }: OpacityPoint, apart: number): OpacityCurve {
  const least = (curve[index - 1]?.value ?? -Infinity) + apart;
  const most = (curve[index + 1]?.value ?? Infinity) - apart;
  const moved = { value: least < most ? clamp(value, least, most) : curve[index]!.value, opacity: clamp(opacity, 0, 1) };
  return curve.map((point, i) => (i === index ? moved : point));
}

// With one more point; as it is if there is one of this value, or no room.
export function pointAdded(curve: OpacityCurve, added: OpacityPoint): OpacityCurve {
  if (curve.length >= kMostPoints || curve.some(({ value }) => value === added.value)) return curve;
  return [...curve, { ...added, opacity: clamp(added.opacity, 0, 1) }].sort((a, b) => a.value - b.value);
}

// One point stays.
export const pointRemoved = (curve: OpacityCurve, index: number): OpacityCurve => (curve.length > 1 ? curve.filter((_, i) => i !== index) : curve);

export const kCells = 1024; // of a table; the same number as in kVolumeFragment
const kMostOpacity = 1 - 1e-6; // absorption is 13.8 then
const kGamma = 2.2; // as in kVolumeCompositeFragment

// What a ray meets in values.
export interface Look {
  values: Range; // of the table's ends; low < high
  opacity: OpacityCurve;
  colors: ColorMap;
  span: Range; // the values of the first and the last colour
}

// Rates of emission (red, green, blue; linear colours) and absorption (alpha), for a hundredth of the box's diagonal, at
// kCells + 1 values at equal distances; then their integrals from the first of these values on, each cell 1 / kCells
// long. hidden: values that neither emit nor absorb, since others show them.
export function transferTable({ values: [low, high], opacity, colors, span }: Look, hidden: readonly Range[]): Float32Array {
  const table = new Float32Array(8 * (kCells + 1));
  const sum = [0, 0, 0, 0];
  let last = [0, 0, 0, 0];
  for (let i = 0; i <= kCells; ++i) {
    const value = low + (i / kCells) * (high - low);
    const isHidden = hidden.some(([least, greatest]) => least <= value && value <= greatest);
    const absorption = isHidden ? 0 : -Math.log1p(-Math.min(opacityAt(opacity, value), kMostOpacity));
    const rates = [...colorAt(colors, span, value).map((channel) => absorption * channel ** kGamma), absorption];
    rates.forEach((rate, k) => {
      if (i > 0) sum[k]! += (last[k]! + rate) / (2 * kCells);
      table[4 * i + k] = rate;
      table[4 * (kCells + 1 + i) + k] = sum[k]!;
    });
    last = rates;
  }
  return table;
}

function colorAt(colors: ColorMap, [low, high]: Range, value: number): number[] {
  const x = (low < high ? clamp((value - low) / (high - low), 0, 1) : 0.5) * (colors.length - 1);
  const i = Math.min(Math.floor(x), colors.length - 2);
  return [0, 1, 2].map((k) => colors[i]![k]! + (x - i) * (colors[i + 1]![k]! - colors[i]![k]!));
}

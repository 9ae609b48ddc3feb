// Numbers as text for the page. Pure functions.

const kGrouped = new Intl.NumberFormat('en', { maximumFractionDigits: 0 });

// 12,345 and, from a million on, 1.23 million.
export function count(n: number): string {
  return n < 1e6 ? kGrouped.format(n) : n < 1e9 ? `${short(n / 1e6)} million` : `${short(n / 1e9)} billion`;
}

// 12.3 MB: decimal units.
export function bytes(n: number): string {
  if (n < 1000) return `${Math.round(n)} B`;
  const power = Math.min(3, Math.floor(Math.log10(n) / 3));
  return `${short(n / 10 ** (3 * power))} ${['', 'kB', 'MB', 'GB'][power]}`;
}

// Three significant digits; from 1,000 on, rounded to an integer; below 1e-3 and from 1e7 on, with an exponent; ±∞; ?
// for NaN.
export function short(x: number): string {
  if (!Number.isFinite(x)) return x > 0 ? '∞' : x < 0 ? '−∞' : '?';
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-3 || size >= 1e7)) return signed(x.toExponential(2));
  return signed(size >= 1000 ? kGrouped.format(Math.round(x)) : String(Number(x.toPrecision(3))));
}

const signed = (text: string): string => text.replace(/^-/, '−');

// With n significant digits at most, and no grouping.
export const withDigits = (x: number, n: number): string => signed(String(Number(x.toPrecision(n))));

// A value and the bound of its error, with the digits that are significant: "123,400 ± 300". bound 0, or not known
// (null): the value only.
export function bounded(value: number, bound: number | null): string {
  if (bound === null || !(bound > 0)) return digits(value, 6);
  const significant = value === 0 ? 1 : Math.ceil(Math.log10(Math.abs(value) / bound)) + 1;
  return `${digits(value, Math.min(7, Math.max(1, significant)))} ± ${digits(bound, 1)}`;
}

function digits(x: number, n: number): string {
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-3 || size >= 1e7)) {
    const [mantissa, exponent] = x.toExponential(n - 1).split('e');
    return `${signed(mantissa!)} × 10${superscript(Number(exponent))}`;
  }
  const rounded = Number(x.toPrecision(n));
  return signed(Math.abs(rounded) >= 1000 ? kGrouped.format(rounded) : String(rounded));
}

function superscript(n: number): string {
  return [...String(n)].map((c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[Number(c)]!)).join('');
}

const kRound = [1, 1.5, 2, 3, 4, 5, 6, 8, 10];

// The least round number (kRound times a power of ten) that is not less than x. x: above 0.
export function roundUp(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * kRound.find((round) => x <= round * power * (1 + 1e-12))!;
}

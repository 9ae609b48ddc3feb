// Vectors of three doubles, and boxes: for cameras and planes.
import type { Affine, Box, Vec3 } from './messages.js';

export const kAxes: readonly Vec3[] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
export const clamp = (x: number, least: number, greatest: number): number => Math.min(greatest, Math.max(least, x));

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);

// p + t * direction.
export const along = (p: Vec3, direction: Vec3, t: number): Vec3 => add(p, scale(direction, t));

// Of length 1; `fallback` where a is zero or not finite.
export function unit(a: Vec3, fallback: Vec3 = [0, 0, 1]): Vec3 {
  const l = length(a);
  return l > 0 && Number.isFinite(l) ? scale(a, 1 / l) : fallback;
}

// v rotated about an axis of length 1 by an angle in radians, right-handed (Rodrigues' formula).
export function rotated(v: Vec3, axis: Vec3, angle: number): Vec3 {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

// The affine's image of a point.
export function applied(m: Affine, p: Vec3): Vec3 {
  const row = (i: number) => m[i]! * p[0] + m[i + 1]! * p[1] + m[i + 2]! * p[2] + m[i + 3]!;
  return [row(0), row(4), row(8)];
}

// The box around some points.
export function boxAround(points: Vec3[]): Box {
  const over = (pick: (...numbers: number[]) => number) => [0, 1, 2].map((i) => pick(...points.map((p) => p[i]!))) as Vec3;
  return { min: over(Math.min), max: over(Math.max) };
}

export const center = (b: Box): Vec3 => scale(add(b.min, b.max), 0.5);
export const diagonal = (b: Box): number => length(sub(b.max, b.min));

// The eight corners: bit i of a corner's index selects max on axis i.
export function corners(b: Box): Vec3[] {
  return Array.from({ length: 8 }, (_, i): Vec3 => [i & 1 ? b.max[0] : b.min[0], i & 2 ? b.max[1] : b.min[1], i & 4 ? b.max[2] : b.min[2]]);
}

// The twelve edges of a box, as pairs of corner indices: those that differ in one bit.
export const kBoxEdges: readonly [number, number][] = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) =>
  [1, 2, 4].filter((bit) => !(i & bit)).map((bit): [number, number] => [i, i | bit]),
);

// The edges as pairs of points.
export function boxOutline(box: Box): Vec3[] {
  const c = corners(box);
  return kBoxEdges.flatMap(([a, b]) => [c[a]!, c[b]!]);
}

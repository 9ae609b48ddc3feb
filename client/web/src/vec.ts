// Three numbers as a vector, in doubles: what cameras, planes and boxes are made of.
import type { Box, Vec3 } from './messages';

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const along = (p: Vec3, direction: Vec3, t: number): Vec3 => [p[0] + direction[0] * t, p[1] + direction[1] * t, p[2] + direction[2] * t];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const middle = (b: Box): Vec3 => [(b.min[0] + b.max[0]) / 2, (b.min[1] + b.max[1]) / 2, (b.min[2] + b.max[2]) / 2];
export const diagonal = (b: Box): number => length(sub(b.max, b.min));

// Of length 1; `otherwise` where a has no direction.
export function unit(a: Vec3, otherwise: Vec3 = [0, 0, 1]): Vec3 {
  const l = length(a);
  return l > 0 && Number.isFinite(l) ? scale(a, 1 / l) : otherwise;
}

// v turned about an axis of length 1, by the right hand (Rodrigues).
export function turned(v: Vec3, axis: Vec3, angle: number): Vec3 {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

// The eight corners of a box; bit i of the number says which end on axis i.
export function corners(b: Box): Vec3[] {
  return Array.from({ length: 8 }, (_, i): Vec3 => [i & 1 ? b.max[0] : b.min[0], i & 2 ? b.max[1] : b.min[1], i & 4 ? b.max[2] : b.min[2]]);
}

// Pairs of corners that differ in one bit: a box's edges.
export const kBoxEdges: readonly [number, number][] = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) =>
  [1, 2, 4].filter((bit) => !(i & bit)).map((bit): [number, number] => [i, i | bit]),
);

// Planes that cut a box: pure geometry. What lies on the normal's side of a plane is cut away; normals have length 1.
import type { Box, Plane, Vec3 } from './messages';
import { add, along, corners, diagonal, dot, kBoxEdges, middle, scale, sub, unit } from './vec';

const kArm = 0.18; // of the box's diagonal: how far the handle that turns is from the one that moves

// The least and the greatest offset at which a plane with this normal touches the box.
export function extent(box: Box, normal: Vec3): [number, number] {
  const offsets = corners(box).map((corner) => dot(normal, corner));
  return [Math.min(...offsets), Math.max(...offsets)];
}

export const throughMiddle = (box: Box, normal: Vec3): Plane => ({ normal: unit(normal), offset: dot(unit(normal), middle(box)) });

// Where a plane is held: the point of it that is nearest to the middle of the box; and the tip of its normal.
export const holdOf = (box: Box, plane: Plane): Vec3 => along(middle(box), plane.normal, plane.offset - dot(plane.normal, middle(box)));
export const tipOf = (box: Box, plane: Plane): Vec3 => along(holdOf(box, plane), plane.normal, kArm * diagonal(box));

// Moved so far that it touches the box.
export function clamped(box: Box, plane: Plane): Plane {
  const [least, most] = extent(box, plane.normal);
  return { normal: plane.normal, offset: Math.min(most, Math.max(least, plane.offset)) };
}

// Turned about where it is held, so that its normal points to where `tip` lies from there.
export function turnedTo(box: Box, plane: Plane, tip: Vec3): Plane {
  const hold = holdOf(box, plane);
  const normal = unit(sub(tip, hold), plane.normal);
  return clamped(box, { normal, offset: dot(normal, hold) });
}

// The axis that v is nearest to, on v's side.
export function mainAxis(v: Vec3): Vec3 {
  const i = [0, 1, 2].reduce((best, axis) => (Math.abs(v[axis]!) > Math.abs(v[best]!) ? axis : best), 0);
  return [0, 1, 2].map((axis) => (axis === i ? Math.sign(v[i]!) || 1 : 0)) as Vec3;
}

// Pairs of points: the sides of the polygon that plane and box have in common.
export function cutOutline(box: Box, plane: Plane): Vec3[] {
  const c = corners(box);
  const points: { p: Vec3; edge: readonly [number, number] }[] = [];
  for (const edge of kBoxEdges) {
    const [from, to] = [c[edge[0]]!, c[edge[1]]!];
    const [a, b] = [dot(plane.normal, from) - plane.offset, dot(plane.normal, to) - plane.offset];
    if (a > 0 !== b > 0) points.push({ p: add(from, scale(sub(to, from), a / (a - b))), edge });
  }
  // Two cut edges that lie on the same face are joined. A face is an axis and an end of it.
  const faces = ([i, j]: readonly [number, number]) => [1, 2, 4].filter((bit) => (i & bit) === (j & bit)).map((bit) => bit * 8 + (i & bit));
  return points.flatMap((a, i) => points.slice(i + 1).flatMap((b) => (faces(a.edge).some((face) => faces(b.edge).includes(face)) ? [a.p, b.p] : [])));
}

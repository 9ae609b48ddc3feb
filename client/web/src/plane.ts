// Planes that cut a box: pure geometry. Normals have length 1; what lies on the normal's side of a plane is cut away.
// World coordinates.
import type { Box, Plane, Vec3 } from '../package/src/messages';
import { add, along, center, clamp, corners, diagonal, dot, kBoxEdges, scale, sub, unit } from '../package/src/vec';

const kNormalLength = 0.18; // of the drawn normal, as a fraction of the box's diagonal

// The least and the greatest offset of a plane with this normal that touches the box.
export function offsetRange(box: Box, normal: Vec3): [number, number] {
  const offsets = corners(box).map((corner) => dot(normal, corner));
  return [Math.min(...offsets), Math.max(...offsets)];
}

export const throughCenter = (box: Box, normal: Vec3): Plane => ({ normal: unit(normal), offset: dot(unit(normal), center(box)) });

// The point of the plane that is nearest to the centre of the box: where the handle that moves the plane is.
export const handlePosition = (box: Box, plane: Plane): Vec3 => along(center(box), plane.normal, plane.offset - dot(plane.normal, center(box)));

// The tip of the drawn normal: where the handle that rotates the plane is.
export const normalTip = (box: Box, plane: Plane): Vec3 => along(handlePosition(box, plane), plane.normal, kNormalLength * diagonal(box));

// Moved along its normal until it touches the box, if it does not.
export function clamped(box: Box, plane: Plane): Plane {
  return { normal: plane.normal, offset: clamp(plane.offset, ...offsetRange(box, plane.normal)) };
}

// Rotated about its handle, so that its normal points to `tip`; then clamped.
export function rotatedTowards(box: Box, plane: Plane, tip: Vec3): Plane {
  const handle = handlePosition(box, plane);
  const normal = unit(sub(tip, handle), plane.normal);
  return clamped(box, { normal, offset: dot(normal, handle) });
}

// 1 or -1: times the normal, a direction that points the way of the axis nearest to it. A plane's position is given along
// that, so that it is the same for both of its normals, and on an axis the coordinate there.
export const facing = (normal: Vec3): 1 | -1 => (dot(normal, mainAxis(normal).map(Math.abs) as Vec3) < 0 ? -1 : 1);

// The signed unit axis nearest to v.
export function mainAxis(v: Vec3): Vec3 {
  const i = [0, 1, 2].reduce((best, axis) => (Math.abs(v[axis]!) > Math.abs(v[best]!) ? axis : best), 0);
  return [0, 1, 2].map((axis) => (axis === i ? Math.sign(v[i]!) || 1 : 0)) as Vec3;
}

// The polygon in which the plane cuts the box: its sides as pairs of points, in no order.
export function planeOutline(box: Box, plane: Plane): Vec3[] {
  const c = corners(box);
  const points: { p: Vec3; edge: readonly [number, number] }[] = [];
  for (const edge of kBoxEdges) {
    const [from, to] = [c[edge[0]]!, c[edge[1]]!];
    const [a, b] = [dot(plane.normal, from) - plane.offset, dot(plane.normal, to) - plane.offset];
    if (a > 0 !== b > 0) points.push({ p: add(from, scale(sub(to, from), a / (a - b))), edge });
  }
  // Two cut edges of the same face are joined. A face is named by its axis and the end of that axis.
  const faces = ([i, j]: readonly [number, number]) => [1, 2, 4].filter((bit) => (i & bit) === (j & bit)).map((bit) => bit * 8 + (i & bit));
  const sharesFace = (a: readonly [number, number], b: readonly [number, number]) => faces(a).some((face) => faces(b).includes(face));
  return points.flatMap((a, i) => points.slice(i + 1).flatMap((b) => (sharesFace(a.edge, b.edge) ? [a.p, b.p] : [])));
}

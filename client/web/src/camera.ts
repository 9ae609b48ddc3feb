// Where one looks from, and how it moves: pure functions. A camera looks from eye to lookAt; up need not be perpendicular to that.
import type { Box, Vec3 } from './messages';
import { add, along, corners, cross, dot, length, middle, scale, sub, turned, unit } from './vec';

export interface Pose {
  eye: Vec3;
  lookAt: Vec3;
  up: Vec3;
  fov: number; // vertical, degrees
}

export const kFov = 30;
const kFill = 0.94; // of the picture, by the box

// Right, up and back, perpendicular and of length 1.
export function axes(pose: Pose): { right: Vec3; up: Vec3; back: Vec3 } {
  const back = unit(sub(pose.eye, pose.lookAt));
  const aside = cross(pose.up, back);
  const right = unit(length(aside) > 1e-9 * length(pose.up) ? aside : cross([back[1], back[2], back[0]], back), [1, 0, 0]);
  return { right, up: cross(back, right), back };
}

// The whole box in the picture, seen from above one of its corners. aspect: width over height.
export function fitted(box: Box, aspect: number, towards: Vec3 = [0.62, -1, 0.52]): Pose {
  const half = Math.tan((kFov * Math.PI) / 360) * kFill;
  const lookAt = middle(box);
  const back = unit(towards);
  const pose: Pose = { eye: add(lookAt, back), lookAt, up: Math.abs(back[2]) > 0.99 ? [0, 1, 0] : [0, 0, 1], fov: kFov };
  const a = axes(pose);
  const distances = corners(box).map((corner) => {
    const c = sub(corner, lookAt);
    return dot(back, c) + Math.max(Math.abs(dot(a.right, c)) / aspect, Math.abs(dot(a.up, c))) / half;
  });
  return { ...pose, eye: along(lookAt, back, Math.max(...distances) || 1) };
}

// World units that one pixel is at the distance of lookAt.
export function unitsPerPixel(pose: Pose, height: number): number {
  return (2 * length(sub(pose.eye, pose.lookAt)) * Math.tan((pose.fov * Math.PI) / 360)) / Math.max(1, height);
}

// Turns about lookAt: by `right` radians about up, by `down` about what points to the right. Without poles: up turns too.
export function orbited(pose: Pose, right: number, down: number): Pose {
  const a = axes(pose);
  const spin = (v: Vec3): Vec3 => turned(turned(v, a.up, -right), a.right, -down);
  return { ...pose, eye: add(pose.lookAt, spin(sub(pose.eye, pose.lookAt))), up: spin(a.up) };
}

// Rolls the picture, by the left hand seen from the eye.
export function rolled(pose: Pose, angle: number): Pose {
  const a = axes(pose);
  return { ...pose, up: turned(a.up, a.back, angle) };
}

// Moves the scene along with the picture, by pixels.
export function panned(pose: Pose, right: number, down: number, height: number): Pose {
  const a = axes(pose);
  const unitsHere = unitsPerPixel(pose, height);
  const by = add(scale(a.right, -right * unitsHere), scale(a.up, down * unitsHere));
  return { ...pose, eye: add(pose.eye, by), lookAt: add(pose.lookAt, by) };
}

// Nearer by a factor (below 1) or farther. at: the point in the picture that stays, in pixels from the middle, right and down.
export function zoomed(pose: Pose, factor: number, at: [number, number], height: number): Pose {
  const a = axes(pose);
  const unitsHere = unitsPerPixel(pose, height);
  const fixed = add(pose.lookAt, add(scale(a.right, at[0] * unitsHere), scale(a.up, -at[1] * unitsHere)));
  const lookAt = along(fixed, sub(pose.lookAt, fixed), factor);
  return { ...pose, lookAt, eye: along(lookAt, sub(pose.eye, pose.lookAt), factor) };
}

// A point in the picture: pixels right and down from the upper left corner, and its depth ahead of the eye (0 or less: behind).
export function projected(pose: Pose, p: Vec3, width: number, height: number): { x: number; y: number; depth: number } {
  const a = axes(pose);
  const d = sub(p, pose.eye);
  const depth = -dot(a.back, d);
  const perUnit = height / 2 / Math.tan((pose.fov * Math.PI) / 360) / Math.max(depth, 1e-12);
  return { x: width / 2 + dot(a.right, d) * perUnit, y: height / 2 - dot(a.up, d) * perUnit, depth };
}

// The direction from the eye through a pixel, of length 1.
export function rayThrough(pose: Pose, x: number, y: number, width: number, height: number): Vec3 {
  const a = axes(pose);
  const perPixel = (2 * Math.tan((pose.fov * Math.PI) / 360)) / height;
  return unit(add(scale(a.back, -1), add(scale(a.right, (x - width / 2) * perPixel), scale(a.up, (height / 2 - y) * perPixel))));
}

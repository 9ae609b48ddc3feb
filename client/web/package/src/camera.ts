// Cameras and how they move: pure functions, world coordinates. Pixels are CSS pixels of the canvas.
import type { Box, Vec3 } from './messages.js';
import { add, along, center, corners, cross, dot, length, rotated, scale, sub, unit } from './vec.js';

// A camera at eye that looks at lookAt; up need not be perpendicular to that direction.
export interface Pose {
  eye: Vec3;
  lookAt: Vec3;
  up: Vec3;
  fov: number; // vertical, degrees
}

export const kFov = 30;
const kFill = 0.94; // fraction of the picture that fitted() lets the box fill

// The camera's axes: perpendicular, of length 1.
export function axes(pose: Pose): { right: Vec3; up: Vec3; back: Vec3 } {
  const back = unit(sub(pose.eye, pose.lookAt));
  const side = cross(pose.up, back);
  const right = unit(length(side) > 1e-9 * length(pose.up) ? side : cross([back[1], back[2], back[0]], back), [1, 0, 0]);
  return { right, up: cross(back, right), back };
}

const tanHalfFov = (pose: Pose): number => Math.tan((pose.fov * Math.PI) / 360);

// The vector with these lengths along the camera's right and up axes.
export function inViewPlane(pose: Pose, right: number, up: number): Vec3 {
  const a = axes(pose);
  return add(scale(a.right, right), scale(a.up, up));
}

// v without its component along the direction of view.
export function ontoViewPlane(pose: Pose, v: Vec3): Vec3 {
  const a = axes(pose);
  return inViewPlane(pose, dot(a.right, v), dot(a.up, v));
}

// A camera that shows the whole box. aspect: width over height.
export function fitted(box: Box, aspect: number): Pose {
  const lookAt = center(box);
  const back = unit([0.62, -1, 0.52]);
  const pose: Pose = { eye: add(lookAt, back), lookAt, up: [0, 0, 1], fov: kFov };
  const a = axes(pose);
  const half = tanHalfFov(pose) * kFill;
  const distances = corners(box).map((corner) => {
    const c = sub(corner, lookAt);
    return dot(back, c) + Math.max(Math.abs(dot(a.right, c)) / aspect, Math.abs(dot(a.up, c))) / half;
  });
  return { ...pose, eye: along(lookAt, back, Math.max(...distances) || 1) };
}

// World units per pixel at the distance of lookAt. height: of the canvas.
export function unitsPerPixel(pose: Pose, height: number): number {
  return (2 * length(sub(pose.eye, pose.lookAt)) * tanHalfFov(pose)) / Math.max(1, height);
}

// Rotates about lookAt: by `right` radians about up, by `down` radians about the right axis. up rotates too, so there
// are no poles.
export function orbited(pose: Pose, right: number, down: number): Pose {
  const a = axes(pose);
  const rotate = (v: Vec3): Vec3 => rotated(rotated(v, a.up, -right), a.right, -down);
  return { ...pose, eye: add(pose.lookAt, rotate(sub(pose.eye, pose.lookAt))), up: rotate(a.up) };
}

// Rotates about the direction of view, by radians; the scene turns clockwise.
export function rolled(pose: Pose, angle: number): Pose {
  const a = axes(pose);
  return { ...pose, up: rotated(a.up, a.back, angle) };
}

// Moves the scene by pixels, right and down.
export function panned(pose: Pose, right: number, down: number, height: number): Pose {
  const perPixel = unitsPerPixel(pose, height);
  const by = inViewPlane(pose, -right * perPixel, down * perPixel);
  return { ...pose, eye: add(pose.eye, by), lookAt: add(pose.lookAt, by) };
}

// Scales the distance from lookAt by a factor (below 1: nearer). at: the point of the picture that does not move, in
// pixels right and down from its centre.
export function zoomed(pose: Pose, factor: number, at: [number, number], height: number): Pose {
  const perPixel = unitsPerPixel(pose, height);
  const fixed = add(pose.lookAt, inViewPlane(pose, at[0] * perPixel, -at[1] * perPixel));
  const lookAt = along(fixed, sub(pose.lookAt, fixed), factor);
  return { ...pose, lookAt, eye: along(lookAt, sub(pose.eye, pose.lookAt), factor) };
}

// A point in the picture: pixels from the upper left corner, and the depth in front of the eye (0 or less: behind it).
export function projected(pose: Pose, p: Vec3, width: number, height: number): { x: number; y: number; depth: number } {
  const a = axes(pose);
  const d = sub(p, pose.eye);
  const depth = -dot(a.back, d);
  const perUnit = height / 2 / tanHalfFov(pose) / Math.max(depth, 1e-12);
  return { x: width / 2 + dot(a.right, d) * perUnit, y: height / 2 - dot(a.up, d) * perUnit, depth };
}

// The direction from the eye through a pixel, of length 1.
export function rayThrough(pose: Pose, x: number, y: number, width: number, height: number): Vec3 {
  const perPixel = (2 * tanHalfFov(pose)) / height;
  return unit(sub(inViewPlane(pose, (x - width / 2) * perPixel, (height / 2 - y) * perPixel), axes(pose).back));
}

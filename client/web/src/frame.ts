// The coordinate frame of the graphics card ("drawing space"): world coordinates relative to the centre of the data, so
// that float32 is precise enough wherever the data lies.
import type { Dataset } from './datasets';
import type { Box, Plane, Vec3 } from './messages';
import { center, dot, sub } from './vec';

export interface Frame {
  spacing: Vec3;
  origin: Vec3;
  box: Box; // of the data, world coordinates
  center: Vec3; // of that box
}

export function frameOf(dataset: Dataset): Frame {
  const { dims, spacing, origin } = dataset;
  const far = origin.map((o, i) => o + spacing[i]! * (dims[i]! - 1)) as Vec3;
  const box: Box = { min: origin.map((o, i) => Math.min(o, far[i]!)) as Vec3, max: origin.map((o, i) => Math.max(o, far[i]!)) as Vec3 };
  return { spacing, origin, box, center: center(box) };
}

// From world coordinates to drawing space.
export const toDrawing = (frame: Frame, p: Vec3): Vec3 => sub(p, frame.center);

export function planeToDrawing(frame: Frame, plane: Plane): Plane {
  return { normal: plane.normal, offset: plane.offset - dot(plane.normal, frame.center) };
}

// The first sample in drawing space: a sample's position there is spacing * indices + shift.
export const shiftOf = (frame: Frame): Vec3 => sub(frame.origin, frame.center);

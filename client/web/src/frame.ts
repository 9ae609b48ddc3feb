// The space that is drawn in: world, less the middle of the data, so that 32 bits are enough wherever in the world the data lies.
import type { Box, Dataset, Plane, Vec3 } from './messages';
import { dot, middle, sub } from './vec';

export interface Frame {
  spacing: Vec3;
  origin: Vec3;
  box: Box; // of the data, in the world
  middle: Vec3; // of it
}

export function frameOf(dataset: Dataset): Frame {
  const { dims, spacing, origin } = dataset;
  const far = origin.map((o, i) => o + spacing[i]! * (dims[i]! - 1)) as Vec3;
  const box: Box = { min: origin.map((o, i) => Math.min(o, far[i]!)) as Vec3, max: origin.map((o, i) => Math.max(o, far[i]!)) as Vec3 };
  return { spacing, origin, box, middle: middle(box) };
}

export const toDrawing = (frame: Frame, p: Vec3): Vec3 => sub(p, frame.middle);

export function planeToDrawing(frame: Frame, plane: Plane): Plane {
  return { normal: plane.normal, offset: plane.offset - dot(plane.normal, frame.middle) };
}

// Where samples lie in drawing space: spacing * position + shift.
export const shiftOf = (frame: Frame): Vec3 => sub(frame.origin, frame.middle);

// The coordinate frame of the graphics card ("drawing space"): world coordinates relative to the centre of the data, so
// that float32 is precise enough wherever the data lies.
import type { Dataset } from './datasets.js';
import type { Affine, Box, Vec3 } from './messages.js';
import { applied, boxAround, center, corners, length, sub } from './vec.js';

export interface Frame {
  affine: Affine; // from samples to the world
  leastSpacing: number; // the least distance of neighbouring samples on an axis, world units
  box: Box; // around the data, world coordinates
  center: Vec3; // of that box
  coarsestLevel: number; // of detail; at least 1
}

export function frameOf({ dims, affine }: Dataset): Frame {
  const last = dims.map((n) => n - 1) as Vec3;
  const box = boxAround(corners({ min: [0, 0, 0], max: last }).map((corner) => applied(affine, corner)));
  const coarsestLevel = Math.max(1, Math.ceil(Math.log2(Math.max(...dims) - 1)) - 1);
  const leastSpacing = Math.min(...[0, 1, 2].map((j) => length([affine[j]!, affine[4 + j]!, affine[8 + j]!])));
  return { affine, leastSpacing, box, center: center(box), coarsestLevel };
}

// From world coordinates to drawing space.
export const toDrawing = (frame: Frame, p: Vec3): Vec3 => sub(p, frame.center);

// The coordinate frame of the graphics card ("drawing space"): world coordinates relative to the centre of the data, so
// that float32 is precise enough wherever the data lies.
import type { Dataset } from './datasets';
import type { Box, Vec3 } from './messages';
import { center, sub } from './vec';

export interface Frame {
  spacing: Vec3;
  origin: Vec3; // of the data: its first sample, world coordinates
  box: Box; // of the data, world coordinates
  center: Vec3; // of that box
  coarsestLevel: number; // of detail; at least 1
}

export function frameOf({ dims, spacing, origin }: Dataset): Frame {
  const far = origin.map((o, i) => o + spacing[i]! * (dims[i]! - 1));
  const box: Box = {
    min: origin.map((o, i) => Math.min(o, far[i]!)) as Vec3,
    max: origin.map((o, i) => Math.max(o, far[i]!)) as Vec3,
  };
  const coarsestLevel = Math.max(1, Math.ceil(Math.log2(Math.max(...dims) - 1)) - 1);
  return { spacing, origin, box, center: center(box), coarsestLevel };
}

// From world coordinates to drawing space.
export const toDrawing = (frame: Frame, p: Vec3): Vec3 => sub(p, frame.center);

// Pieces of the boundary surface as arrays that any engine draws.
import { applied } from './vec.js';
import type { Affine, SurfacePiece, Vec3 } from './messages.js';

export interface PieceArrays {
  positions: Float32Array; // x, y, z of each vertex, in the world, relative to the origin
  normals: Int8Array; // x, y, z and a byte of padding, of length 127, in the world
  levels: Uint8Array; // of detail, 0 the finest
  values: Float32Array | null; // of the field or the channel; null: they were not wanted
  indices: Uint32Array; // three a triangle, counterclockwise seen from outside: those on alpha, on beta, on the box's faces
  groups: [number, number, number]; // triangles on each
}

const kVertexBytes = 16; // see SurfacePiece

// affine: of the data set. origin: a point near the data, so that float32 is precise enough wherever that lies.
export function arraysOf(piece: SurfacePiece, affine: Affine, origin: Vec3): PieceArrays {
  const count = piece.vertices.byteLength / kVertexBytes;
  const [floats, bytes] = [new Float32Array(piece.vertices), new Int8Array(piece.vertices)];
  const m = affine;
  const [x0, y0, z0] = applied(affine, [0, 0, 0]).map((x, i) => x - origin[i]!) as Vec3;
  const positions = new Float32Array(3 * count);
  const normals = new Int8Array(4 * count);
  const levels = new Uint8Array(count);
  for (let i = 0; i < count; ++i) {
    const [x, y, z] = [floats[4 * i]!, floats[4 * i + 1]!, floats[4 * i + 2]!];
    positions[3 * i] = m[0] * x + m[1] * y + m[2] * z + x0;
    positions[3 * i + 1] = m[4] * x + m[5] * y + m[6] * z + y0;
    positions[3 * i + 2] = m[8] * x + m[9] * y + m[10] * z + z0;
    for (let j = 0; j < 3; ++j) normals[4 * i + j] = bytes[kVertexBytes * i + 12 + j]!;
    levels[i] = bytes[kVertexBytes * i + 15]! & 255;
  }
  const values = piece.values && new Float32Array(piece.values);
  return { positions, normals, levels, values, indices: new Uint32Array(piece.indices), groups: piece.triangles };
}

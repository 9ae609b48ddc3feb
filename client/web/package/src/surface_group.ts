// The pieces of a boundary surface as objects of three.js.
import {
  BufferAttribute, BufferGeometry, Group, InterleavedBuffer, InterleavedBufferAttribute, type Material, Mesh, Sphere, Vector3,
} from 'three';
import type { Frame } from './frame.js';
import type { SurfaceChange, SurfacePiece } from './messages.js';
import { arraysOf } from './pieces.js';
import { applied, boxAround, center, corners, diagonal, sub } from './vec.js';

export class SurfaceGroup extends Group {
  version = 0; // of what is shown; 0: nothing
  triangles = 0; // shown
  hasValues = false; // what is shown
  private readonly pieces = new Map<number, Mesh>(); // by id

  // materials: by range, then alpha, beta and the faces of the box.
  constructor(private readonly materials: Material[][]) {
    super();
  }

  show(change: SurfaceChange, frame: Frame): void {
    for (const [id, piece] of [...this.pieces]) if (change.reset.includes(piece.userData['range'])) this.removePiece(id);
    for (const id of change.removed) this.removePiece(id);
    for (const piece of change.pieces) {
      this.removePiece(piece.id);
      const made = this.meshOf(piece, frame);
      this.pieces.set(piece.id, made);
      this.triangles += made.userData['triangles'];
      this.add(made);
    }
    this.version = change.version;
    this.hasValues = change.hasValues;
  }

  // Frees what is on the graphics card.
  override clear(): this {
    for (const id of [...this.pieces.keys()]) this.removePiece(id);
    this.version = 0;
    return this;
  }

  private removePiece(id: number): void {
    const piece = this.pieces.get(id);
    if (!piece) return;
    this.pieces.delete(id);
    this.triangles -= piece.userData['triangles'];
    this.remove(piece);
    piece.geometry.dispose();
  }

  private meshOf(piece: SurfacePiece, { affine, center: origin }: Frame): Mesh {
    const arrays = arraysOf(piece, affine, origin);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(arrays.positions, 3));
    geometry.setAttribute('normal', new InterleavedBufferAttribute(new InterleavedBuffer(arrays.normals, 4), 3, 0, true));
    if (arrays.values) geometry.setAttribute('uv', new BufferAttribute(uvOf(arrays.values), 2)); // the map's transform makes colours of them
    geometry.setIndex(new BufferAttribute(arrays.indices, 1));
    let start = 0;
    arrays.groups.forEach((count, surface) => {
      if (count > 0) geometry.addGroup(start, 3 * count, surface);
      start += 3 * count;
    });
    const box = boxAround(corners(piece).map((corner) => applied(affine, corner)));
    geometry.boundingSphere = new Sphere(new Vector3(...sub(center(box), origin)), diagonal(box) / 2);
    const made = new Mesh(geometry, this.materials[piece.range]!);
    made.userData['range'] = piece.range;
    made.userData['triangles'] = start / 3;
    return made;
  }
}

function uvOf(values: Float32Array): Float32Array {
  const uv = new Float32Array(2 * values.length);
  values.forEach((value, i) => {
    uv[2 * i] = value;
    uv[2 * i + 1] = 0.5;
  });
  return uv;
}

// The boundary surfaces of the meshes, as pieces on the graphics card. The pieces of a new version are uploaded a few per
// frame; once all are there they replace the old ones in one step, so that no frame shows cracks. Nothing here visits
// single vertices.
import { BufferAttribute, BufferGeometry, LineSegments, type Material, Mesh, Scene, Sphere, Vector3 } from 'three';
import { type Frame, toDrawing } from '../package/src/frame';
import type { SurfaceMaterials } from './materials';
import type { SurfaceChange, SurfacePiece } from '../package/src/messages';
import { setValues, type Uploader } from './upload';
import { applied, boxAround, center, corners, diagonal } from '../package/src/vec';

interface PieceObjects {
  range: number;
  triangles: number;
  mesh: Mesh;
  lines: LineSegments | null; // the edges
}

export class BoundarySurfaceView {
  readonly faces = new Scene();
  readonly edges = new Scene();
  version = 0; // of what is shown; 0: nothing yet
  hasValues = false; // what is shown
  ranges = 0; // that are shown; 0: nothing yet
  triangles = 0; // shown
  private pieces = new Map<number, PieceObjects>(); // shown, by id
  private pending: SurfaceChange[] = []; // oldest first
  private uploaded: { id: number; objects: PieceObjects }[] = []; // of the first pending one

  constructor(private uploader: Uploader, private materials: SurfaceMaterials[]) {
    this.faces.matrixWorldAutoUpdate = this.edges.matrixWorldAutoUpdate = false; // pieces are in drawing space
  }

  get isBusy(): boolean {
    return this.pending.length > 0;
  }

  take(change: SurfaceChange): void {
    this.pending.push(change);
  }

  // Uploads within the uploader's budget. Returns whether the first pending version is complete: swap() is next.
  upload(frame: Frame): boolean {
    const change = this.pending[0];
    if (!change) return false;
    while (this.uploaded.length < change.pieces.length && this.uploader.hasBudget) {
      const piece = change.pieces[this.uploaded.length]!;
      const objects = this.objectsOf(piece, frame);
      this.uploader.send(objects.mesh.geometry, piece.vertices.byteLength + piece.indices.byteLength + (piece.values?.byteLength ?? 0));
      if (objects.lines) this.uploader.send(objects.lines.geometry, piece.edges!.byteLength);
      this.uploaded.push({ id: piece.id, objects });
    }
    return this.uploaded.length === change.pieces.length;
  }

  // Shows the first pending version.
  swap(): void {
    const change = this.pending.shift()!;
    for (const [id, { range }] of this.pieces) if (change.reset.includes(range)) this.remove(id);
    for (const id of change.removed) this.remove(id);
    for (const { id, objects } of this.uploaded) {
      this.remove(id);
      this.pieces.set(id, objects);
      this.triangles += objects.triangles;
      this.faces.add(objects.mesh);
      if (objects.lines) this.edges.add(objects.lines);
    }
    this.uploaded = [];
    this.version = change.version;
    this.hasValues = change.hasValues;
    this.ranges = change.ranges;
  }

  clear(): void {
    for (const { objects } of this.uploaded) dispose(objects);
    this.uploaded = [];
    this.pending = [];
    for (const id of this.pieces.keys()) this.remove(id);
    this.version = this.ranges = 0;
    this.hasValues = false;
  }

  // materials: for the next draw; either one, or one per surface of each range.
  use(materials: Material | Material[][]): void {
    for (const { mesh, range } of this.pieces.values()) mesh.material = Array.isArray(materials) ? materials[range]! : materials;
  }

  private remove(id: number): void {
    const objects = this.pieces.get(id);
    if (!objects) return;
    this.pieces.delete(id);
    this.triangles -= objects.triangles;
    this.faces.remove(objects.mesh);
    if (objects.lines) this.edges.remove(objects.lines);
    dispose(objects);
  }

  private objectsOf(piece: SurfacePiece, frame: Frame): PieceObjects {
    const vertices = new BufferAttribute(new Uint32Array(piece.vertices), 4);
    const sphere = boundingSphere(piece, frame);
    const geometry = (indices: ArrayBuffer, counts: [number, number, number], indicesEach: number) => {
      const made = new BufferGeometry();
      made.setAttribute('position', vertices);
      made.setIndex(new BufferAttribute(new Uint32Array(indices), 1));
      made.boundingSphere = sphere;
      let start = 0;
      counts.forEach((count, surface) => {
        if (count > 0) made.addGroup(start, count * indicesEach, surface);
        start += count * indicesEach;
      });
      return made;
    };
    const mesh = new Mesh(geometry(piece.indices, piece.triangles, 3), this.materials[piece.range]!.opaque);
    setValues(mesh.geometry, piece.values);
    const lines = piece.edges ? new LineSegments(geometry(piece.edges, piece.edgeCounts, 2), this.materials[piece.range]!.edges) : null;
    return { range: piece.range, triangles: piece.triangles.reduce((sum, count) => sum + count, 0), mesh, lines };
  }
}

// In drawing space.
function boundingSphere(piece: SurfacePiece, frame: Frame): Sphere {
  const box = boxAround(corners(piece).map((corner) => applied(frame.affine, corner)));
  return new Sphere(new Vector3(...toDrawing(frame, center(box))), diagonal(box) / 2);
}

function dispose(objects: PieceObjects): void {
  objects.mesh.geometry.dispose();
  objects.lines?.geometry.dispose();
}

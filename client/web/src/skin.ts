// The skin's pieces on the graphics card. A new skin is taken as a whole: its pieces are uploaded a few at a time, between pictures, and only then
// take the place of the old ones, all at once. Nothing here looks at single vertices.
import { BufferAttribute, BufferGeometry, Group, LineSegments, type Material, Mesh, Sphere, Vector3 } from 'three';
import { type Frame, toDrawing } from './frame';
import type { SurfaceMaterials } from './materials';
import type { Piece, Skin, Vec3 } from './messages';
import type { Uploader } from './upload';
import { add, diagonal, middle } from './vec';

interface Drawn {
  mesh: Mesh;
  lines: LineSegments | null;
  bytes: number;
  triangles: number;
}

export class SkinView {
  readonly faces = new Group();
  readonly edges = new Group();
  version = 0; // of what is shown; 0: nothing yet
  triangles = 0;
  bytes = 0; // of buffers
  private pieces = new Map<number, Drawn>();
  private waiting: Skin[] = [];
  private staged: { id: number; drawn: Drawn }[] = [];
  private uploaded = 0; // pieces of the first that waits

  constructor(private uploader: Uploader, private materials: SurfaceMaterials) {
    for (const group of [this.faces, this.edges]) group.matrixAutoUpdate = false;
  }

  get busy(): boolean {
    return this.waiting.length > 0;
  }

  take(skin: Skin): void {
    this.waiting.push(skin);
  }

  // Uploads while the uploader is open. Whether a skin is complete: then `swap` is due.
  upload(frame: Frame): boolean {
    const skin = this.waiting[0];
    if (!skin) return false;
    while (this.uploaded < skin.pieces.length && this.uploader.open) {
      const piece = skin.pieces[this.uploaded++]!;
      const drawn = this.made(piece, frame);
      this.uploader.send(drawn.mesh.geometry, drawn.bytes);
      if (drawn.lines) this.uploader.send(drawn.lines.geometry, 0); // counted already
      this.staged.push({ id: piece.id, drawn });
    }
    return this.uploaded === skin.pieces.length;
  }

  // The first skin that waits takes the place of what is shown.
  swap(): void {
    const skin = this.waiting.shift()!;
    if (skin.reset) for (const id of [...this.pieces.keys()]) this.drop(id);
    for (const id of skin.removed) this.drop(id);
    for (const { id, drawn } of this.staged) {
      this.drop(id);
      this.pieces.set(id, drawn);
      this.faces.add(drawn.mesh);
      if (drawn.lines) this.edges.add(drawn.lines);
      this.triangles += drawn.triangles;
      this.bytes += drawn.bytes;
    }
    this.staged = [];
    this.uploaded = 0;
    this.version = skin.version;
  }

  clear(): void {
    for (const { drawn } of this.staged) free(drawn);
    this.staged = [];
    this.uploaded = 0;
    this.waiting = [];
    for (const id of [...this.pieces.keys()]) this.drop(id);
    this.version = 0;
  }

  // What the faces are drawn with from now on: one material, or one for each surface.
  use(materials: Material | Material[]): void {
    for (const { mesh } of this.pieces.values()) mesh.material = materials;
  }

  private drop(id: number): void {
    const drawn = this.pieces.get(id);
    if (!drawn) return;
    this.pieces.delete(id);
    this.faces.remove(drawn.mesh);
    if (drawn.lines) this.edges.remove(drawn.lines);
    this.triangles -= drawn.triangles;
    this.bytes -= drawn.bytes;
    free(drawn);
  }

  private made(piece: Piece, frame: Frame): Drawn {
    const vertices = new BufferAttribute(new Uint32Array(piece.vertices), 4);
    const sphere = bounds(piece, frame);
    const geometry = (indices: ArrayBuffer, counts: [number, number, number], each: number) => {
      const made = new BufferGeometry();
      made.setAttribute('position', vertices);
      made.setIndex(new BufferAttribute(new Uint32Array(indices), 1));
      made.boundingSphere = sphere;
      let start = 0;
      counts.forEach((count, surface) => {
        if (count > 0) made.addGroup(start, count * each, surface);
        start += count * each;
      });
      return made;
    };
    const mesh = new Mesh(geometry(piece.indices, piece.triangles, 3), this.materials.solid);
    const lines = piece.edges ? new LineSegments(geometry(piece.edges, piece.edgeCounts, 2), this.materials.edges) : null;
    for (const object of [mesh, lines]) if (object) object.matrixAutoUpdate = false;
    return {
      mesh,
      lines,
      bytes: piece.vertices.byteLength + piece.indices.byteLength + (piece.edges?.byteLength ?? 0),
      triangles: piece.triangles[0] + piece.triangles[1] + piece.triangles[2],
    };
  }
}

function bounds(piece: Piece, frame: Frame): Sphere {
  const world = (p: Vec3): Vec3 => add(frame.origin, [p[0] * frame.spacing[0], p[1] * frame.spacing[1], p[2] * frame.spacing[2]]);
  const box = { min: world(piece.min), max: world(piece.max) };
  return new Sphere(new Vector3(...toDrawing(frame, middle(box))), diagonal(box) / 2);
}

function free(drawn: Drawn): void {
  drawn.mesh.geometry.dispose();
  drawn.lines?.geometry.dispose();
}

// The skin's pieces on the graphics card. A new skin is taken as a whole: its pieces are uploaded a few at a time, between pictures, and only then
// take the place of the old ones, all at once. Nothing here looks at single vertices.
import { BufferAttribute, BufferGeometry, Camera, Group, LineSegments, type Material, Mesh, Scene, Sphere, Vector3, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { type Frame, toDrawing } from './frame';
import { stagingMaterial, type SurfaceMaterials } from './materials';
import type { Piece, Skin, Vec3 } from './messages';
import { add, diagonal, middle } from './vec';

interface Drawn {
  mesh: Mesh;
  lines: LineSegments | null;
  bytes: number;
  triangles: number;
}

const kUploadMs = 4; // a stretch of uploading, and
const kUploadBytes = 4e6; // ... at most so many, which may take longer than the call

export class SkinView {
  readonly faces = new Group();
  readonly edges = new Group();
  version = 0; // of what is shown; 0: nothing yet
  triangles = 0;
  bytes = 0; // of buffers
  coarsest = 1;
  private pieces = new Map<number, Drawn>();
  private waiting: Skin[] = [];
  private staged: { id: number; drawn: Drawn }[] = [];
  private uploaded = 0; // pieces of the first that waits
  private stage = new Scene();
  private stageTarget = new WebGLRenderTarget(1, 1);
  private stageMesh = new Mesh(new BufferGeometry(), stagingMaterial());
  private nobody = new Camera();

  constructor(private renderer: WebGLRenderer, private materials: SurfaceMaterials) {
    for (const group of [this.faces, this.edges]) group.matrixAutoUpdate = false;
    this.stageMesh.frustumCulled = false;
    this.stage.add(this.stageMesh);
    const nothing = new BufferGeometry(); // once, so that the first piece finds the shader ready
    nothing.setAttribute('position', new BufferAttribute(new Uint32Array(4), 4));
    nothing.setIndex(new BufferAttribute(new Uint32Array(3), 1));
    this.send(nothing);
    nothing.dispose();
  }

  get busy(): boolean {
    return this.waiting.length > 0;
  }

  take(skin: Skin): void {
    this.waiting.push(skin);
  }

  // Uploads for a few milliseconds. Whether a skin is complete: then `swap` is due.
  upload(frame: Frame): boolean {
    const skin = this.waiting[0];
    if (!skin) return false;
    const end = performance.now() + kUploadMs;
    let bytes = 0;
    while (this.uploaded < skin.pieces.length && performance.now() < end && bytes < kUploadBytes) {
      const piece = skin.pieces[this.uploaded++]!;
      const drawn = this.made(piece, frame);
      this.send(drawn.mesh.geometry);
      if (drawn.lines) this.send(drawn.lines.geometry);
      this.staged.push({ id: piece.id, drawn });
      bytes += drawn.bytes;
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

  // three.js uploads what it is to draw: so it draws nothing of it.
  private send(geometry: BufferGeometry): void {
    geometry.setDrawRange(0, 0);
    this.stageMesh.geometry = geometry;
    this.renderer.setRenderTarget(this.stageTarget);
    this.renderer.render(this.stage, this.nobody);
    this.renderer.setRenderTarget(null);
    geometry.setDrawRange(0, Infinity);
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

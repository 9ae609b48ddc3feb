// The shrunken tetrahedra. Like the boundary surface (boundary_surface.ts), a set of them is uploaded in chunks over
// several frames and shown once it is complete.
import { BufferAttribute, BufferGeometry, Group, InterleavedBuffer, InterleavedBufferAttribute, type Material, type Mesh } from 'three';
import { tetsDepthMaterial, tetsMaterial, tetsPickMaterial } from './materials';
import type { Tets } from '../package/src/messages';
import { staticMesh } from './static_mesh';
import { setValues, type Uploader } from './upload';

const kChunk = 1 << 12; // tetrahedra per mesh: 460 kB
const kTetWords = 28; // 32-bit words of a tetrahedron's four vertices
export const kTetTriangles = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]; // of a positive tetrahedron, counterclockwise from outside

export class TetsView {
  readonly group = new Group();
  readonly material = tetsMaterial(false);
  readonly valueMaterial = tetsMaterial(true);
  readonly depth = tetsDepthMaterial();
  readonly pick = tetsPickMaterial(false);
  readonly valuePick = tetsPickMaterial(true);
  hasValues = false; // what is shown
  private triangles: BufferAttribute | null = null; // the same for every chunk, so shared
  private pending: Tets | null = null;
  private chunks: Mesh[] = []; // of pending, uploaded so far

  constructor(private uploader: Uploader) {}

  get isBusy(): boolean {
    return this.pending !== null;
  }

  // Replaces what is still pending.
  take(tets: Tets): void {
    this.discardPending();
    this.pending = tets;
  }

  // Uploads chunks within the uploader's budget. Returns the pending tetrahedra once all are uploaded: swap() is next.
  upload(): Tets | null {
    const tets = this.pending;
    if (!tets) return null;
    const chunkCount = Math.ceil(tets.count / kChunk);
    while (this.chunks.length < chunkCount && this.uploader.hasBudget) {
      const first = this.chunks.length * kChunk;
      const n = Math.min(kChunk, tets.count - first);
      const mesh = staticMesh(this.chunk(new Uint32Array(tets.vertices, 4 * kTetWords * first, kTetWords * n)));
      if (tets.values) setValues(mesh.geometry, new Float32Array(tets.values, 16 * first, 4 * n));
      this.uploader.send(mesh.geometry, (4 * kTetWords + (tets.values ? 16 : 0)) * n);
      mesh.geometry.setDrawRange(0, kTetTriangles.length * n);
      this.chunks.push(mesh);
    }
    return this.chunks.length === chunkCount ? tets : null;
  }

  // Replaces what is shown with what was uploaded.
  swap(): void {
    const old = [...this.group.children] as Mesh[];
    this.group.remove(...old);
    dispose(old);
    for (const mesh of this.chunks) this.group.add(mesh);
    this.hasValues = !!this.pending?.values;
    this.chunks = [];
    this.pending = null;
  }

  discardPending(): void {
    this.pending = null;
    dispose(this.chunks);
    this.chunks = [];
  }

  use(material: Material): void {
    for (const mesh of this.group.children) (mesh as Mesh).material = material;
  }

  private chunk(words: Uint32Array): BufferGeometry {
    this.triangles ??= new BufferAttribute(chunkTriangles(), 1);
    const buffer = new InterleavedBuffer(words, 7);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute('center', new InterleavedBufferAttribute(buffer, 3, 3));
    geometry.setAttribute('kind', new InterleavedBufferAttribute(buffer, 1, 6));
    geometry.setIndex(this.triangles);
    return geometry;
  }
}

function chunkTriangles(): Uint32Array {
  const n = kTetTriangles.length;
  const indices = new Uint32Array(n * kChunk);
  for (let tet = 0; tet < kChunk; ++tet) for (let i = 0; i < n; ++i) indices[n * tet + i] = 4 * tet + kTetTriangles[i]!;
  return indices;
}

function dispose(meshes: Mesh[]): void {
  for (const { geometry } of meshes) {
    geometry.setIndex(null); // shared with the other chunks: must not be freed
    geometry.dispose();
  }
}

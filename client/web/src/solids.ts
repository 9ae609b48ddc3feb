// What is drawn besides the skin: the cap where a plane cuts the solid, and the shrunken tetrahedra.
import { BufferAttribute, BufferGeometry, Group, InterleavedBuffer, InterleavedBufferAttribute, type Material, Mesh } from 'three';
import { capDepthMaterial, capMaterial, tetsDepthMaterial, tetsMaterial, thicknessMaterial } from './materials';
import type { Cap, Tets } from './messages';
import type { Uploader } from './upload';

function drawable(geometry: BufferGeometry): Mesh {
  const mesh = new Mesh(geometry);
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  return mesh;
}

export class CapView {
  readonly mesh = drawable(new BufferGeometry());
  readonly material = capMaterial();
  readonly depth = capDepthMaterial();
  readonly thickness = thicknessMaterial(1);

  constructor(private uploader: Uploader) {
    this.mesh.visible = false;
  }

  show(cap: Cap | null): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.visible = cap !== null && cap.triangles > 0;
    if (!cap || !this.mesh.visible) return;
    this.mesh.geometry.setAttribute('position', new BufferAttribute(new Uint32Array(cap.vertices), 4));
    this.uploader.send(this.mesh.geometry, cap.vertices.byteLength);
  }
}

const kChunk = 1 << 12; // tetrahedra in a mesh: 460 kB
const kTetWords = 28; // 32-bit words of a tetrahedron's four vertices
const kTriangles = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

// Taken as a whole, as skins are: uploaded in chunks, and shown once all are there. Every chunk has the same triangles, so these are there once; which
// way they face does not matter here.
export class TetsView {
  readonly group = new Group();
  readonly material = tetsMaterial();
  readonly depth = tetsDepthMaterial();
  private triangles: BufferAttribute | null = null;
  private waiting: Tets | null = null;
  private made: Mesh[] = [];

  constructor(private uploader: Uploader) {
    this.group.matrixAutoUpdate = false;
  }

  get busy(): boolean {
    return this.waiting !== null;
  }

  // The newest counts.
  take(tets: Tets): void {
    this.waiting = tets;
    free(this.made);
    this.made = [];
  }

  // Uploads while the uploader is open. What is complete, and due to be shown.
  upload(): Tets | null {
    const tets = this.waiting;
    if (!tets) return null;
    const chunks = Math.ceil(tets.count / kChunk);
    while (this.made.length < chunks && this.uploader.open) {
      const first = this.made.length * kChunk;
      const n = Math.min(kChunk, tets.count - first);
      const mesh = drawable(this.chunk(new Uint32Array(tets.vertices, 4 * kTetWords * first, kTetWords * n)));
      this.uploader.send(mesh.geometry, 4 * kTetWords * n);
      mesh.geometry.setDrawRange(0, kTriangles.length * n);
      this.made.push(mesh);
    }
    return this.made.length === chunks ? tets : null;
  }

  swap(): void {
    const old = [...this.group.children] as Mesh[];
    this.group.remove(...old);
    free(old);
    if (this.made.length > 0) this.group.add(...this.made);
    this.made = [];
    this.waiting = null;
  }

  clear(): void {
    this.waiting = null;
    free(this.made);
    this.made = [];
    this.swap();
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
  const n = kTriangles.length;
  const indices = new Uint32Array(n * kChunk);
  for (let tet = 0; tet < kChunk; ++tet) for (let i = 0; i < n; ++i) indices[n * tet + i] = 4 * tet + kTriangles[i]!;
  return indices;
}

function free(meshes: Mesh[]): void {
  for (const { geometry } of meshes) {
    geometry.setIndex(null); // it is the others', too
    geometry.dispose();
  }
}

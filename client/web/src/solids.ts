// What is drawn besides the skin: the cap where a plane cuts the solid, and the shrunken tetrahedra.
import { BufferAttribute, BufferGeometry, InterleavedBuffer, InterleavedBufferAttribute, Mesh } from 'three';
import { capDepthMaterial, capMaterial, tetsDepthMaterial, tetsMaterial, thicknessMaterial } from './materials';
import type { Cap, Tets } from './messages';

function drawable(): Mesh {
  const mesh = new Mesh(new BufferGeometry());
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  mesh.visible = false;
  return mesh;
}

export class CapView {
  readonly mesh = drawable();
  readonly material = capMaterial();
  readonly depth = capDepthMaterial();
  readonly thickness = thicknessMaterial(1);

  show(cap: Cap | null): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.visible = cap !== null && cap.triangles > 0;
    if (cap && this.mesh.visible) this.mesh.geometry.setAttribute('position', new BufferAttribute(new Uint32Array(cap.vertices), 4));
  }
}

export class TetsView {
  readonly mesh = drawable();
  readonly material = tetsMaterial();
  readonly depth = tetsDepthMaterial();

  show(tets: Tets | null): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.visible = tets !== null && tets.count > 0;
    if (!tets || !this.mesh.visible) return;
    const words = new InterleavedBuffer(new Uint32Array(tets.vertices), 7);
    this.mesh.geometry.setAttribute('corner', new InterleavedBufferAttribute(words, 3, 0));
    this.mesh.geometry.setAttribute('center', new InterleavedBufferAttribute(words, 3, 3));
    this.mesh.geometry.setAttribute('kind', new InterleavedBufferAttribute(words, 1, 6));
    this.mesh.geometry.setIndex(new BufferAttribute(new Uint32Array(tets.indices), 1));
  }
}

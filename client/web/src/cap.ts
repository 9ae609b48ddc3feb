// The cap: the faces where the clip plane cuts the tetrahedra.
import { BufferAttribute, BufferGeometry } from 'three';
import { capDepthMaterial, capMaterial, thicknessMaterial } from './materials';
import type { Cap } from './messages';
import { staticMesh } from './static_mesh';
import { setValues, type Uploader } from './upload';

export class CapView {
  readonly mesh = staticMesh(new BufferGeometry());
  readonly material = capMaterial(false);
  readonly valueMaterial = capMaterial(true);
  readonly depth = capDepthMaterial();
  readonly thickness = thicknessMaterial(1);
  hasValues = false; // what is shown

  constructor(private uploader: Uploader) {
    this.mesh.visible = false;
  }

  show(cap: Cap | null): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.visible = cap !== null && cap.triangles > 0;
    this.hasValues = !!cap?.values;
    if (!cap || !this.mesh.visible) return;
    this.mesh.geometry.setAttribute('position', new BufferAttribute(new Uint32Array(cap.vertices), 4));
    setValues(this.mesh.geometry, cap.values);
    this.uploader.send(this.mesh.geometry, cap.vertices.byteLength + (cap.values?.byteLength ?? 0));
  }
}

// The cap: the faces where the clip plane cuts the tetrahedra of each range.
import { BufferAttribute, BufferGeometry } from 'three';
import { capColorMaterials, capDepthMaterials, capPickMaterial, thicknessMaterial } from './materials';
import type { Cap } from '../package/src/messages';
import { staticMesh } from './static_mesh';
import { setValues, type Uploader } from './upload';

export class CapView {
  readonly mesh = staticMesh(new BufferGeometry());
  readonly materials = capColorMaterials(false); // by range, as the next two
  readonly valueMaterials = capColorMaterials(true);
  readonly depth = capDepthMaterials();
  readonly pick = capPickMaterial(false);
  readonly valuePick = capPickMaterial(true);
  readonly thickness = thicknessMaterial(1);
  hasValues = false; // what is shown

  constructor(private uploader: Uploader) {
    this.mesh.visible = false;
  }

  show(cap: Cap | null): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.visible = cap !== null && cap.triangles.some((count) => count > 0);
    this.hasValues = !!cap?.values;
    if (!cap || !this.mesh.visible) return;
    this.mesh.geometry.setAttribute('position', new BufferAttribute(new Uint32Array(cap.vertices), 4));
    let start = 0;
    cap.triangles.forEach((count, range) => {
      if (count > 0) this.mesh.geometry.addGroup(3 * start, 3 * count, range);
      start += count;
    });
    setValues(this.mesh.geometry, cap.values);
    this.uploader.send(this.mesh.geometry, cap.vertices.byteLength + (cap.values?.byteLength ?? 0));
  }
}

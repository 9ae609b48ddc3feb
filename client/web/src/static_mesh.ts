// A mesh that is never moved or culled: its geometry is in drawing space and always in view.
import { type BufferGeometry, Mesh } from 'three';

export function staticMesh(geometry: BufferGeometry): Mesh {
  const mesh = new Mesh(geometry);
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  return mesh;
}

// A mesh that is never moved or culled: its geometry is in drawing space and always in view.
import { type BufferGeometry, type Material, Mesh } from 'three';

export function staticMesh(geometry: BufferGeometry, material?: Material): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  return mesh;
}

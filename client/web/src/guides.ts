// Thin lines over the picture: the outline of the region, and of the plane within the data's box, with its normal. Dim where something is before them.
import { BufferAttribute, BufferGeometry, Color, LineSegments, type RawShaderMaterial, Scene } from 'three';
import { type Frame, toDrawing } from './frame';
import { lineMaterial } from './materials';
import type { Box, Plane, Vec3 } from './messages';
import { cutOutline, holdOf, tipOf } from './plane';
import { corners, kBoxEdges } from './vec';

export class Guides {
  readonly scene = new Scene();
  private materials = [lineMaterial(true, 0.9), lineMaterial(false, 0.45)];
  private lines = this.materials.map((material) => new LineSegments(new BufferGeometry(), material));

  constructor() {
    for (const line of this.lines) {
      line.frustumCulled = false;
      this.scene.add(line);
    }
  }

  // color: as CSS says it.
  setInkOf(color: string): void {
    const { r, g, b } = new Color().setStyle(color, '');
    for (const material of this.materials) {
      const ink = (material as RawShaderMaterial).uniforms['ink']!.value;
      ink.set(r, g, b, ink.w);
    }
  }

  set(frame: Frame, outlined: { region: Box | null; plane: Plane | null }): void {
    const points: Vec3[] = [];
    if (outlined.region) points.push(...boxOutline(outlined.region));
    if (outlined.plane) points.push(...cutOutline(frame.box, outlined.plane), holdOf(frame.box, outlined.plane), tipOf(frame.box, outlined.plane));
    const numbers = new Float32Array(points.flatMap((p) => toDrawing(frame, p)));
    for (const line of this.lines) {
      line.geometry.dispose();
      line.geometry = new BufferGeometry();
      line.geometry.setAttribute('position', new BufferAttribute(numbers, 3));
      line.visible = points.length > 0;
    }
  }
}

function boxOutline(box: Box): Vec3[] {
  const c = corners(box);
  return kBoxEdges.flatMap(([a, b]) => [c[a]!, c[b]!]);
}

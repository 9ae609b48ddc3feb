// Outlines over the picture: of the region, and of the clip plane within the data's box, with its normal. Dim where
// something is in front of them.
import { BufferAttribute, BufferGeometry, Color, LineSegments, Scene } from 'three';
import { type Frame, toDrawing } from '../package/src/frame';
import { lineMaterial } from './materials';
import type { Box, Plane, Vec3 } from '../package/src/messages';
import { handlePosition, normalTip, planeOutline } from './plane';
import { boxOutline } from '../package/src/vec';

export class Outlines {
  readonly scene = new Scene();
  private materials = [lineMaterial(true, 0.9), lineMaterial(false, 0.45)];
  private lines = this.materials.map((material) => new LineSegments(new BufferGeometry(), material));

  constructor() {
    for (const line of this.lines) {
      line.frustumCulled = false;
      this.scene.add(line);
    }
  }

  // color: a CSS colour.
  setColor(color: string): void {
    const { r, g, b } = new Color().setStyle(color, '');
    for (const material of this.materials) {
      const lineColor = material.uniforms['lineColor']!.value;
      lineColor.set(r, g, b, lineColor.w);
    }
  }

  // null: not drawn.
  set(frame: Frame, region: Box | null, plane: Plane | null): void {
    const points: Vec3[] = region ? boxOutline(region) : [];
    if (plane) points.push(...planeOutline(frame.box, plane), handlePosition(frame.box, plane), normalTip(frame.box, plane));
    const coordinates = new Float32Array(points.flatMap((p) => toDrawing(frame, p)));
    for (const line of this.lines) {
      line.geometry.dispose();
      line.geometry = new BufferGeometry();
      line.geometry.setAttribute('position', new BufferAttribute(coordinates, 3));
      line.visible = points.length > 0;
    }
  }
}

// Thin lines over the picture: the outline of the region, and of the plane within the data's box. Dim where something is before them.
import { BufferAttribute, BufferGeometry, Color, LineSegments, type RawShaderMaterial, Scene } from 'three';
import { type Frame, toDrawing } from './frame';
import { lineMaterial } from './materials';
import type { Box, Plane, Vec3 } from './messages';
import { add, corners, dot, kBoxEdges, scale, sub } from './vec';

export class Guides {
  readonly scene = new Scene();
  private materials = [lineMaterial(true, 0.9), lineMaterial(false, 0.25)];
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
    if (outlined.plane) points.push(...cutOutline(frame.box, outlined.plane));
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

// Pairs of points: where the plane cuts the box's faces.
export function cutOutline(box: Box, plane: Plane): Vec3[] {
  const c = corners(box);
  const points: { p: Vec3; edge: [number, number] }[] = [];
  for (const edge of kBoxEdges) {
    const [from, to] = [c[edge[0]]!, c[edge[1]]!];
    const [a, b] = [dot(plane.normal, from) - plane.offset, dot(plane.normal, to) - plane.offset];
    if (a > 0 !== b > 0) points.push({ p: add(from, scale(sub(to, from), a / (a - b))), edge });
  }
  // Two cut edges that lie on the same face are joined. A face is an axis and an end of it.
  const faces = ([i, j]: [number, number]) => [1, 2, 4].filter((bit) => (i & bit) === (j & bit)).map((bit) => bit * 8 + (i & bit));
  const pairs: Vec3[] = [];
  points.forEach((a, i) => {
    for (const b of points.slice(i + 1)) if (faces(a.edge).some((face) => faces(b.edge).includes(face))) pairs.push(a.p, b.p);
  });
  return pairs;
}

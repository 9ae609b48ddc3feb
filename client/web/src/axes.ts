// The orientation marker: the directions of x, y and z, in a corner of the picture.
import { axes, type Pose } from './camera';
import { dot } from './vec';
import type { Vec3 } from './messages';

const kAxes: { name: string; color: string; direction: Vec3 }[] = [
  { name: 'x', color: '#d9534a', direction: [1, 0, 0] },
  { name: 'y', color: '#3f9a4f', direction: [0, 1, 0] },
  { name: 'z', color: '#4a84e0', direction: [0, 0, 1] },
];
const kLength = 25; // units of the SVG's view box

export function showAxes(svg: Element, pose: Pose): void {
  const a = axes(pose);
  const project = (v: Vec3, length: number) => [(dot(a.right, v) * length).toFixed(1), (-dot(a.up, v) * length).toFixed(1)] as const;
  const ns = 'http://www.w3.org/2000/svg';
  if (svg.children.length === 0) {
    for (const { name, color } of kAxes) {
      const line = document.createElementNS(ns, 'line');
      line.setAttribute('stroke', color);
      const text = document.createElementNS(ns, 'text');
      text.textContent = name;
      svg.append(line, text);
    }
  }
  kAxes.forEach(({ direction }, i) => {
    const [line, text] = [svg.children[2 * i]!, svg.children[2 * i + 1]!];
    const [x, y] = project(direction, kLength);
    line.setAttribute('x2', x);
    line.setAttribute('y2', y);
    const [u, v] = project(direction, kLength + 8);
    text.setAttribute('x', u);
    text.setAttribute('y', v);
  });
}

// Which way x, y and z point, in a corner of the picture.
import { axes, type Pose } from './camera';
import { dot } from './vec';
import type { Vec3 } from './messages';

const kArms: { name: string; color: string; arm: Vec3 }[] = [
  { name: 'x', color: '#d9534a', arm: [1, 0, 0] },
  { name: 'y', color: '#3f9a4f', arm: [0, 1, 0] },
  { name: 'z', color: '#4a84e0', arm: [0, 0, 1] },
];
const kLength = 25;

export function showAxes(svg: Element, pose: Pose): void {
  const a = axes(pose);
  const spot = (arm: Vec3, by: number) => [(dot(a.right, arm) * by).toFixed(1), (-dot(a.up, arm) * by).toFixed(1)] as const;
  const ns = 'http://www.w3.org/2000/svg';
  if (svg.children.length === 0) {
    for (const { name, color } of kArms) {
      const line = document.createElementNS(ns, 'line');
      line.setAttribute('stroke', color);
      const text = document.createElementNS(ns, 'text');
      text.textContent = name;
      svg.append(line, text);
    }
  }
  kArms.forEach(({ arm }, i) => {
    const [line, text] = [svg.children[2 * i]!, svg.children[2 * i + 1]!];
    const [x, y] = spot(arm, kLength);
    line.setAttribute('x2', x);
    line.setAttribute('y2', y);
    const [u, v] = spot(arm, kLength + 8);
    text.setAttribute('x', u);
    text.setAttribute('y', v);
  });
}

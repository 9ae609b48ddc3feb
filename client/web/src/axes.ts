// The orientation marker: the directions of x, y and z, in a corner of the picture. index.html has a line and a letter
// for each.
import { axes, type Pose } from '../package/src/camera';

const kLength = 25; // of a line, in units of the SVG's view box
const kLetter = kLength + 8; // the letter's distance from the origin

export function showAxes(svg: SVGSVGElement, pose: Pose): void {
  svg.removeAttribute('hidden'); // it has places now
  const { right, up } = axes(pose);
  const place = (target: Element, x: string, y: string, axis: number, distance: number) => {
    target.setAttribute(x, (right[axis]! * distance).toFixed(1));
    target.setAttribute(y, (-up[axis]! * distance).toFixed(1));
  };
  svg.querySelectorAll('line').forEach((line, axis) => place(line, 'x2', 'y2', axis, kLength));
  svg.querySelectorAll('text').forEach((text, axis) => place(text, 'x', 'y', axis, kLetter));
}

// What is under a pixel: draws the skin and the cap into a picture of one pixel, which holds distances from the eye.
import { FloatType, type PerspectiveCamera, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { distanceMaterial } from './materials';

export class Pick {
  readonly material = distanceMaterial();
  private target = new WebGLRenderTarget(1, 1, { type: FloatType });
  private read = new Float32Array(4);

  // x, y: pixels from the upper left of a picture of width by height. The distance from the eye; null where nothing is drawn.
  distance(renderer: WebGLRenderer, camera: PerspectiveCamera, x: number, y: number, width: number, height: number, draw: () => void): number | null {
    if (!renderer.extensions.has('EXT_color_buffer_float')) return null;
    camera.setViewOffset(width, height, Math.floor(x), Math.floor(y), 1, 1);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    draw();
    camera.clearViewOffset();
    renderer.readRenderTargetPixels(this.target, 0, 0, 1, 1, this.read);
    renderer.setRenderTarget(null);
    return this.read[3]! > 0 ? this.read[0]! : null;
  }
}

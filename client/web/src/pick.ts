// Picking: draws what is under one pixel into a target of one pixel that holds the distance from the eye.
import { FloatType, type PerspectiveCamera, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { distanceMaterial } from './materials';

export class Pick {
  readonly material = distanceMaterial();
  private target = new WebGLRenderTarget(1, 1, { type: FloatType });
  private pixel = new Float32Array(4);

  // x, y: CSS pixels from the canvas's upper left corner. draw: draws the scene.
  // The distance from the eye in world units; null where nothing is drawn, or without float render targets.
  distance(renderer: WebGLRenderer, camera: PerspectiveCamera, x: number, y: number, draw: () => void): number | null {
    if (!renderer.extensions.has('EXT_color_buffer_float')) return null;
    const { clientWidth, clientHeight } = renderer.domElement;
    camera.setViewOffset(clientWidth, clientHeight, Math.floor(x), Math.floor(y), 1, 1);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    draw();
    camera.clearViewOffset();
    renderer.readRenderTargetPixels(this.target, 0, 0, 1, 1, this.pixel);
    renderer.setRenderTarget(null);
    return this.pixel[3]! > 0 ? this.pixel[0]! : null;
  }
}

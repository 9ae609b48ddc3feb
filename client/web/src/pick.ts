// Picking: draws what is under one pixel into a target of one pixel that holds the distance from the eye and the field's
// value.
import { FloatType, type PerspectiveCamera, type WebGLRenderer, WebGLRenderTarget } from 'three';

export interface Picked {
  distance: number; // from the eye, world units
  value: number | null; // of the field; null: not known
}

export class Pick {
  private target = new WebGLRenderTarget(1, 1, { type: FloatType });
  private pixel = new Float32Array(4);

  // x, y: of a pixel of the canvas, CSS pixels from its upper left corner; its centre is picked. draw: draws the scene
  // with pick materials. null where nothing is drawn, or without float render targets.
  at(renderer: WebGLRenderer, camera: PerspectiveCamera, x: number, y: number, draw: () => void): Picked | null {
    if (!renderer.extensions.has('EXT_color_buffer_float')) return null;
    const { clientWidth, clientHeight } = renderer.domElement;
    camera.setViewOffset(clientWidth, clientHeight, x, y, 1, 1);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    draw();
    camera.clearViewOffset();
    renderer.readRenderTargetPixels(this.target, 0, 0, 1, 1, this.pixel);
    renderer.setRenderTarget(null);
    const [distance, value, isKnown, isDrawn] = this.pixel;
    return isDrawn! > 0 ? { distance: distance!, value: isKnown! > 0 ? value! : null } : null;
  }
}

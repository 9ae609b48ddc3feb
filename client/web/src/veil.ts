// Surfaces that one sees through, in any order: weighted blended transparency (see shaders.ts). Their colours are gathered in targets of their own,
// with the depth of what is solid, and then laid over the picture.
import { type Camera, HalfFloatType, NearestFilter, type WebGLRenderer, type WebGLRenderTarget } from 'three';
import { overMaterial } from './materials';
import { canvasTarget, fullScreen } from './passes';
import { kVeilOverFragment } from './shaders';

const kMostSmoothed = 3e6; // pixels: with more of them, edges are fine as they are, and four samples of each take too much memory

export class Veil {
  private target: WebGLRenderTarget | null = null;
  private material = overMaterial(kVeilOverFragment, { sums: { value: null }, weights: { value: null } });
  private over = fullScreen(this.material);

  // depth: draws what is solid; veils: draws what is not.
  draw(renderer: WebGLRenderer, camera: Camera, depth: () => void, veils: () => void): void {
    const target = this.obtained(renderer);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 1); // sums 0, and all of it shining through
    renderer.clear();
    depth();
    veils();
    renderer.setRenderTarget(null);
    renderer.render(this.over, camera);
  }

  private obtained(renderer: WebGLRenderer): WebGLRenderTarget {
    this.target = canvasTarget(renderer, this.target, (pixels) => ({
      count: 2,
      type: HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      samples: pixels > kMostSmoothed ? 0 : 4,
    }));
    this.material.uniforms['sums']!.value = this.target.textures[0];
    this.material.uniforms['weights']!.value = this.target.textures[1];
    return this.target;
  }
}

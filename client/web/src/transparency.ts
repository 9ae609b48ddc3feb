// Transparent surfaces, in any order: weighted blended order-independent transparency (see shaders.ts). They are
// accumulated in targets of their own, against the depth of the opaque surfaces, and then composited over the picture.
import { type Camera, HalfFloatType, NearestFilter, Texture, type WebGLRenderer, type WebGLRenderTarget } from 'three';
import { canvasSizedTarget, fullScreenScene } from './full_screen';
import { compositeMaterial } from './materials';
import { kTransparencyCompositeFragment } from './shaders';

// Pixels. A larger canvas gets no multisampling: its edges look fine without, and four samples take too much memory.
const kMultisampledPixels = 3e6;

export class Transparency {
  private target: WebGLRenderTarget | null = null;
  private uniforms = { accumulations: { value: new Texture() }, weights: { value: new Texture() } };
  private composite = fullScreenScene(compositeMaterial(kTransparencyCompositeFragment, this.uniforms));

  // drawDepth: draws the opaque surfaces, depth only; drawTransparent: the transparent ones.
  draw(renderer: WebGLRenderer, camera: Camera, drawDepth: () => void, drawTransparent: () => void): void {
    this.target = canvasSizedTarget(renderer, this.target, (pixels) => ({
      count: 2,
      type: HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      samples: pixels > kMultisampledPixels ? 0 : 4,
    }));
    [this.uniforms.accumulations.value, this.uniforms.weights.value] = this.target.textures as [Texture, Texture];
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 1); // sums 0, transmittance 1
    renderer.clear();
    drawDepth();
    drawTransparent();
    renderer.setRenderTarget(null);
    renderer.render(this.composite, camera);
  }
}

// How thick the solid is along each ray, whatever the order of its triangles: each adds its distance from the eye where the ray leaves the solid,
// and takes it where the ray enters, in floats. In the spirit of the paper's Figure 6.
import { type Camera, FloatType, HalfFloatType, NearestFilter, RedFormat, Vector2, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { roundAbove } from './format';
import { overMaterial, thicknessMaterial } from './materials';
import { canvasTarget, fullScreen } from './passes';
import { kMostFragment, kThicknessOverFragment } from './shaders';

const kBlocks = 32; // a side, as the shader has it

export class Thickness {
  readonly material = thicknessMaterial(0);
  readonly trouble: string | null; // why it cannot be drawn, or not well
  readonly possible: boolean;
  most = 1; // world units at the end of the ramp; follows the picture
  onMost: () => void = () => {}; // it has changed, or may: to be drawn again
  private precise: boolean;
  private target: WebGLRenderTarget | null = null;
  private overMaterial = overMaterial(kThicknessOverFragment, { sums: { value: null }, most: { value: 1 } });
  private over = fullScreen(this.overMaterial);
  private mostMaterial = overMaterial(kMostFragment, { sums: { value: null }, size: { value: new Vector2() } });
  private mostOver = fullScreen(this.mostMaterial);
  private mostTarget = new WebGLRenderTarget(kBlocks, kBlocks, { type: FloatType, depthBuffer: false });
  private mosts = new Float32Array(4 * kBlocks * kBlocks);
  private reading = false;
  private missed = false; // a picture was drawn meanwhile, perhaps another one

  constructor(renderer: WebGLRenderer) {
    this.possible = renderer.extensions.has('EXT_color_buffer_float');
    this.precise = this.possible && renderer.extensions.has('EXT_float_blend');
    this.trouble = !this.possible
      ? 'Thickness needs pictures of floats (EXT_color_buffer_float), which this graphics card or driver does not have.'
      : this.precise
        ? null
        : 'Thickness is rough here: this graphics card or driver adds only 16-bit floats (no EXT_float_blend).';
  }

  // layers: draws all triangles of the solid.
  draw(renderer: WebGLRenderer, camera: Camera, layers: () => void): void {
    const target = this.obtained(renderer);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    layers();
    void this.follow(renderer, camera);
    renderer.setRenderTarget(null);
    this.overMaterial.uniforms['most']!.value = this.most;
    renderer.render(this.over, camera);
  }

  // Looks for the greatest thickness in the picture, without waiting for it. The ramp's end is a round number above that, and stays while the
  // greatest is above a third of it: so colours are still while one turns.
  private async follow(renderer: WebGLRenderer, camera: Camera): Promise<void> {
    if (this.reading) {
      this.missed = true;
      return;
    }
    this.reading = true;
    this.missed = false;
    renderer.setRenderTarget(this.mostTarget);
    renderer.render(this.mostOver, camera);
    try {
      await renderer.readRenderTargetPixelsAsync(this.mostTarget, 0, 0, kBlocks, kBlocks, this.mosts);
    } catch {
      return; // the context was lost
    } finally {
      this.reading = false;
    }
    const greatest = this.mosts.reduce((most, x, i) => (i % 4 === 0 && x > most ? x : most), 0);
    const fits = !(greatest > 0) || (greatest <= this.most && greatest > this.most / 3);
    if (!fits) this.most = roundAbove(greatest);
    if (!fits || this.missed) this.onMost();
  }

  private obtained(renderer: WebGLRenderer): WebGLRenderTarget {
    this.target = canvasTarget(renderer, this.target, () => ({
      format: RedFormat,
      type: this.precise ? FloatType : HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      depthBuffer: false,
    }));
    this.overMaterial.uniforms['sums']!.value = this.mostMaterial.uniforms['sums']!.value = this.target.texture;
    this.mostMaterial.uniforms['size']!.value.set(this.target.width, this.target.height);
    return this.target;
  }
}

// The thickness of the solid along each ray, independent of the order of its triangles: each adds its distance from the
// eye where the ray leaves the solid and subtracts it where the ray enters. After Figure 6 of the paper.
import {
  type Camera, FloatType, HalfFloatType, NearestFilter, RedFormat, Texture, Vector2, type WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { roundUp } from './format';
import { canvasSizedTarget, fullScreenScene } from './full_screen';
import { compositeMaterial, thicknessMaterial } from './materials';
import { kBlockMaximumFragment, kThicknessCompositeFragment } from './shaders';

const kBlocks = 32; // per side; the same number as in kBlockMaximumFragment

export class Thickness {
  readonly material = thicknessMaterial(0);
  readonly limitation: string | null; // shown to the user: why thickness is not available, or not precise
  readonly isAvailable: boolean;
  maximum = 1; // world units at the end of the colour map; follows the picture
  onMaximum: () => void = () => {}; // the maximum has changed, or may change: draw again
  private isPrecise: boolean;
  private target: WebGLRenderTarget | null = null;
  private uniforms = { thickness: { value: new Texture() }, maximum: { value: 1 }, size: { value: new Vector2() } };
  private composite = fullScreenScene(compositeMaterial(kThicknessCompositeFragment, this.uniforms));
  private maximumPass = fullScreenScene(compositeMaterial(kBlockMaximumFragment, this.uniforms));
  private maximumTarget = new WebGLRenderTarget(kBlocks, kBlocks, { type: FloatType, depthBuffer: false });
  private blocks = new Float32Array(4 * kBlocks * kBlocks);
  isKnown = false; // the maximum, of what is shown
  private isOtherSurface = false; // drawn since the maximum was last read
  private isReading = false;
  private hasMissedPicture = false; // one was drawn while the last was being read

  constructor(renderer: WebGLRenderer) {
    this.isAvailable = renderer.extensions.has('EXT_color_buffer_float');
    this.isPrecise = this.isAvailable && renderer.extensions.has('EXT_float_blend');
    this.limitation = !this.isAvailable
      ? 'Thickness needs floating-point render targets (EXT_color_buffer_float), which this graphics card or driver does not support.'
      : this.isPrecise
        ? null
        : 'Thickness has low precision: this graphics card or driver blends only 16-bit floats (no EXT_float_blend).';
  }

  // Another data set: its maximum is not known.
  reset(): void {
    this.isKnown = false;
  }

  // The surface changes: the maximum becomes that of the new one, whatever it was before.
  surfaceChanged(): void {
    this.isOtherSurface = true;
  }

  // drawLayers: draws all triangles of the solid with thickness materials.
  draw(renderer: WebGLRenderer, camera: Camera, drawLayers: () => void): void {
    this.target = canvasSizedTarget(renderer, this.target, () => ({
      format: RedFormat,
      type: this.isPrecise ? FloatType : HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      depthBuffer: false,
    }));
    this.uniforms.thickness.value = this.target.texture;
    this.uniforms.size.value.set(this.target.width, this.target.height);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    drawLayers();
    if (this.isKnown) void this.updateMaximum(renderer, camera);
    else this.findMaximum(renderer, camera);
    renderer.setRenderTarget(null);
    this.uniforms.maximum.value = this.maximum;
    renderer.render(this.composite, camera);
  }

  // Waits for the graphics card: the first picture has its own colours, and not those of some other maximum.
  private findMaximum(renderer: WebGLRenderer, camera: Camera): void {
    renderer.setRenderTarget(this.maximumTarget);
    renderer.render(this.maximumPass, camera);
    renderer.readRenderTargetPixels(this.maximumTarget, 0, 0, kBlocks, kBlocks, this.blocks);
    const greatest = this.greatest();
    if (!(greatest > 0)) return; // nothing is shown yet
    this.maximum = roundUp(greatest);
    this.isKnown = true;
  }

  // Reads back the greatest thickness in the picture without blocking. The end of the colour map is a round number
  // above it, kept while the greatest thickness stays above a third of that: colours do not change during a rotation.
  private async updateMaximum(renderer: WebGLRenderer, camera: Camera): Promise<void> {
    if (this.isReading) {
      this.hasMissedPicture = true;
      return;
    }
    this.isReading = true;
    this.hasMissedPicture = false;
    const isOther = this.isOtherSurface;
    this.isOtherSurface = false;
    renderer.setRenderTarget(this.maximumTarget);
    renderer.render(this.maximumPass, camera);
    try {
      await renderer.readRenderTargetPixelsAsync(this.maximumTarget, 0, 0, kBlocks, kBlocks, this.blocks);
    } catch {
      return; // the context was lost
    } finally {
      this.isReading = false;
    }
    const greatest = this.greatest();
    const isRound = !isOther || this.maximum === roundUp(greatest);
    const fits = !(greatest > 0) || (greatest <= this.maximum && greatest > this.maximum / 3 && isRound);
    if (!fits) this.maximum = roundUp(greatest);
    if (!fits || this.hasMissedPicture) this.onMaximum();
  }

  private greatest(): number {
    return this.blocks.reduce((most, x, i) => (i % 4 === 0 && x > most ? x : most), 0);
  }
}

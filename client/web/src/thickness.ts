// How thick the solid is along each ray, whatever the order of its triangles: each adds its distance from the eye where the ray leaves the solid,
// and takes it where the ray enters, in floats. In the spirit of the paper's Figure 6.
import { type Camera, FloatType, HalfFloatType, NearestFilter, Vector2, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { overMaterial, thicknessMaterial } from './materials';
import { kThicknessOverFragment } from './shaders';
import { fullScreen } from './veil';

export class Thickness {
  readonly material = thicknessMaterial(0);
  readonly trouble: string | null; // why it cannot be drawn, or not well
  readonly possible: boolean;
  private precise: boolean;
  private target: WebGLRenderTarget | null = null;
  private size = new Vector2();
  private overMaterial = overMaterial(kThicknessOverFragment, { sums: { value: null }, most: { value: 1 } });
  private over = fullScreen(this.overMaterial);

  constructor(renderer: WebGLRenderer) {
    this.possible = renderer.extensions.has('EXT_color_buffer_float');
    this.precise = this.possible && renderer.extensions.has('EXT_float_blend');
    this.trouble = !this.possible
      ? 'Thickness needs pictures of floats (EXT_color_buffer_float), which this graphics card or driver does not have.'
      : this.precise
        ? null
        : 'Thickness is rough here: this graphics card or driver adds only 16-bit floats (no EXT_float_blend).';
  }

  // most: world units at the end of the ramp. layers: draws all triangles of the solid.
  draw(renderer: WebGLRenderer, camera: Camera, most: number, layers: () => void): void {
    const target = this.obtained(renderer);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    layers();
    renderer.setRenderTarget(null);
    this.overMaterial.uniforms['most']!.value = most;
    renderer.render(this.over, camera);
  }

  private obtained(renderer: WebGLRenderer): WebGLRenderTarget {
    renderer.getDrawingBufferSize(this.size);
    const { x: width, y: height } = this.size;
    if (this.target && this.target.width === width && this.target.height === height) return this.target;
    this.target?.dispose();
    this.target = new WebGLRenderTarget(width, height, {
      type: this.precise ? FloatType : HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      depthBuffer: false,
    });
    this.overMaterial.uniforms['sums']!.value = this.target.texture;
    return this.target;
  }
}

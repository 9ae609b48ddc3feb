// Volume rendering: each tetrahedron adds the light that it emits on a pixel's ray, and takes what it absorbs of the light
// from behind it, from the farthest to the nearest.
//
// After P. Shirley and A. Tuchman, A Polygonal Approximation to Direct Scalar Volume Rendering, 1990; but each pixel's
// ray is cut by the planes of the tetrahedron itself, as M. Weiler, M. Kraus, M. Merz and T. Ertl do it, Hardware-Based
// Ray Casting for Tetrahedral Meshes, 2003. The order is that of the tetrahedra's centres, by their distances from the
// eye, and while the camera moves that of the last view that the worker was told: neighbours of different sizes may be
// drawn in the wrong order, which changes their light a little.
import {
  BufferAttribute, type Camera, type Color, DataTexture, FloatType, HalfFloatType, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, NearestFilter, RGBAFormat,
  RGBAIntegerFormat, Scene, Texture, UnsignedIntType, Vector2, Vector3, type WebGLRenderer, type WebGLRenderTarget,
} from 'three';
import { type Frame } from '../package/src/frame';
import { canvasSizedTarget, fullScreenScene } from './full_screen';
import { volumeCompositeMaterial, volumeMaterial } from './materials';
import type { Volume } from '../package/src/messages';
import { kCells, type Look, transferTable } from './opacity';
import type { Range } from '../package/src/ranges';
import { kMostRanges } from './state';
import { kTetTriangles } from './tets';
import { diagonal } from '../package/src/vec';

const kWidth = 4096; // of textures; the same number as in kVolumeVertex

export class VolumeView {
  readonly isAvailable: boolean;
  private isPrecise: boolean;
  private version = 0; // of what is shown
  private geometry = new InstancedBufferGeometry();
  private uniforms = {
    points: { value: null as Texture | null },
    tets: { value: null as Texture | null },
    transfer: { value: null as DataTexture | null },
    values: { value: new Vector2(0, 1) }, // the least one; 1 / (the greatest - it)
    lengthScale: { value: 1 }, // 1 / (a hundredth of the box's diagonal)
  };
  private target: WebGLRenderTarget | null = null;
  private compositeUniforms = { light: { value: new Texture() }, background: { value: new Vector3() } };
  private composite = fullScreenScene(volumeCompositeMaterial(this.compositeUniforms));
  private scene = new Scene();

  constructor(renderer: WebGLRenderer) {
    this.isAvailable = renderer.extensions.has('EXT_color_buffer_float');
    this.isPrecise = this.isAvailable && renderer.extensions.has('EXT_float_blend');
    this.geometry.setIndex(new BufferAttribute(new Uint16Array(kTetTriangles), 1));
    this.geometry.instanceCount = 0;
    const mesh = new Mesh(this.geometry, volumeMaterial(this.uniforms));
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  // null: nothing.
  show(volume: Volume | null): void {
    this.version = volume?.version ?? 0;
    for (const uniform of [this.uniforms.points, this.uniforms.tets]) {
      uniform.value?.dispose();
      uniform.value = null;
    }
    this.setOrder(volume ? new Uint32Array(volume.order) : new Uint32Array());
    if (!volume) return;
    this.uniforms.points.value = texture(padded(new Float32Array(volume.points)));
    this.uniforms.tets.value = texture(padded(new Uint32Array(volume.tets)));
  }

  // Ignored if another version is shown.
  reorder(version: number, order: ArrayBuffer): void {
    if (version === this.version) this.setOrder(new Uint32Array(order));
  }

  get tets(): number {
    return this.geometry.instanceCount;
  }

  // ranges: those shown; where they overlap, the first shows its values.
  setTransfer(look: Look, ranges: readonly Range[]): void {
    const rows = Array.from({ length: kMostRanges }, (_, i) => transferTable(look, ranges.slice(0, i)));
    const table = new Float32Array(rows.reduce((sum, row) => sum + row.length, 0));
    rows.forEach((row, i) => table.set(row, i * row.length));
    this.uniforms.transfer.value?.dispose();
    this.uniforms.transfer.value = dataTexture(table, kCells + 1);
    const [low, high] = look.values;
    this.uniforms.values.value.set(low, 1 / (high - low));
  }

  draw(renderer: WebGLRenderer, camera: Camera, frame: Frame, background: Color): void {
    this.target = canvasSizedTarget(renderer, this.target, () => ({
      type: this.isPrecise ? FloatType : HalfFloatType,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      depthBuffer: false,
    }));
    this.uniforms.lengthScale.value = 100 / (diagonal(frame.box) || 1);
    this.compositeUniforms.light.value = this.target.texture;
    this.compositeUniforms.background.value.set(background.r, background.g, background.b);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    if (this.tets > 0 && this.uniforms.transfer.value) renderer.render(this.scene, camera);
    renderer.setRenderTarget(null);
    renderer.render(this.composite, camera);
  }

  // The same buffer as long as it fits.
  private setOrder(order: Uint32Array): void {
    const { geometry } = this;
    const old = geometry.getAttribute('order') as BufferAttribute | undefined;
    geometry.instanceCount = order.length;
    if (old?.array.length === order.length) {
      old.array = order;
      old.needsUpdate = true;
      return;
    }
    geometry.dispose();
    geometry.setAttribute('order', new InstancedBufferAttribute(order, 1));
  }
}

// Whole rows of texels of four numbers.
function padded<T extends Float32Array | Uint32Array>(numbers: T): T {
  const rows = Math.max(1, Math.ceil(numbers.length / (4 * kWidth)));
  const all = new (numbers.constructor as new (length: number) => T)(rows * 4 * kWidth);
  all.set(numbers);
  return all;
}

const texture = (numbers: Float32Array | Uint32Array): DataTexture => dataTexture(numbers, kWidth);

function dataTexture(numbers: Float32Array | Uint32Array, width: number): DataTexture {
  const isFloat = numbers instanceof Float32Array;
  const made = new DataTexture(numbers, width, numbers.length / (4 * width), isFloat ? RGBAFormat : RGBAIntegerFormat, isFloat ? FloatType : UnsignedIntType);
  if (!isFloat) made.internalFormat = 'RGBA32UI';
  made.needsUpdate = true;
  return made;
}

// What full-screen passes need: render targets of the canvas's size, and a triangle that covers the screen.
import {
  BufferGeometry, type RawShaderMaterial, type RenderTargetOptions, Scene, Vector2, type WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { staticMesh } from './static_mesh';

const size = new Vector2(); // scratch: of the canvas, in device pixels

type Options = (pixels: number) => RenderTargetOptions;

// A target as large as the canvas: the one passed in if its size fits; else a new one, and the old one is disposed.
// options: of the new one, given its number of pixels.
export function canvasSizedTarget(renderer: WebGLRenderer, target: WebGLRenderTarget | null, options: Options): WebGLRenderTarget {
  const { x: width, y: height } = renderer.getDrawingBufferSize(size);
  if (target && target.width === width && target.height === height) return target;
  target?.dispose();
  return new WebGLRenderTarget(width, height, options(width * height));
}

// A scene whose only mesh is the triangle of kFullScreenVertex.
export function fullScreenScene(material: RawShaderMaterial): Scene {
  const geometry = new BufferGeometry();
  geometry.setDrawRange(0, 3);
  return new Scene().add(staticMesh(geometry, material));
}

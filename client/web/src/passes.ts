// What passes over the whole picture are made of: targets as large as it is, and a triangle that covers it.
import { BufferGeometry, Mesh, type RawShaderMaterial, type RenderTargetOptions, Scene, Vector2, type WebGLRenderer, WebGLRenderTarget } from 'three';

const size = new Vector2(); // of the canvas, in its own pixels

// The target, if it is as large as the canvas; else another one in its place, and the old one must not be used again.
export function canvasTarget(renderer: WebGLRenderer, target: WebGLRenderTarget | null, options: (pixels: number) => RenderTargetOptions): WebGLRenderTarget {
  const { x: width, y: height } = renderer.getDrawingBufferSize(size);
  if (target && target.width === width && target.height === height) return target;
  target?.dispose();
  return new WebGLRenderTarget(width, height, options(width * height));
}

export function fullScreen(material: RawShaderMaterial): Scene {
  const geometry = new BufferGeometry();
  geometry.setDrawRange(0, 3);
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  const scene = new Scene();
  scene.add(mesh);
  return scene;
}

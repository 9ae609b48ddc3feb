// Uploads geometry to the graphics card before it is drawn, a limited amount per frame. three.js uploads what it draws,
// so each geometry is drawn once with an empty draw range into a target of one pixel.
import { BufferAttribute, BufferGeometry, Camera, Scene, Sphere, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { uploadMaterial } from './materials';
import { staticMesh } from './static_mesh';

// The budget of a frame. Bytes are limited, too: the browser copies them to its GPU process, and blocks this thread
// while too many are on their way.
const kBudgetMs = 4;
const kBudgetBytes = 2e6;

// The field's values at the vertices of a geometry; null: it has none.
export function setValues(geometry: BufferGeometry, values: ArrayBuffer | Float32Array | null): void {
  if (values) geometry.setAttribute('value', new BufferAttribute(new Float32Array(values), 1));
}

export class Uploader {
  private scene = new Scene();
  private target = new WebGLRenderTarget(1, 1);
  private mesh = staticMesh(new BufferGeometry(), uploadMaterial());
  private camera = new Camera();
  private deadline = 0; // performance.now()
  private bytesLeft = 0;

  constructor(private renderer: WebGLRenderer) {
    this.scene.add(this.mesh);
    const empty = new BufferGeometry(); // compiles the shader, so that the first piece need not wait for it
    empty.setAttribute('position', new BufferAttribute(new Uint32Array(4), 4));
    this.send(empty, 0);
    empty.dispose();
  }

  beginFrame(): void {
    this.deadline = performance.now() + kBudgetMs;
    this.bytesLeft = kBudgetBytes;
  }

  // Whether this frame's budget is not used up.
  get hasBudget(): boolean {
    return this.bytesLeft > 0 && performance.now() < this.deadline;
  }

  // bytes: what to count against the budget.
  send(geometry: BufferGeometry, bytes: number): void {
    geometry.boundingSphere ??= new Sphere(); // else three.js visits all vertices to compute one
    geometry.setDrawRange(0, 0);
    this.mesh.geometry = geometry;
    this.renderer.setRenderTarget(this.target);
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(null);
    geometry.setDrawRange(0, Infinity);
    this.bytesLeft -= bytes;
  }
}

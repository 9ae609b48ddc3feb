// Brings geometry to the graphics card before it is to be drawn. three.js uploads what it draws: so it draws nothing of it, into a picture of one pixel.
import { BufferAttribute, BufferGeometry, Camera, Mesh, Scene, Sphere, type WebGLRenderer, WebGLRenderTarget } from 'three';
import { stagingMaterial } from './materials';

const kStretchMs = 4; // of uploading between two pictures, and
const kStretchBytes = 2e6; // ... at most so many: the browser takes them to another process, and waits for that where they are many

export class Uploader {
  private scene = new Scene();
  private target = new WebGLRenderTarget(1, 1);
  private mesh = new Mesh(new BufferGeometry(), stagingMaterial());
  private nobody = new Camera();
  private end = 0;
  private bytesLeft = 0;

  constructor(private renderer: WebGLRenderer) {
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh);
    const nothing = new BufferGeometry(); // once, so that the first piece finds the shader ready
    nothing.setAttribute('position', new BufferAttribute(new Uint32Array(4), 4));
    this.send(nothing, 0);
    nothing.dispose();
  }

  begin(): void {
    this.end = performance.now() + kStretchMs;
    this.bytesLeft = kStretchBytes;
  }

  // Whether there is time for more, since begin().
  get open(): boolean {
    return this.bytesLeft > 0 && performance.now() < this.end;
  }

  send(geometry: BufferGeometry, bytes: number): void {
    geometry.boundingSphere ??= new Sphere(); // or three.js goes through all vertices to sort what it draws
    geometry.setDrawRange(0, 0);
    this.mesh.geometry = geometry;
    this.renderer.setRenderTarget(this.target);
    this.renderer.render(this.scene, this.nobody);
    this.renderer.setRenderTarget(null);
    geometry.setDrawRange(0, Infinity);
    this.bytesLeft -= bytes;
  }
}

// A page of somebody else, built with Vite from the packed package. package_test.mjs calls what it puts in `window`.
import { addressOf, arraysOf, type Dataset, describe, frameOf, LiveMesh, LocalDataset, type Range, streamUrl, type SurfaceChange, surfacesOf, viewOf } from '@intervale/client';
import '@intervale/client/element';
import { IntervalVolume } from '@intervale/client/three';
import { DirectionalLight, Mesh, PerspectiveCamera, Raycaster, Scene, Vector2, WebGLRenderer } from 'three';

// The volume that triangles enclose, world units.
function enclosed(positions: ArrayLike<number>, indices: ArrayLike<number>): number {
  let sum = 0;
  for (let t = 0; t < indices.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => [0, 1, 2].map((axis) => positions[3 * indices[t + k]! + axis]!)) as [number[], number[], number[]];
    sum += a[0]! * (b[1]! * c[2]! - b[2]! * c[1]!) - a[1]! * (b[0]! * c[2]! - b[2]! * c[0]!) + a[2]! * (b[0]! * c[1]! - b[1]! * c[0]!);
  }
  return sum / 6;
}

// The whole mesh, as arrays.
class Arrays {
  readonly events: string[] = [];
  private readonly mesh: LiveMesh;
  private readonly pieces = new Map<number, { range: number; triangles: number; volume: number; levels: number }>();

  constructor(private readonly dataset: Dataset, to: string | MessagePort, ranges: Range[]) {
    this.mesh = new LiveMesh();
    for (const type of ['load-start', 'load-end'] as const) this.mesh.addEventListener(type, () => this.events.push(type));
    this.mesh.addEventListener('load-error', ({ detail }) => this.events.push(detail.text));
    this.mesh.addEventListener('surface', ({ detail }) => this.apply(detail.change));
    this.mesh.open(to, dataset.name, surfacesOf(viewOf(dataset, [400, 300], { ranges, region: frameOf(dataset).box })));
  }

  setRanges(ranges: Range[]): void {
    this.mesh.updateView({ ranges });
  }

  ended(): Promise<void> {
    return new Promise((resolve) => this.mesh.addEventListener('load-end', () => resolve(), { once: true }));
  }

  async shown() {
    const all = [...this.pieces.values()];
    return {
      digest: await this.mesh.digest(),
      triangles: all.reduce((sum, piece) => sum + piece.triangles, 0),
      volume: all.reduce((sum, piece) => sum + piece.volume, 0),
      levels: Math.max(...all.map((piece) => piece.levels)),
      file: (await this.mesh.save('stl')).byteLength,
      events: this.events,
    };
  }

  private apply(change: SurfaceChange): void {
    const { affine, center } = frameOf(this.dataset);
    for (const [id, { range }] of this.pieces) if (change.reset.includes(range)) this.pieces.delete(id);
    for (const id of change.removed) this.pieces.delete(id);
    for (const piece of change.pieces) {
      const { positions, indices, groups, levels } = arraysOf(piece, affine, center);
      const triangles = groups.reduce((sum, count) => sum + count, 0);
      this.pieces.set(piece.id, { range: piece.range, triangles, volume: enclosed(positions, indices), levels: Math.max(...levels) });
    }
  }
}

// What a camera needs of the mesh, drawn by three.js.
class Three {
  readonly volume: IntervalVolume;
  private readonly renderer = new WebGLRenderer({ canvas: document.querySelector<HTMLCanvasElement>('#three')!, preserveDrawingBuffer: true });
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(30, 4 / 3, 0.1, 1000);
  readonly events: string[] = [];

  constructor(address: string, ranges: Range[]) {
    this.volume = new IntervalVolume(address, { ranges, colorBy: 'value' });
    this.volume.setCamera(this.camera);
    this.volume.setResolutionFromRenderer(this.renderer);
    this.volume.position.set(5, -3, 2); // as any object
    this.volume.rotation.set(0.3, 0.2, 0.1);
    this.volume.scale.setScalar(2);
    this.camera.position.set(5, -3, 14);
    const light = new DirectionalLight('#ffffff', 3);
    light.position.set(0, 0, 1);
    this.scene.add(this.volume, light);
    for (const type of ['load-start', 'load-end'] as const) this.volume.addEventListener(type, () => this.events.push(type));
    this.volume.addEventListener('load-error', ({ error }) => this.events.push(error.message));
    this.renderer.setAnimationLoop(() => {
      this.volume.update();
      this.renderer.render(this.scene, this.camera);
    });
  }

  ended(): Promise<void> {
    return new Promise((resolve) => this.volume.mesh.addEventListener('load-end', () => resolve(), { once: true }));
  }

  // What the ray through the middle of the picture hits first, and the volume that is enclosed, object's units.
  shown() {
    const raycaster = new Raycaster();
    raycaster.setFromCamera(new Vector2(0, 0), this.camera);
    let volume = 0;
    this.volume.traverse((object) => {
      if (object instanceof Mesh) volume += enclosed(object.geometry.getAttribute('position').array, object.geometry.index!.array);
    });
    return { distance: raycaster.intersectObject(this.volume)[0]?.distance ?? null, volume, version: this.volume.version, events: this.events };
  }

  dispose(): void {
    this.renderer.setAnimationLoop(null);
    this.volume.dispose();
    this.renderer.dispose();
  }
}

const consumer = {
  arrays: async (address: string, ranges: Range[]) => new Arrays(await describe(address), streamUrl(addressOf(address).base), ranges),
  // Of a file that is fetched, without the server of its data set: a mesh for each of these.
  fileArrays: async (url: string, ...each: Range[][]) => {
    const local = await LocalDataset.open(await (await fetch(url)).blob(), 'any.ivm');
    return each.map((ranges) => new Arrays(local.dataset, local.connect(), ranges));
  },
  // Why a file is refused.
  refusal: (text: string) => LocalDataset.open(new Blob([text]), 'text.ivm').then(() => '', (error: Error) => error.message),
  three: (address: string, ranges: Range[]) => new Three(address, ranges),
};
declare global {
  interface Window {
    consumer: typeof consumer;
  }
}
window.consumer = consumer;

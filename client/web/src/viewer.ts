// Schedules the picture: uploads what the worker sends between frames, draws when something has changed, and reports
// which version of the boundary surface is shown.
import { fitted, type Pose } from '../package/src/camera';
import type { Dataset } from '../package/src/datasets';
import { type Frame, frameOf } from '../package/src/frame';
import { GpuFence } from './gpu_fence';
import type { LiveMesh } from '../package/src/live_mesh';
import type { Cap, Volume } from '../package/src/messages';
import { Picture, type Probed } from './picture';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, sub } from '../package/src/vec';

export class Stats {
  frames = 0; // drawn
  longestBlock = 0; // ms: longest block of this thread by uploads, since it was last set to 0
  surfaceVersion = 0; // of the boundary surface shown; 0: none
  capTriangles = 0; // shown
  volumeTets = 0; // shown by volume rendering
  tets = 0; // shrunken tetrahedra shown
  probes = 0; // answered
  firstMeshMs = 0; // from navigation to the first picture with triangles; 0: none yet
}

export class Viewer {
  readonly picture: Picture;
  readonly stats = new Stats();
  frame: Frame | null = null; // of the open data set
  onShown: (version: number) => void = () => {}; // of the surface
  onDrawn: () => void = () => {};
  onProbed: (found: Probed | null) => void = () => {}; // the answer to probe(); null: nothing is drawn there
  onResize: () => void = () => {};
  onContext: (isLost: boolean) => void = () => {}; // the WebGL context was lost or restored
  private pendingVolume: Volume | null = null; // as pendingCap
  private pendingCap: Cap | null = null; // shown with its surface, or at once if that is shown already
  private probedAt: readonly [x: number, y: number] | null = null; // asked for and not yet answered
  private isDirty = true; // a draw is needed
  private isScheduled = false; // step() is requested
  private isLost = false; // the WebGL context
  private fence: GpuFence;

  // Throws if there is no WebGL 2.
  constructor(canvas: HTMLCanvasElement, private view: Store<ViewState>) {
    this.picture = new Picture(canvas);
    this.fence = new GpuFence(this.picture.renderer.getContext() as WebGL2RenderingContext);
    new ResizeObserver(() => {
      if (!this.picture.resize()) return;
      this.onResize();
      this.draw(); // at once: resizing clears the canvas
    }).observe(canvas);
    canvas.addEventListener('webglcontextlost', () => {
      this.isLost = true;
      this.fence.forget();
      this.onContext(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.isLost = false;
      this.onContext(false);
      this.invalidate(); // three.js uploads the buffers again, from the arrays it keeps
    });
    this.picture.thickness.onMaximum = () => this.invalidate();
    view.watch([], () => {
      this.restyle();
      this.invalidate();
    });
  }

  // Once what is shown has as many ranges as the view: before, each would have the style of another one.
  private restyle(): void {
    const { ranges } = this.picture.surface;
    if (ranges === 0 || ranges === Math.max(1, this.view.value.ranges.length)) this.picture.setStyles(this.view.value);
  }

  open(dataset: Dataset): void {
    this.pendingCap = this.pendingVolume = null;
    this.frame = frameOf(dataset);
    this.picture.open(this.frame);
    this.invalidate();
  }

  // The chosen camera, or else one that shows the whole data set; null: none is open.
  pose(): Pose | null {
    const { canvas } = this.picture;
    const aspect = canvas.clientWidth / Math.max(1, canvas.clientHeight);
    return this.view.value.pose ?? (this.frame ? fitted(this.frame.box, aspect) : null);
  }

  // Moves the camera. make: from where it is, and the size of the canvas, CSS pixels.
  move(make: (pose: Pose, width: number, height: number) => Pose): void {
    const pose = this.pose();
    const { clientWidth, clientHeight } = this.picture.canvas;
    if (pose) this.view.set({ pose: make(pose, clientWidth, clientHeight) });
  }

  // Shows what arrives of a mesh.
  watch(mesh: LiveMesh): void {
    mesh.addEventListener('surface', ({ detail }) => this.take(() => this.picture.surface.take(detail.change)));
    mesh.addEventListener('cap', ({ detail }) => this.take(() => (this.pendingCap = detail.cap)));
    mesh.addEventListener('tets', ({ detail }) => this.take(() => this.picture.tets.take(detail.tets)));
    mesh.addEventListener('volume', ({ detail }) => this.take(() => (this.pendingVolume = detail.volume)));
    mesh.addEventListener('order', ({ detail }) => this.take(() => this.takeOrder(detail.version, detail.order)));
  }

  private take(change: () => void): void {
    change();
    this.schedule();
  }

  private takeOrder(version: number, order: ArrayBuffer): void {
    if (this.pendingVolume?.version === version) this.pendingVolume.order = order;
    else this.picture.volume.reorder(version, order);
    this.isDirty = true;
  }

  // Requests a draw.
  invalidate(): void {
    this.isDirty = true;
    this.schedule();
  }

  // The canvas as PNG, without outlines; null if the browser cannot encode it.
  photograph(): Promise<Blob | null> {
    this.draw(false);
    return new Promise((resolve) => {
      this.picture.canvas.toBlob(resolve, 'image/png');
      this.invalidate();
    });
  }

  // Makes the point drawn at x, y (CSS pixels of the canvas) the centre of rotation.
  centerOn(x: number, y: number): void {
    const pose = this.pose();
    const found = this.frame && pose && !this.isLost ? this.picture.probe(this.frame, pose, x, y) : null;
    if (!found || !pose) return;
    this.view.set({ pose: { ...pose, lookAt: found.at, eye: add(found.at, sub(pose.eye, pose.lookAt)) } });
  }

  // Asks what is drawn at x, y (CSS pixels of the canvas), once the picture is complete; null: nothing any more.
  probe(at: readonly [x: number, y: number] | null): void {
    this.probedAt = at;
    if (at) this.schedule();
  }

  private schedule(): void {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => this.step());
  }

  private step(): void {
    this.isScheduled = false;
    if (this.isLost) return;
    // While the graphics card draws, any other WebGL call could block this thread until it is done; so none is made.
    if (this.fence.isPending) return this.schedule();
    const start = performance.now();
    const shown = this.frame && this.isUploading() ? this.upload(this.frame) : 0;
    this.stats.longestBlock = Math.max(this.stats.longestBlock, performance.now() - start);
    const pose = this.pose();
    if (this.isDirty) this.draw();
    else if (this.probedAt && this.frame && pose) {
      const [x, y] = this.probedAt;
      this.probedAt = null;
      this.stats.probes++;
      this.onProbed(this.picture.probe(this.frame, pose, x, y));
    }
    if (shown > 0) {
      this.stats.surfaceVersion = shown;
      if (this.stats.firstMeshMs === 0 && this.picture.surface.faces.children.length > 0) {
        this.stats.firstMeshMs = performance.mark('intervale: first mesh').startTime;
      }
      this.onShown(shown);
    }
    if (this.isUploading() || this.isDirty || this.probedAt) this.schedule();
  }

  private isUploading(): boolean {
    return this.picture.surface.isBusy || this.picture.tets.isBusy || this.pendingCap !== null || this.pendingVolume !== null;
  }

  // Uploads for one frame's budget. Returns the version of the surface that this completed; 0: none.
  private upload(frame: Frame): number {
    const { surface, tets, uploader } = this.picture;
    uploader.beginFrame();
    let shown = 0;
    if (surface.upload(frame)) {
      if (this.pendingCap && !uploader.hasBudget) return 0; // surface and cap together, in the next frame
      surface.swap();
      this.restyle();
      this.picture.thickness.surfaceChanged();
      shown = surface.version;
      this.isDirty = true;
    }
    const cap = this.pendingCap;
    if (cap && (!surface.isBusy || cap.version <= surface.version)) {
      this.pendingCap = null;
      this.picture.setCap(frame, cap);
      this.stats.capTriangles = cap.plane ? cap.triangles.reduce((sum, count) => sum + count, 0) : 0;
      this.isDirty = true;
    }
    const volume = this.pendingVolume;
    if (volume && (!surface.isBusy || volume.version <= surface.version)) {
      this.pendingVolume = null;
      this.picture.volume.show(volume);
      this.stats.volumeTets = this.picture.volume.tets;
      this.isDirty = true;
    }
    const complete = surface.isBusy ? null : tets.upload();
    if (complete) {
      this.picture.showTets(frame, complete.box);
      this.stats.tets = complete.box ? complete.count : 0;
      this.isDirty = true;
    }
    return shown;
  }

  private draw(withOutlines = true): void {
    const pose = this.pose();
    if (!this.frame || !pose || this.isLost) return;
    this.isDirty = false;
    const { clip, region } = this.view.value;
    this.picture.outlines.set(this.frame, region, clip);
    this.picture.draw(this.frame, pose, this.view.value, withOutlines);
    this.fence.insert();
    this.stats.frames++;
    this.onDrawn();
  }
}

// Schedules the picture: uploads what the worker sends between frames, draws when something has changed, and reports
// which version of the boundary surface is shown.
import { fitted, type Pose } from '../package/src/camera';
import type { Dataset } from '../package/src/datasets';
import { type Frame, frameOf } from '../package/src/frame';
import { FramePace } from '../package/src/frame_pace';
import { GpuFence } from './gpu_fence';
import type { LiveMesh } from '../package/src/live_mesh';
import type { Cap, SurfaceChange, Volume } from '../package/src/messages';
import { Picture, type Probed } from './picture';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, sub } from '../package/src/vec';

const kRestMs = 150; // after which the camera rests that has not moved
const kShare = 0.9; // of the time between two frames that a picture may take
const kPollMs = 4; // how often to look whether a picture is done

export class Stats {
  frames = 0; // drawn
  coarseFrames = 0; // ... of those, with the stand-in
  isCoarse = false; // the last picture has the stand-in
  standInTriangles = 0; // of the stand-in that could be drawn; 0: there is none
  longestFrame = 0; // ms: the longest that a picture took, on the graphics card, too, since it was last set to 0
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
  onStandIn: () => void = () => {}; // another stand-in is wanted: see wantedStandIn
  onProbed: (found: Probed | null) => void = () => {}; // the answer to probe(); null: nothing is drawn there
  onResize: () => void = () => {};
  onContext: (isLost: boolean) => void = () => {}; // the WebGL context was lost or restored
  private pendingVolume: Volume | null = null; // as pendingCap
  private pendingCap: Cap | null = null; // shown with its surface, or at once if that is shown already
  private probedAt: readonly [x: number, y: number] | null = null; // asked for and not yet answered
  private isDirty = true; // a draw is needed
  private isScheduled = false; // step() is requested
  private isLost = false; // the WebGL context
  private pace = new FramePace();
  private restTimer = 0; // runs while the camera moves
  private hasMoved = false; // since the last picture
  // The picture that is being drawn. isMove: of another camera than the last one's.
  private timed: { start: number; triangles: number; isCoarse: boolean; isMove: boolean } | null = null;
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
      this.timed = null;
      this.fence.forget();
      this.onContext(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.isLost = false;
      this.onContext(false);
      this.invalidate(); // three.js uploads the buffers again, from the arrays it keeps
    });
    this.picture.thickness.onMaximum = () => this.invalidate();
    let pose = view.value.pose;
    view.watch(['pose'], (value) => {
      if (value.pose !== pose) this.moved();
      pose = value.pose;
    });
    view.watch(['frameRate'], () => {
      this.pace = new FramePace();
      this.onStandIn();
    });
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

  // Triangles of a stand-in that would be drawn in time; null: none is needed.
  get wantedStandIn(): number | null {
    return this.view.value.frameRate > 0 ? this.pace.budget : null;
  }

  private moved(): void {
    this.hasMoved = true;
    this.restSoon();
  }

  // Counts from when the picture of the last move is done: what moves the camera may wait for that.
  private restSoon(): void {
    window.clearTimeout(this.restTimer);
    this.restTimer = window.setTimeout(() => {
      if (this.timed?.isMove) return this.restSoon();
      this.restTimer = 0;
      if (this.stats.isCoarse) this.invalidate();
    }, kRestMs);
  }

  open(dataset: Dataset): void {
    this.pace = new FramePace();
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
    mesh.addEventListener('standIn', ({ detail }) => this.take(() => this.takeStandIn(detail.change)));
    mesh.addEventListener('cap', ({ detail }) => this.take(() => (this.pendingCap = detail.cap)));
    mesh.addEventListener('tets', ({ detail }) => this.take(() => this.picture.tets.take(detail.tets)));
    mesh.addEventListener('volume', ({ detail }) => this.take(() => (this.pendingVolume = detail.volume)));
    mesh.addEventListener('order', ({ detail }) => this.take(() => this.takeOrder(detail.version, detail.order)));
  }

  private take(change: () => void): void {
    change();
    this.schedule();
  }

  private takeStandIn(change: SurfaceChange | null): void {
    const { standIn } = this.picture;
    if (change) return standIn.take(change);
    standIn.clear();
    this.stats.standInTriangles = 0;
    if (this.stats.isCoarse) this.isDirty = true;
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

  // Whether all that has arrived is drawn; the graphics card may still be drawing it.
  get isIdle(): boolean {
    return !this.isScheduled;
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
    this.measure();
    const start = performance.now();
    const shown = this.frame && this.isUploading() ? this.upload(this.frame) : 0;
    this.stats.longestBlock = Math.max(this.stats.longestBlock, performance.now() - start);
    const pose = this.pose();
    if (this.isDirty) this.draw();
    else if (this.probedAt && this.frame && pose && !this.stats.isCoarse) {
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
    if (this.isUploading() || this.isDirty || (this.probedAt && !this.stats.isCoarse)) this.schedule();
  }

  private isUploading(): boolean {
    const { surface, standIn, tets } = this.picture;
    return surface.isBusy || standIn.isBusy || tets.isBusy || this.pendingCap !== null || this.pendingVolume !== null;
  }

  // Uploads for one frame's budget. Returns the version of the surface that this completed; 0: none.
  private upload(frame: Frame): number {
    const { surface, standIn, tets, uploader } = this.picture;
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
    if (standIn.upload(frame)) {
      standIn.swap();
      this.stats.standInTriangles = standIn.triangles;
      this.isDirty ||= this.isMoving;
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
    const start = performance.now();
    this.picture.outlines.set(this.frame, region, clip);
    this.stats.isCoarse = withOutlines && this.isMoving && this.wantedStandIn !== null && this.picture.standIn.version > 0;
    const drawn = this.stats.isCoarse ? this.picture.standIn : this.picture.surface;
    this.picture.draw(this.frame, pose, this.view.value, withOutlines, drawn);
    this.fence.insert();
    this.timed = { start, triangles: drawn.triangles, isCoarse: this.stats.isCoarse, isMove: this.hasMoved };
    this.hasMoved = false;
    window.setTimeout(() => this.poll(), kPollMs);
    this.stats.frames++;
    if (this.stats.isCoarse) this.stats.coarseFrames++;
    this.onDrawn();
  }

  private get isMoving(): boolean {
    return this.restTimer !== 0;
  }

  // More often than there are frames: how long a picture took would not be known well otherwise.
  private poll(): void {
    if (!this.timed || this.isLost) return;
    if (this.fence.isPending) window.setTimeout(() => this.poll(), kPollMs);
    else this.measure();
  }

  // The picture is done: learns from the time that it took.
  private measure(): void {
    if (!this.timed) return;
    const { start, triangles, isCoarse, isMove } = this.timed;
    this.timed = null;
    if (isMove && this.isMoving) this.restSoon();
    const ms = performance.now() - start;
    this.stats.longestFrame = Math.max(this.stats.longestFrame, ms);
    const { frameRate, render } = this.view.value;
    if (frameRate === 0 || render === 'volume') return;
    const before = this.pace.budget;
    const allowed = (kShare * 1000) / frameRate;
    if (isCoarse) this.pace.drewStandIn(triangles, ms, allowed);
    else this.pace.drewAll(triangles, ms, allowed);
    if (this.pace.budget !== before) this.onStandIn();
  }
}

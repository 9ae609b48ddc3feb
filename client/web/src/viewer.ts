// The picture and what comes from the worker for it: uploads between frames, draws when something has changed, and tells the worker what is shown.
import { fitted, type Pose } from './camera';
import { type Frame, frameOf } from './frame';
import type { Listed } from './live';
import type { Cap, Skin, Tets } from './messages';
import { Picture } from './picture';
import type { ViewState } from './state';
import type { Store } from './store';
import { add, sub } from './vec';

export interface Stats {
  frames: number; // drawn
  lastFrameMs: number; // what the last took on this thread
  longestBlock: number; // ms of this thread that taking, uploading or swapping a skin took at a stretch, drawing apart; since it was last set to 0
  skinVersion: number; // on screen
  skinTriangles: number;
  skinBytes: number; // of buffers on the graphics card
  capTriangles: number; // on screen
  tets: number; // shrunken, on screen
  firstMeshMs: number; // from navigation to the first picture with triangles; 0: none yet
}

export class Viewer {
  readonly picture: Picture;
  readonly stats: Stats = {
    frames: 0,
    lastFrameMs: 0,
    longestBlock: 0,
    skinVersion: 0,
    skinTriangles: 0,
    skinBytes: 0,
    capTriangles: 0,
    tets: 0,
    firstMeshMs: 0,
  };
  frame: Frame | null = null;
  onShown: (version: number) => void = () => {};
  onDrawn: () => void = () => {};
  onResize: () => void = () => {};
  onContext: (lost: boolean) => void = () => {};
  private coarsest = 1;
  private cap: Cap | null = null; // that waits to be shown
  private dirty = true;
  private asked = false;
  private lost = false;
  private fence: WebGLSync | null = null; // behind the last picture

  // Throws if there is no WebGL 2.
  constructor(canvas: HTMLCanvasElement, private view: Store<ViewState>) {
    this.picture = new Picture(canvas);
    new ResizeObserver(() => {
      if (!this.picture.resize()) return;
      this.onResize();
      this.draw(); // at once: the canvas has just been emptied
    }).observe(canvas);
    canvas.addEventListener('webglcontextlost', () => {
      this.lost = true;
      this.fence = null;
      this.onContext(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.lost = false;
      this.onContext(false);
      this.changed(); // buffers come again from what the pieces keep
    });
    this.picture.thickness.onMost = () => this.changed();
    view.watch([], () => {
      this.applyLooks();
      this.changed();
    });
  }

  open(dataset: Listed): void {
    this.picture.skin.clear();
    this.cap = null;
    this.frame = frameOf(dataset);
    this.picture.setFrame(this.frame);
    this.picture.setCap(this.frame, null);
    this.picture.tets.clear();
    this.picture.showTets(this.frame, null);
    this.coarsest = Math.max(1, Math.ceil(Math.log2(Math.max(...dataset.dims) - 1)) - 1);
    this.picture.resize();
    this.applyLooks();
    this.changed();
  }

  // Where one looks from: as chosen, or else at everything.
  pose(): Pose | null {
    const { canvas } = this.picture;
    return this.view.value.pose ?? (this.frame ? fitted(this.frame.box, canvas.clientWidth / Math.max(1, canvas.clientHeight)) : null);
  }

  takeSkin(skin: Skin): void {
    this.timed(() => this.picture.skin.take(skin));
    this.ask();
  }

  // A cap of a skin that is still to be shown waits for it.
  takeCap(cap: Cap): void {
    this.cap = cap;
    this.ask();
  }

  takeTets(tets: Tets): void {
    this.picture.tets.take(tets);
    this.ask();
  }

  changed(): void {
    this.dirty = true;
    this.ask();
  }

  // What is seen without handles and guides.
  photograph(): Promise<Blob | null> {
    this.draw(false);
    return new Promise((resolve) => {
      this.picture.canvas.toBlob(resolve, 'image/png');
      this.changed();
    });
  }

  // Brings what is drawn at this pixel to the middle, to turn about it.
  centre(x: number, y: number): void {
    const pose = this.pose();
    const at = this.frame && pose && !this.lost ? this.picture.at(this.frame, pose, x, y) : null;
    if (!at || !pose) return;
    this.view.set({ pose: { ...pose, lookAt: at, eye: add(at, sub(pose.eye, pose.lookAt)) } });
  }

  private ask(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.step());
  }

  private step(): void {
    this.asked = false;
    if (this.lost) return;
    if (this.drawing()) return this.ask();
    const { skin } = this.picture;
    const shown = this.frame && this.waiting() ? this.timed(() => this.upload(this.frame!)) : 0;
    if (this.dirty) this.draw();
    if (shown > 0) {
      Object.assign(this.stats, { skinVersion: shown, skinTriangles: skin.triangles, skinBytes: skin.bytes });
      if (this.stats.firstMeshMs === 0 && skin.triangles > 0) this.stats.firstMeshMs = performance.mark('intervale: first mesh').startTime;
      this.onShown(shown);
    }
    if (this.waiting() || this.dirty) this.ask();
  }

  private waiting(): boolean {
    return this.picture.skin.busy || this.picture.tets.busy || this.cap !== null;
  }

  // Goes on with what waits to be uploaded. The version of the skin that is complete now; 0: none.
  private upload(frame: Frame): number {
    const { skin, tets, uploader } = this.picture;
    uploader.begin();
    let shown = 0;
    if (skin.upload(frame)) {
      if (this.cap && !uploader.open) return 0; // both in the next stretch
      skin.swap();
      shown = skin.version;
      this.dirty = true;
    }
    if (this.cap && (!skin.busy || this.cap.version <= skin.version)) this.showCap(this.cap);
    const complete = skin.busy ? null : tets.upload();
    if (complete) {
      this.picture.showTets(frame, complete.box);
      this.stats.tets = complete.box ? complete.count : 0;
      this.dirty = true;
    }
    return shown;
  }

  private draw(withGuides = true): void {
    const pose = this.pose();
    if (!this.frame || !pose || this.lost) return;
    const start = performance.now();
    this.dirty = false;
    const { clip, region } = this.view.value;
    this.picture.guides.set(this.frame, { region, plane: clip });
    this.picture.draw(this.frame, pose, this.view.value, withGuides);
    this.putFence();
    this.stats.frames++;
    this.stats.lastFrameMs = performance.now() - start;
    this.onDrawn();
  }

  // Whether the graphics card is still at the last picture. Whatever is asked of it meanwhile may have to wait, and this thread with it; so nothing is.
  private drawing(): boolean {
    if (!this.fence) return false;
    const gl = this.picture.renderer.getContext() as WebGL2RenderingContext;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return true;
    gl.deleteSync(this.fence);
    this.fence = null;
    return false;
  }

  private putFence(): void {
    const gl = this.picture.renderer.getContext() as WebGL2RenderingContext;
    if (this.fence) gl.deleteSync(this.fence);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  private showCap(cap: Cap): void {
    this.cap = null;
    this.dirty = true;
    if (this.frame) this.picture.setCap(this.frame, cap);
    this.stats.capTriangles = cap.plane ? cap.triangles : 0;
  }

  private applyLooks(): void {
    this.picture.setLooks(this.view.value, this.coarsest);
  }

  private timed<T>(work: () => T): T {
    const start = performance.now();
    const made = work();
    this.stats.longestBlock = Math.max(this.stats.longestBlock, performance.now() - start);
    return made;
  }
}

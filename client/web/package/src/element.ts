// <intervale-view src="wss://host:port/name" range="100 200" color-by="value"></intervale-view>: an interval volume in a
// page, with a camera that the mouse and fingers move. It needs three.js.
//
//   src          the data set's address
//   range        of values: two numbers; several pairs show several ranges
//   color-by     surface (the default), value, or a channel's name
//   palette      of values
//   pixel-error  largest deviation on the screen, pixels; 1 unless it is given
//   frame-rate   pictures a second while the camera moves, for which the mesh may be coarser; 60 unless it is given, 0: any
//
// The property `token` identifies you to a server that asks for tokens; it is not an attribute, so as not to be read
// from the page. Events: load-start, progress (detail: a Progress), load-end, load-error (detail: an Error).
import { DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { fitted, type Pose } from './camera.js';
import { frameOf } from './frame.js';
import { watchPointers } from './pointer.js';
import type { Range } from './ranges.js';
import { IntervalVolume, type IntervalVolumeOptions } from './three.js';
import { sub } from './vec.js';

const kStyle = ':host { display: block; min-height: 240px; } canvas { display: block; width: 100%; height: 100%; touch-action: none; }';

const kFrameRate = 60;

export class IntervaleViewElement extends HTMLElement {
  static readonly observedAttributes = ['src', 'range', 'color-by', 'palette', 'pixel-error', 'frame-rate'];
  token: string | null = null; // before src is set
  options: Pick<IntervalVolumeOptions, 'wasmUrl'> = {}; // the same
  volume: IntervalVolume | null = null; // what is shown
  private readonly canvas = document.createElement('canvas');
  private readonly camera = new PerspectiveCamera();
  private readonly scene = new Scene();
  private readonly resized = new ResizeObserver(() => this.invalidate());
  private renderer: WebGLRenderer | null = null; // while the element is in the page
  private chosen: Pose | null = null; // null: shows all of the data set
  private request = 0; // of a frame

  constructor() {
    super();
    const style = document.createElement('style');
    style.textContent = kStyle;
    this.attachShadow({ mode: 'open' }).append(style, this.canvas);
    const light = new DirectionalLight('#ffffff', 2);
    light.position.set(-0.35, 0.45, 1);
    this.camera.add(light, light.target);
    this.scene.add(this.camera, new HemisphereLight('#ffffff', '#8a8580', 1.2));
    light.target.position.set(0, 0, 0);
    watchPointers(this.canvas, { move: (make) => this.move(make) });
    this.canvas.addEventListener('dblclick', () => this.setPose(null));
  }

  // The camera, in the world of the data set; null: shows all of it.
  setPose(pose: Pose | null): void {
    this.chosen = pose;
    this.invalidate();
  }

  get pose(): Pose | null {
    const dataset = this.volume?.dataset;
    return this.chosen ?? (dataset ? fitted(frameOf(dataset).box, this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight)) : null);
  }

  connectedCallback(): void {
    try {
      this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true }); // clear where nothing is
    } catch {
      this.report('load-error', new Error('This browser does not provide WebGL 2.'));
      return;
    }
    this.resized.observe(this.canvas);
    this.load();
  }

  disconnectedCallback(): void {
    this.unload();
    this.resized.disconnect();
    cancelAnimationFrame(this.request);
    this.request = 0;
    this.renderer?.dispose();
    this.renderer = null;
  }

  attributeChangedCallback(name: string, before: string | null, now: string | null): void {
    if (before === now || !this.renderer) return;
    if (name === 'src') return this.load();
    if (name === 'range') this.volume?.setRanges(rangesIn(now));
    else if (name === 'pixel-error') this.volume?.setPixelError(this.pixelError);
    else if (name === 'frame-rate') this.volume?.setFrameRate(this.frameRate);
    else this.volume?.setColors(this.getAttribute('color-by') ?? 'surface', this.getAttribute('palette') ?? undefined);
    this.invalidate();
  }

  private get pixelError(): number {
    const pixels = Number(this.getAttribute('pixel-error') ?? 1);
    return pixels > 0 ? pixels : 1;
  }

  private get frameRate(): number {
    const rate = Number(this.getAttribute('frame-rate') ?? kFrameRate);
    return rate >= 0 ? rate : kFrameRate;
  }

  private unload(): void {
    this.volume?.dispose();
    this.volume = null;
    this.chosen = null;
  }

  private load(): void {
    this.unload();
    const src = this.getAttribute('src');
    if (!src) return;
    const [colorBy, palette] = [this.getAttribute('color-by') ?? 'surface', this.getAttribute('palette')];
    const volume = new IntervalVolume(new URL(src, document.baseURI).href, {
      ...this.options,
      ...(this.token === null ? {} : { token: this.token }),
      ...(palette === null ? {} : { palette }),
      ranges: rangesIn(this.getAttribute('range')),
      pixelError: this.pixelError,
      frameRate: this.frameRate,
      colorBy,
    });
    this.volume = volume;
    volume.addEventListener('load-start', () => this.report('load-start'));
    volume.addEventListener('progress', ({ progress }) => this.report('progress', progress));
    volume.addEventListener('load-end', () => this.report('load-end'));
    volume.addEventListener('load-error', ({ error }) => this.report('load-error', error));
    volume.addEventListener('opened', () => this.invalidate());
    volume.addEventListener('change', () => this.invalidate());
    volume.setCamera(this.camera);
    this.scene.add(volume);
  }

  private report(type: string, detail: unknown = null): void {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  private move(make: (pose: Pose, width: number, height: number) => Pose): void {
    const { pose } = this;
    if (pose) this.setPose(make(pose, this.canvas.clientWidth, this.canvas.clientHeight));
  }

  private invalidate(): void {
    if (this.request === 0 && this.renderer) this.request = requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    this.request = 0;
    const { renderer, volume, pose, camera, canvas } = this;
    if (!renderer || !volume?.dataset || !pose) return;
    const [width, height] = [Math.max(1, canvas.clientWidth), Math.max(1, canvas.clientHeight)];
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const isOtherSize = canvas.width !== Math.floor(width * ratio) || canvas.height !== Math.floor(height * ratio);
    if (isOtherSize) renderer.setPixelRatio(ratio);
    if (isOtherSize) renderer.setSize(width, height, false);
    // The scene's origin is the middle of the data, so that float32 is precise enough wherever it lies.
    const { center, box } = frameOf(volume.dataset);
    volume.position.set(-center[0], -center[1], -center[2]);
    camera.position.set(...sub(pose.eye, center));
    camera.up.set(...pose.up);
    camera.lookAt(...sub(pose.lookAt, center));
    camera.fov = pose.fov;
    camera.aspect = width / height;
    const radius = Math.hypot(...sub(box.max, box.min)) / 2;
    const distance = camera.position.length();
    camera.far = distance + radius;
    camera.near = Math.max(distance - radius, camera.far * 5e-4);
    camera.updateProjectionMatrix();
    volume.setResolutionFromRenderer(renderer);
    volume.update();
    renderer.render(this.scene, camera);
    if (volume.isMoving) this.invalidate(); // pictures follow each other, so that their times are known
  }
}

// Pairs of numbers; others are left out.
function rangesIn(text: string | null): Range[] {
  const numbers = (text ?? '').split(/[\s,]+/).filter((word) => word !== '').map(Number);
  const ranges: Range[] = [];
  for (let i = 0; i + 1 < numbers.length && ranges.length < 4; i += 2) {
    const [least, greatest] = [numbers[i]!, numbers[i + 1]!];
    if (least <= greatest) ranges.push([least, greatest]);
  }
  return ranges;
}

declare global {
  interface HTMLElementTagNameMap {
    'intervale-view': IntervaleViewElement;
  }
}

if (!customElements.get('intervale-view')) customElements.define('intervale-view', IntervaleViewElement);

// An interval volume as an object of three.js, that refines for the camera that looks at it.
import {
  ClampToEdgeWrapping, DataTexture, DoubleSide, Group, LinearFilter, Matrix4, type Material, MeshStandardMaterial, type Object3DEventMap,
  type PerspectiveCamera, SRGBColorSpace, Vector2, Vector3, type WebGLRenderer,
} from 'three';
import { kRangeColors, kSurfaceColors, kSurfaces } from './colors.js';
import { type Dataset, streamUrl } from './datasets.js';
import { type Frame, frameOf } from './frame.js';
import { FramePace } from './frame_pace.js';
import type { LocalDataset } from './local_dataset.js';
import { addressOf, describe, LiveMesh, type LiveMeshOptions, surfacesOf, viewOf } from './live_mesh.js';
import type { Palette, Progress, SurfaceChange, Vec3, View } from './messages.js';
import { Motion } from './motion.js';
import { type Range, rangeOf, spanOf } from './ranges.js';
import { SurfaceGroup } from './surface_group.js';

const kAllowed = 1.3; // of the time between two pictures: how late one may be

export interface IntervalVolumeOptions extends Omit<LiveMeshOptions, 'isShownLater'> {
  token?: string; // identifies you to a server that asks for tokens
  ranges?: Range[]; // of values, closed, four at most; none: the data set's own, or the upper half of its values
  pixelError?: number; // largest deviation on the screen, pixels
  colorBy?: string; // 'surface', 'value', or a channel's name
  palette?: string; // of values; without it the first
  span?: Range; // of values that have colours of their own; without it the ranges', or all of a channel
  // Pictures a second while the camera moves, for which the mesh may be coarser; without it, or 0: always all of it. Then
  // update() must be called for each picture, and pictures follow each other while isMoving.
  frameRate?: number;
}

export interface IntervalVolumeEvents extends Object3DEventMap {
  'load-start': {};
  'progress': { progress: Progress };
  'load-end': {};
  'load-error': { error: Error };
  'opened': { dataset: Dataset }; // what the server tells of the data set is known
  'change': {}; // there is something new to draw, once update() was called
}

// A surface of one range has a MeshStandardMaterial, which may be replaced (materials). Its geometry is in the world of
// the data set, about the middle of its box: give the object a position, a rotation and a scale as any other.
export class IntervalVolume extends Group<IntervalVolumeEvents> {
  readonly mesh: LiveMesh;
  readonly materials: Material[][]; // by range, then alpha, beta and the faces of the box
  dataset: Dataset | null = null; // null: not known yet
  version = 0; // of the surface that is drawn; 0: none yet
  private readonly content = new Group(); // one of the next two
  private readonly surface: SurfaceGroup;
  private readonly standIn: SurfaceGroup; // a coarser one, while the camera moves
  private readonly motion = new Motion(() => this.dispatchEvent({ type: 'change' }));
  private pace = new FramePace();
  private pending: SurfaceChange[] = []; // oldest first
  private frame: Frame | null = null;
  private isOpen = false; // the session
  private palettes: Palette[] = [];
  private texture: DataTexture | null = null; // of the palette
  private camera: PerspectiveCamera | null = null;
  private readonly viewport = new Vector2(1280, 800); // pixels
  private options: IntervalVolumeOptions;

  // source: the address "wss://host:port/name" or "https://host:port/name", or a file that was opened, which this does not
  // close.
  constructor(readonly source: string | LocalDataset, options: IntervalVolumeOptions = {}) {
    super();
    this.options = { ...options };
    this.mesh = new LiveMesh({ ...options, isShownLater: true });
    this.materials = kRangeColors.map(() => kSurfaces.map((name) => standardMaterial(kSurfaceColors[name])));
    this.surface = new SurfaceGroup(this.materials);
    this.standIn = new SurfaceGroup(this.materials);
    this.content.add(this.surface);
    this.add(this.content);
    this.mesh.addEventListener('surface', ({ detail }) => {
      this.pending.push(detail.change);
      this.dispatchEvent({ type: 'change' });
    });
    this.mesh.addEventListener('standIn', ({ detail: { change } }) => {
      if (change && this.frame) this.standIn.show(change, this.frame);
      else this.standIn.clear();
      this.dispatchEvent({ type: 'change' });
    });
    this.mesh.addEventListener('palettes', ({ detail }) => {
      this.palettes = detail.palettes;
      this.applyColors();
    });
    this.mesh.addEventListener('load-start', () => this.dispatchEvent({ type: 'load-start' }));
    this.mesh.addEventListener('load-end', () => this.dispatchEvent({ type: 'load-end' }));
    this.mesh.addEventListener('progress', ({ detail }) => this.dispatchEvent({ type: 'progress', progress: detail.progress }));
    this.mesh.addEventListener('load-error', ({ detail }) => this.dispatchEvent({ type: 'load-error', error: new Error(detail.text) }));
    void this.find();
  }

  // Refines for this camera, in every update(). null: for all of the data set.
  setCamera(camera: PerspectiveCamera | null): void {
    this.camera = camera;
  }

  // The size of the picture, pixels of the screen.
  setResolution(width: number, height: number): void {
    this.viewport.set(width, height);
  }

  setResolutionFromRenderer(renderer: WebGLRenderer): void {
    renderer.getDrawingBufferSize(this.viewport);
  }

  // Before each picture: shows what has arrived, and asks for what the camera sees. Returns whether the picture changes.
  update(): boolean {
    const shown = this.pending.length > 0;
    for (const change of this.pending.splice(0)) this.show(change);
    if (shown) this.mesh.shown(this.version);
    const isOther = this.chooseSurface();
    if (this.dataset) this.look(this.dataset);
    return shown || isOther;
  }

  // The camera has moved lately, as update() saw it, and there is a frame rate.
  get isMoving(): boolean {
    return this.motion.isMoving;
  }

  // The picture after the last update() has a coarser mesh.
  get isCoarse(): boolean {
    return this.standIn.parent !== null;
  }

  setFrameRate(frameRate: number): void {
    this.options.frameRate = frameRate;
    this.pace = new FramePace();
  }

  // Learns from the time since the last picture. Returns whether the other surface is drawn from now on.
  private chooseSurface(): boolean {
    const { frameRate = 0 } = this.options;
    const { camera, motion, pace, standIn, isCoarse } = this;
    const ms = camera && frameRate > 0 ? motion.sees(this.toData(camera).elements) : motion.rests();
    const allowed = (kAllowed * 1000) / frameRate;
    if (ms !== null && isCoarse) pace.drewStandIn(standIn.triangles, ms, allowed);
    else if (ms !== null) pace.drewAll(this.surface.triangles, ms, allowed);
    if (this.isOpen) this.mesh.update({ standIn: frameRate > 0 ? pace.budget : null });
    const isWanted = motion.isMoving && pace.budget !== null && standIn.version > 0;
    if (isWanted === isCoarse) return false;
    this.content.clear();
    this.content.add(isWanted ? standIn : this.surface);
    return true;
  }

  // The closed range of values between which the volume lies.
  setRange(least: number, greatest: number): void {
    this.setRanges([[least, greatest]]);
  }

  // Several, up to four: a mesh is made of each.
  setRanges(ranges: Range[]): void {
    this.options.ranges = ranges;
    this.applyColors();
    this.lookAgain();
  }

  setPixelError(pixels: number): void {
    this.options.pixelError = pixels;
    this.lookAgain();
  }

  // by: 'surface', 'value', or a channel's name.
  setColors(by: string, palette?: string, span?: Range): void {
    this.options = { ...this.options, colorBy: by };
    delete this.options.palette;
    delete this.options.span;
    if (palette !== undefined) this.options.palette = palette;
    if (span !== undefined) this.options.span = span;
    this.mesh.update({ values: by !== 'surface' });
    this.applyColors();
    this.lookAgain();
  }

  // The ranges that are shown; none: the data set's own.
  get ranges(): Range[] {
    if (!this.dataset) return this.options.ranges ?? [];
    const { dataset } = this;
    const asked = this.options.ranges?.length ? this.options.ranges : [null];
    const most = dataset.hasEveryRange ? kRangeColors.length : 1;
    return asked.slice(0, most).flatMap((range) => {
      const shown = rangeOf(dataset, range);
      return shown ? [shown] : [];
    });
  }

  // Ends the session, and frees what is on the graphics card.
  override dispose(): void {
    this.mesh.close();
    this.motion.rests();
    this.surface.clear();
    this.standIn.clear();
    for (const material of this.materials.flat()) material.dispose();
    this.texture?.dispose();
    this.removeFromParent();
  }

  private async find(): Promise<void> {
    try {
      const { source } = this;
      const dataset = typeof source === 'string' ? await describe(source, this.options.token ?? null) : source.dataset;
      this.dataset = dataset;
      this.frame = frameOf(dataset);
      this.content.position.set(...this.frame.center);
      this.applyColors();
      this.dispatchEvent({ type: 'opened', dataset });
    } catch (error) {
      this.dispatchEvent({ type: 'load-error', error: error instanceof Error ? error : new Error(String(error)) });
    }
  }

  // Without waiting for the next picture.
  private lookAgain(): void {
    if (this.isOpen && this.dataset) this.look(this.dataset);
  }

  // Connects with the first view.
  private look(dataset: Dataset): void {
    if (this.isOpen) return this.mesh.updateView(this.view(dataset));
    this.isOpen = true;
    const wanted = surfacesOf({ ...viewOf(dataset), ...this.view(dataset) });
    const { source } = this;
    const to = typeof source === 'string' ? streamUrl(addressOf(source).base) : source.connect();
    this.mesh.open(to, dataset.name, { ...wanted, values: this.isByValue }, this.options.token ?? null);
  }

  private get isByValue(): boolean {
    return (this.options.colorBy ?? 'surface') !== 'surface';
  }

  private channelOf(dataset: Dataset) {
    return dataset.channels.find(({ name }) => name === this.options.colorBy) ?? null;
  }

  // Nothing behind the surfaces is to be seen, whatever the materials are.
  private get isOpaque(): boolean {
    const shown = this.materials.slice(0, Math.max(1, this.ranges.length)).flat();
    return shown.every((m) => m.visible && !m.transparent && !m.clippingPlanes?.length && !('wireframe' in m && m.wireframe));
  }

  private view(dataset: Dataset): Partial<View> {
    const viewport: [number, number] = [this.viewport.x, this.viewport.y];
    const { ranges } = this;
    const channel = this.channelOf(dataset)?.name ?? null;
    const common = { ranges, channel, pixelError: this.options.pixelError ?? 1, opaque: this.camera !== null && this.isOpaque };
    return this.camera ? { ...common, camera: { ...this.pose(this.camera), viewport } } : { ...common, camera: viewOf(dataset, viewport).camera };
  }

  // Of the camera in the data set's world. A scale of the object that is not the same on all axes is not undone exactly.
  private pose(camera: PerspectiveCamera) {
    const toData = this.toData(camera);
    const [eye, ahead] = [new Vector3(), new Vector3(0, 0, -1)].map((p) => p.applyMatrix4(toData)) as [Vector3, Vector3];
    const up = new Vector3(0, 1, 0).transformDirection(toData);
    return { eye: eye.toArray() as Vec3, lookAt: ahead.toArray() as Vec3, up: up.toArray() as Vec3, fov: camera.getEffectiveFOV() };
  }

  private toData(camera: PerspectiveCamera): Matrix4 {
    camera.updateWorldMatrix(true, false);
    this.updateWorldMatrix(true, false);
    return new Matrix4().copy(this.matrixWorld).invert().multiply(camera.matrixWorld);
  }

  private show(change: SurfaceChange): void {
    const { hasValues } = this.surface;
    this.surface.show(change, this.frame!);
    this.version = change.version;
    if (change.hasValues !== hasValues) this.paint();
  }

  private applyColors(): void {
    const palette = this.palettes.find(({ name }) => name === this.options.palette) ?? this.palettes[0];
    this.texture?.dispose();
    this.texture = null;
    if (this.dataset && palette && this.isByValue) {
      const [least, greatest] = spanOf(this.dataset, this.ranges, this.options.span ?? null, this.channelOf(this.dataset));
      this.texture = textureOf(palette);
      this.texture.repeat.x = 1 / Math.max(greatest - least, 1e-30);
      this.texture.offset.x = -least * this.texture.repeat.x;
    }
    this.paint();
  }

  // Pieces that came before values were wanted have none: they have the colours of surfaces until they come again.
  private paint(): void {
    const texture = this.surface.hasValues ? this.texture : null;
    const several = this.ranges.length > 1;
    this.materials.forEach((materials, range) =>
      materials.forEach((material, i) => {
        if (!(material instanceof MeshStandardMaterial)) return;
        material.color.set(texture ? '#ffffff' : several ? kRangeColors[range]! : kSurfaceColors[kSurfaces[i]!]);
        if ((material.map === null) !== (texture === null)) material.needsUpdate = true;
        material.map = texture;
      }),
    );
    this.dispatchEvent({ type: 'change' });
  }
}

const standardMaterial = (color: string) => new MeshStandardMaterial({ color, roughness: 0.6, metalness: 0, side: DoubleSide });

function textureOf({ colours }: Palette): DataTexture {
  const rgb = new Uint8Array(colours);
  const count = rgb.length / 3;
  const rgba = new Uint8Array(4 * count).fill(255);
  for (let i = 0; i < count; ++i) rgba.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
  const texture = new DataTexture(rgba, count, 1);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

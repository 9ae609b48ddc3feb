// An interval volume as an object of three.js, that refines for the camera that looks at it.
import {
  BufferAttribute, BufferGeometry, ClampToEdgeWrapping, DataTexture, DoubleSide, Group, InterleavedBuffer, InterleavedBufferAttribute, LinearFilter,
  Matrix4, type Material, Mesh, MeshStandardMaterial, type Object3DEventMap, type PerspectiveCamera, Sphere, SRGBColorSpace, Vector2, Vector3,
  type WebGLRenderer,
} from 'three';
import { kRangeColors, kSurfaceColors, kSurfaces } from './colors.js';
import { type Dataset, streamUrl } from './datasets.js';
import { type Frame, frameOf } from './frame.js';
import type { LocalDataset } from './local_dataset.js';
import { addressOf, describe, LiveMesh, type LiveMeshOptions, surfacesOf, viewOf } from './live_mesh.js';
import type { Palette, Progress, SurfaceChange, SurfacePiece, Vec3, View } from './messages.js';
import { arraysOf } from './pieces.js';
import { type Range, rangeOf, spanOf } from './ranges.js';
import { applied, boxAround, center, corners, diagonal, sub } from './vec.js';

export interface IntervalVolumeOptions extends Omit<LiveMeshOptions, 'isShownLater'> {
  token?: string; // identifies you to a server that asks for tokens
  ranges?: Range[]; // of values, closed, four at most; none: the data set's own, or the upper half of its values
  pixelError?: number; // largest deviation on the screen, pixels
  colorBy?: string; // 'surface', 'value', or a channel's name
  palette?: string; // of values; without it the first
  span?: Range; // of values that have colours of their own; without it the ranges', or all of a channel
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
  private readonly content = new Group();
  private readonly pieces = new Map<number, Mesh>();
  private pending: SurfaceChange[] = []; // oldest first
  private frame: Frame | null = null;
  private isOpen = false; // the session
  private palettes: Palette[] = [];
  private texture: DataTexture | null = null; // of the palette
  private hasValues = false; // the pieces that are drawn
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
    this.add(this.content);
    this.mesh.addEventListener('surface', ({ detail }) => {
      this.pending.push(detail.change);
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
    if (this.dataset) this.look(this.dataset);
    return shown;
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
    for (const id of [...this.pieces.keys()]) this.removePiece(id);
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
    camera.updateWorldMatrix(true, false);
    this.updateWorldMatrix(true, false);
    const toData = new Matrix4().copy(this.matrixWorld).invert().multiply(camera.matrixWorld);
    const [eye, ahead] = [new Vector3(), new Vector3(0, 0, -1)].map((p) => p.applyMatrix4(toData)) as [Vector3, Vector3];
    const up = new Vector3(0, 1, 0).transformDirection(toData);
    return { eye: eye.toArray() as Vec3, lookAt: ahead.toArray() as Vec3, up: up.toArray() as Vec3, fov: camera.getEffectiveFOV() };
  }

  private show(change: SurfaceChange): void {
    for (const [id, piece] of [...this.pieces]) if (change.reset.includes(piece.userData['range'])) this.removePiece(id);
    for (const id of change.removed) this.removePiece(id);
    for (const piece of change.pieces) {
      this.removePiece(piece.id);
      const made = this.meshOf(piece);
      this.pieces.set(piece.id, made);
      this.content.add(made);
    }
    this.version = change.version;
    if (change.hasValues === this.hasValues) return;
    this.hasValues = change.hasValues;
    this.paint();
  }

  private removePiece(id: number): void {
    const piece = this.pieces.get(id);
    if (!piece) return;
    this.pieces.delete(id);
    this.content.remove(piece);
    piece.geometry.dispose();
  }

  private meshOf(piece: SurfacePiece): Mesh {
    const { affine, center: origin } = this.frame!;
    const arrays = arraysOf(piece, affine, origin);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(arrays.positions, 3));
    geometry.setAttribute('normal', new InterleavedBufferAttribute(new InterleavedBuffer(arrays.normals, 4), 3, 0, true));
    if (arrays.values) geometry.setAttribute('uv', new BufferAttribute(uvOf(arrays.values), 2)); // the map's transform makes colours of them
    geometry.setIndex(new BufferAttribute(arrays.indices, 1));
    let start = 0;
    arrays.groups.forEach((count, surface) => {
      if (count > 0) geometry.addGroup(start, 3 * count, surface);
      start += 3 * count;
    });
    const box = boxAround(corners(piece).map((corner) => applied(affine, corner)));
    geometry.boundingSphere = new Sphere(new Vector3(...sub(center(box), origin)), diagonal(box) / 2);
    const made = new Mesh(geometry, this.materials[piece.range]!);
    made.userData['range'] = piece.range;
    return made;
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
    const texture = this.hasValues ? this.texture : null;
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

function uvOf(values: Float32Array): Float32Array {
  const uv = new Float32Array(2 * values.length);
  values.forEach((value, i) => {
    uv[2 * i] = value;
    uv[2 * i + 1] = 0.5;
  });
  return uv;
}

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

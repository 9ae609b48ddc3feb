// The picture: what is drawn, with which materials, in which order. Draws only when asked to.
import { BufferGeometry, Color, LinearSRGBColorSpace, type Material, Mesh, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { BoundarySurfaceView } from './boundary_surface';
import { type Pose, rayThrough } from '../package/src/camera';
import { CapView } from './cap';
import { type Frame, toDrawing } from '../package/src/frame';
import { setStyles, shared, surfaceMaterials } from './materials';
import type { Box, Cap, Vec3 } from '../package/src/messages';
import { Outlines } from './outlines';
import { Pick } from './pick';
import { stylesOf, type Styles, type SurfaceStyle, type ViewState } from './state';
import { TetsView } from './tets';
import { Thickness } from './thickness';
import { Transparency } from './transparency';
import { Uploader } from './upload';
import { VolumeView } from './volume';
import { along, corners, dot, length, sub, unit } from '../package/src/vec';

const kMaxPixelRatio = 2; // device pixels per CSS pixel
const kAroundTets = 0.25; // the greatest opacity of surfaces around shrunken tetrahedra, which they would hide

export interface Probed {
  at: Vec3; // world coordinates
  value: number | null; // of the field; null: not known
}

export class Picture {
  readonly renderer: WebGLRenderer;
  readonly surface: BoundarySurfaceView;
  readonly standIn: BoundarySurfaceView; // a coarser one, drawn in its place while the camera moves
  readonly outlines = new Outlines();
  readonly thickness: Thickness;
  readonly uploader: Uploader;
  readonly cap: CapView;
  readonly tets: TetsView;
  readonly volume: VolumeView;
  private drawn: BoundarySurfaceView; // of the two
  private materials = surfaceMaterials(false);
  private valueMaterials = surfaceMaterials(true);
  private transparency = new Transparency();
  private pick = new Pick();
  private camera = new PerspectiveCamera();
  private insideScene = new Scene(); // the cap and the tetrahedra
  private background = new Color();

  // Throws if there is no WebGL 2.
  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.autoClear = false;
    this.renderer.outputColorSpace = LinearSRGBColorSpace; // no conversion: the shaders write sRGB
    this.compileShaders();
    this.uploader = new Uploader(this.renderer);
    this.surface = this.drawn = new BoundarySurfaceView(this.uploader, this.materials);
    this.standIn = new BoundarySurfaceView(this.uploader, this.materials);
    this.cap = new CapView(this.uploader);
    this.tets = new TetsView(this.uploader);
    this.thickness = new Thickness(this.renderer);
    this.volume = new VolumeView(this.renderer);
    this.insideScene.add(this.cap.mesh, this.tets.group);
    this.insideScene.matrixWorldAutoUpdate = false; // all is in drawing space
  }

  // Adopts the canvas's size in the layout. Returns whether it changed; the canvas is empty then.
  resize(): boolean {
    const ratio = Math.min(window.devicePixelRatio || 1, kMaxPixelRatio);
    const [width, height] = [Math.max(1, this.canvas.clientWidth), Math.max(1, this.canvas.clientHeight)];
    if (this.canvas.width === Math.floor(width * ratio) && this.canvas.height === Math.floor(height * ratio)) return false;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    return true;
  }

  // Another data set: nothing of the last one is shown any more.
  open(frame: Frame): void {
    const [a, b, c, x, d, e, f, y, g, h, i, z] = frame.affine;
    shared.fromSamples.value.set(a, b, c, d, e, f, g, h, i);
    shared.shift.value.set(...toDrawing(frame, [x, y, z]));
    shared.leastSpacing.value = frame.leastSpacing;
    shared.coarsestLevel.value = frame.coarsestLevel;
    this.thickness.reset();
    this.surface.clear();
    this.standIn.clear();
    this.setCap(frame, null);
    this.tets.discardPending();
    this.showTets(frame, null);
    this.volume.show(null);
    this.resize();
  }

  // color: a CSS colour.
  setBackground(color: string): void {
    this.background.setStyle(color, '');
  }

  setStyles(view: ViewState): void {
    const around = (style: SurfaceStyle) => (view.tets ? { ...style, opacity: Math.min(style.opacity, kAroundTets) } : style);
    stylesOf(view).forEach(({ alpha, beta, box }, range) => {
      const styles: Styles = { alpha: around(alpha), beta: around(beta), box: around(box) };
      setStyles(this.materials[range]!, range, styles);
      setStyles(this.valueMaterials[range]!, range, styles);
    });
    shared.colorByLevel.value = view.levels ? 1 : 0;
    shared.shrink.value = view.shrink;
  }

  // null: no clip plane.
  setCap(frame: Frame, cap: Cap | null): void {
    this.cap.show(cap);
    const { normal, offset } = cap?.plane ?? { normal: [0, 0, 0] as Vec3, offset: 0 };
    shared.clip.value.set(...normal, offset - dot(normal, frame.center));
  }

  // Shows the tetrahedra that have been uploaded, and hides the surface in their box; null: hides nothing.
  showTets(frame: Frame, box: Box | null): void {
    this.tets.swap();
    shared.hiddenMin.value.set(...(box ? toDrawing(frame, box.min) : ([1, 1, 1] as Vec3))); // min above max: empty
    shared.hiddenMax.value.set(...(box ? toDrawing(frame, box.max) : ([-1, -1, -1] as Vec3)));
  }

  // surface: which of the two.
  draw(frame: Frame, pose: Pose, view: ViewState, withOutlines: boolean, surface = this.surface): void {
    this.setCamera(frame, pose);
    this.drawn = surface;
    const { renderer, camera } = this;
    // What has no values yet is drawn in the colours of the surfaces.
    const isByValue = (part: { hasValues: boolean }) => view.colorBy === 'value' && part.hasValues && shared.palette.value !== null;
    const materials = isByValue(surface) ? this.valueMaterials : this.materials;
    const cap = isByValue(this.cap) ? this.cap.valueMaterials : this.cap.materials;
    const tets = isByValue(this.tets) ? this.tets.valueMaterial : this.tets.material;
    renderer.setRenderTarget(null);
    renderer.setClearColor(this.background, 1);
    renderer.clear();
    if (view.render === 'volume' && this.volume.isAvailable) {
      this.volume.draw(renderer, camera, frame, this.background);
    } else if (view.thickness && this.thickness.isAvailable) {
      this.thickness.draw(renderer, camera, () => this.drawThicknessLayers(frame, pose));
    } else {
      this.drawOpaque(materials.map(({ opaque }) => opaque), cap, tets);
      if (view.wireframe) renderer.render(surface.edges, camera);
      const transparent = materials.map((of) => of.transparent);
      if (transparent.flat().some((material) => material.visible)) {
        const drawDepth = () => this.drawOpaque(materials.map(({ depth }) => depth), this.cap.depth, this.tets.depth);
        this.transparency.draw(renderer, camera, drawDepth, () => this.drawSurface(transparent));
      }
    }
    if (withOutlines) renderer.render(this.outlines.scene, camera);
  }

  // What is drawn in the pixel at x, y (CSS pixels from the canvas's upper left corner); null: nothing.
  probe(frame: Frame, pose: Pose, x: number, y: number): Probed | null {
    this.setCamera(frame, pose);
    this.drawn = this.surface;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const [column, row] = [Math.floor(x), Math.floor(y)];
    const surface = (this.surface.hasValues ? this.valueMaterials : this.materials).map(({ pick }) => pick);
    const cap = this.cap.hasValues ? this.cap.valuePick : this.cap.pick;
    const tets = this.tets.hasValues ? this.tets.valuePick : this.tets.pick;
    const picked = this.pick.at(this.renderer, this.camera, column, row, () => this.drawOpaque(surface, cap, tets));
    if (!picked) return null;
    return { at: along(pose.eye, rayThrough(pose, column + 0.5, row + 0.5, width, height), picked.distance), value: picked.value };
  }

  // Compiles the shaders of the first picture while the mesh is still being received.
  private compileShaders(): void {
    const scene = new Scene();
    scene.add(...this.materials[0]!.opaque.map((material) => new Mesh(new BufferGeometry(), material)));
    this.renderer.compile(scene, this.camera);
  }

  private drawSurface(materials: Material | Material[][]): void {
    this.drawn.use(materials);
    this.renderer.render(this.drawn.faces, this.camera);
  }

  private drawOpaque(surface: Material | Material[][], cap: Material | Material[], tets: Material): void {
    this.drawSurface(surface);
    this.cap.mesh.material = cap;
    this.tets.use(tets);
    this.renderer.render(this.insideScene, this.camera);
  }

  private drawThicknessLayers(frame: Frame, pose: Pose): void {
    const { x, y, z, w } = shared.clip.value;
    const outside = dot([x, y, z], toDrawing(frame, pose.eye)) > w;
    this.cap.thickness.uniforms['capFacing']!.value = outside ? 1 : -1;
    this.drawSurface(this.thickness.material); // all surfaces, also invisible ones
    this.tets.group.visible = false;
    this.cap.mesh.material = this.cap.thickness;
    this.renderer.render(this.insideScene, this.camera);
    this.tets.group.visible = true;
  }

  private setCamera(frame: Frame, pose: Pose): void {
    const { camera } = this;
    const ahead = unit(sub(pose.lookAt, pose.eye));
    const depths = corners(frame.box).map((corner) => dot(ahead, sub(corner, pose.eye)));
    const farthest = Math.max(...depths) * 1.02;
    const far = farthest > 0 ? farthest : length(sub(pose.lookAt, pose.eye));
    const near = Math.max(Math.min(...depths) * 0.98, far * 5e-4);
    shared.depthRange.value.set(near, far);
    shared.pixelScale.value = this.canvas.height / 2 / Math.tan((pose.fov * Math.PI) / 360);
    camera.fov = pose.fov;
    camera.aspect = this.canvas.width / this.canvas.height;
    camera.near = near;
    camera.far = far;
    camera.updateProjectionMatrix();
    camera.position.set(...toDrawing(frame, pose.eye));
    camera.up.set(...pose.up);
    camera.lookAt(...toDrawing(frame, pose.lookAt));
    camera.updateMatrixWorld();
  }
}

// The picture: what is drawn, with what, in which order. Draws when told to, never by itself.
import { BufferGeometry, Color, LinearSRGBColorSpace, type Material, Mesh, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { type Pose, rayThrough } from './camera';
import { type Frame, planeToDrawing, shiftOf, toDrawing } from './frame';
import { Guides } from './guides';
import { setLooks, shared, surfaceMaterials } from './materials';
import type { Box, Cap, Vec3 } from './messages';
import { SkinView } from './skin';
import { Pick } from './pick';
import { CapView, TetsView } from './solids';
import type { ViewState } from './state';
import { Thickness } from './thickness';
import { Uploader } from './upload';
import { Veil } from './veil';
import { along, corners, dot, length, sub, unit } from './vec';

const kMostPixelRatio = 2;
const kNowhere: Box = { min: [-1, -1, -1], max: [1, 1, 1] }; // with its ends swapped

export class Picture {
  readonly renderer: WebGLRenderer;
  readonly skin: SkinView;
  readonly guides = new Guides();
  readonly thickness: Thickness;
  readonly uploader: Uploader;
  readonly cap: CapView;
  readonly tets: TetsView;
  private materials = surfaceMaterials();
  private veil = new Veil();
  private pick = new Pick();
  private camera = new PerspectiveCamera();
  private skinScene = new Scene();
  private solidScene = new Scene();
  private edgeScene = new Scene();
  private background = new Color();

  // Throws if there is no WebGL 2.
  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.autoClear = false;
    this.renderer.outputColorSpace = LinearSRGBColorSpace; // the shaders write sRGB themselves
    this.warmUp();
    this.uploader = new Uploader(this.renderer);
    this.skin = new SkinView(this.uploader, this.materials);
    this.cap = new CapView(this.uploader);
    this.tets = new TetsView(this.uploader);
    this.thickness = new Thickness(this.renderer);
    this.skinScene.add(this.skin.faces);
    this.edgeScene.add(this.skin.edges);
    this.solidScene.add(this.cap.mesh, this.tets.group);
    for (const scene of [this.skinScene, this.edgeScene, this.solidScene]) scene.matrixWorldAutoUpdate = false;
  }

  // Takes the size that the canvas is laid out with. Whether that changed.
  resize(): boolean {
    const ratio = Math.min(window.devicePixelRatio || 1, kMostPixelRatio);
    const [width, height] = [Math.max(1, this.canvas.clientWidth), Math.max(1, this.canvas.clientHeight)];
    if (this.canvas.width === Math.floor(width * ratio) && this.canvas.height === Math.floor(height * ratio)) return false;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    return true;
  }

  setFrame(frame: Frame): void {
    shared.spacing.value.set(...frame.spacing);
    shared.shift.value.set(...shiftOf(frame));
  }

  setBackground(color: string): void {
    this.background.setStyle(color, '');
  }

  setLooks(view: ViewState, coarsest: number): void {
    setLooks(this.materials, view);
    shared.byLevel.value = view.levels ? 1 : 0;
    shared.levels.value = coarsest;
    shared.shrink.value = view.shrink;
  }

  setCap(frame: Frame, cap: Cap | null): void {
    this.cap.show(cap);
    if (!cap?.plane) return void shared.clip.value.set(0, 0, 0, 0);
    const { normal, offset } = planeToDrawing(frame, cap.plane);
    shared.clip.value.set(...normal, offset);
  }

  // Shows the tetrahedra that have been uploaded, in a box where the skin is hidden; null: there is none.
  showTets(frame: Frame, hidden: Box | null): void {
    this.tets.swap();
    shared.hiddenMin.value.set(...(hidden ? toDrawing(frame, hidden.min) : kNowhere.max));
    shared.hiddenMax.value.set(...(hidden ? toDrawing(frame, hidden.max) : kNowhere.min));
  }

  draw(frame: Frame, pose: Pose, view: ViewState, withGuides: boolean): void {
    this.aim(frame, pose);
    const { renderer, camera } = this;
    renderer.setRenderTarget(null);
    renderer.setClearColor(this.background, 1);
    renderer.clear();
    if (view.thickness && this.thickness.possible) {
      this.thickness.draw(renderer, camera, () => this.layers(frame, pose));
    } else {
      this.solids(this.materials.solid, this.cap.material, this.tets.material);
      if (view.wireframe) renderer.render(this.edgeScene, camera);
      if (this.materials.veil.some((material) => material.visible)) {
        this.veil.draw(
          renderer,
          camera,
          () => this.solids(this.materials.depth, this.cap.depth, this.tets.depth),
          () => this.faces(this.materials.veil),
        );
      }
    }
    if (withGuides) renderer.render(this.guides.scene, camera);
  }

  // The point that is drawn at a pixel of the layout, in the world; null where there is none.
  at(frame: Frame, pose: Pose, x: number, y: number): Vec3 | null {
    this.aim(frame, pose);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const away = this.pick.distance(this.renderer, this.camera, x, y, width, height, () =>
      this.solids(this.pick.material, this.pick.material, this.tets.material),
    );
    return away === null ? null : along(pose.eye, rayThrough(pose, x, y, width, height), away);
  }

  // Has the shader of the first picture compiled while the mesh is still on its way.
  private warmUp(): void {
    const scene = new Scene();
    scene.add(...this.materials.solid.map((material) => new Mesh(new BufferGeometry(), material)));
    this.renderer.compile(scene, this.camera);
  }

  private faces(materials: Material | Material[]): void {
    this.skin.use(materials);
    this.renderer.render(this.skinScene, this.camera);
  }

  private solids(skin: Material | Material[], cap: Material, tets: Material): void {
    this.faces(skin);
    this.cap.mesh.material = cap;
    this.tets.use(tets);
    this.renderer.render(this.solidScene, this.camera);
  }

  private layers(frame: Frame, pose: Pose): void {
    const { x, y, z, w } = shared.clip.value;
    const outside = dot([x, y, z], toDrawing(frame, pose.eye)) > w;
    this.cap.thickness.uniforms['capFacing']!.value = outside ? 1 : -1;
    this.faces(this.thickness.material); // of all surfaces, also of those that are not shown
    this.tets.group.visible = false;
    this.cap.mesh.material = this.cap.thickness;
    this.renderer.render(this.solidScene, this.camera);
    this.tets.group.visible = true;
  }

  private aim(frame: Frame, pose: Pose): void {
    const { camera } = this;
    const ahead = unit(sub(pose.lookAt, pose.eye));
    const depths = corners(frame.box).map((corner) => dot(ahead, sub(corner, pose.eye)));
    const farthest = Math.max(...depths) * 1.02;
    const far = farthest > 0 ? farthest : length(sub(pose.lookAt, pose.eye));
    const near = Math.max(Math.min(...depths) * 0.98, far * 5e-4);
    shared.depths.value.set(near, far);
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

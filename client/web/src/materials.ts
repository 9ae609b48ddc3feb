// The materials, and the uniforms that they share.
import {
  AddEquation,
  Color,
  CustomBlending,
  DoubleSide,
  GLSL3,
  type IUniform,
  NoBlending,
  OneFactor,
  OneMinusSrcAlphaFactor,
  RawShaderMaterial,
  type ShaderMaterialParameters,
  SrcAlphaFactor,
  Vector2,
  Vector3,
  Vector4,
  ZeroFactor,
} from 'three';
import * as shaders from './shaders';
import { kSurfaces, type Look, type SurfaceName } from './state';

// One object for all materials: what is set here holds for each of them.
export const shared = {
  spacing: { value: new Vector3(1, 1, 1) },
  shift: { value: new Vector3() },
  clip: { value: new Vector4(0, 0, 0, 0) }, // in drawing space
  hiddenMin: { value: new Vector3(1, 1, 1) },
  hiddenMax: { value: new Vector3(-1, -1, -1) },
  byLevel: { value: 0 },
  levels: { value: 1 },
  depths: { value: new Vector2(0, 1) },
  shrink: { value: 0.8 },
  pixelScale: { value: 1 }, // pixels of one unit across, one unit ahead
  outline: { value: 0.4 },
  alpha: { value: new Vector3() },
  beta: { value: new Vector3() },
  box: { value: new Vector3() },
};

function material(vertexShader: string, fragmentShader: string, own: Record<string, IUniform>, more: ShaderMaterialParameters = {}): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    uniforms: { ...shared, ...own },
    side: DoubleSide,
    blending: NoBlending,
    ...more,
  });
}

// For each of the three surfaces.
export interface SurfaceMaterials {
  solid: RawShaderMaterial[];
  depth: RawShaderMaterial[]; // where the solid ones are, for what shines through
  veil: RawShaderMaterial[];
  edges: RawShaderMaterial[];
}

const kVeilBlending: ShaderMaterialParameters = {
  blending: CustomBlending,
  blendEquation: AddEquation,
  blendSrc: OneFactor,
  blendDst: OneFactor,
  blendSrcAlpha: ZeroFactor,
  blendDstAlpha: OneMinusSrcAlphaFactor,
  depthWrite: false,
  transparent: true,
};

export function surfaceMaterials(): SurfaceMaterials {
  const each = (make: (color: IUniform, opacity: IUniform) => RawShaderMaterial) => kSurfaces.map((name) => make(shared[name], opacities[name]));
  const opacities: Record<SurfaceName, IUniform> = { alpha: { value: 1 }, beta: { value: 1 }, box: { value: 1 } };
  const solid = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
  return {
    solid: each((color) => material(shaders.kSkinVertex, shaders.kSkinFragment, { color }, solid)),
    depth: each((color, opacity) => material(shaders.kSkinVertex, shaders.kVeilFragment, { color, opacity }, { ...solid, colorWrite: false })),
    veil: each((color, opacity) => material(shaders.kSkinVertex, shaders.kVeilFragment, { color, opacity }, kVeilBlending)),
    edges: each(() => material(shaders.kSkinVertex, shaders.kEdgeFragment, { ink: { value: new Vector4(0, 0, 0, 0.5) } }, kOver)),
  };
}

const kOver: ShaderMaterialParameters = {
  blending: CustomBlending,
  blendEquation: AddEquation,
  blendSrc: SrcAlphaFactor,
  blendDst: OneMinusSrcAlphaFactor,
  blendSrcAlpha: OneFactor,
  blendDstAlpha: OneMinusSrcAlphaFactor,
  depthWrite: false,
};

export function setLooks(materials: SurfaceMaterials, looks: Record<SurfaceName, Look>): void {
  kSurfaces.forEach((name, i) => {
    const { color, opacity } = looks[name];
    const { r, g, b } = new Color().setStyle(color, ''); // as it is written: the shaders make it linear
    shared[name].value.set(r, g, b);
    const solid = opacity > 0.995;
    materials.solid[i]!.visible = materials.depth[i]!.visible = solid;
    materials.veil[i]!.visible = !solid && opacity > 0.005;
    materials.veil[i]!.uniforms['opacity']!.value = opacity;
    materials.edges[i]!.visible = opacity > 0.005;
    materials.edges[i]!.uniforms['ink']!.value.set(r * 0.25, g * 0.25, b * 0.25, solid ? 0.75 : 0.15 + 0.4 * opacity);
  });
}

export const capMaterial = () => material(shaders.kCapVertex, shaders.kCapFragment, { color: shared.box });
export const capDepthMaterial = () => material(shaders.kCapVertex, shaders.kCapFragment, { color: shared.box }, { colorWrite: false });
export const tetsMaterial = () => material(shaders.kTetsVertex, shaders.kTetsFragment, {});
export const tetsDepthMaterial = () => material(shaders.kTetsVertex, shaders.kTetsFragment, {}, { colorWrite: false });

// depthTest off: every layer counts.
export function thicknessMaterial(capFacing: number): RawShaderMaterial {
  const adding: ShaderMaterialParameters = { blending: CustomBlending, blendEquation: AddEquation, blendSrc: OneFactor, blendDst: OneFactor };
  return material(shaders.kSkinVertex, shaders.kThicknessFragment, { capFacing: { value: capFacing } }, { ...adding, depthTest: false, depthWrite: false });
}

export function overMaterial(fragment: string, own: Record<string, IUniform>): RawShaderMaterial {
  return material(shaders.kFullScreenVertex, fragment, own, { ...kOver, depthTest: false });
}

export function lineMaterial(depthTest: boolean, opacity: number): RawShaderMaterial {
  return material(shaders.kLineVertex, shaders.kLineFragment, { ink: { value: new Vector4(1, 1, 1, opacity) } }, { ...kOver, depthTest });
}

export const distanceMaterial = () => material(shaders.kSkinVertex, shaders.kDistanceFragment, {});

export const stagingMaterial = () => material(shaders.kStagingVertex, shaders.kStagingFragment, {});

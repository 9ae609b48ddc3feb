// The materials, and the uniforms that they share.
import {
  Color, CustomBlending, type DataTexture, DoubleSide, GLSL3, type IUniform, Matrix3, NoBlending, OneFactor, OneMinusSrcAlphaFactor,
  RawShaderMaterial, type ShaderMaterialParameters, SrcAlphaFactor, Vector2, Vector3, Vector4, ZeroFactor,
} from 'three';
import * as shaders from './shaders';
import { kSurfaces, type SurfaceName, type SurfaceStyle } from './state';

// All materials refer to these objects: a value set here holds for each of them. Positions are in drawing space.
export const shared = {
  fromSamples: { value: new Matrix3() }, // the affine without its shift
  leastSpacing: { value: 1 }, // see frame.ts
  shift: { value: new Vector3() },
  clip: { value: new Vector4(0, 0, 0, 0) },
  hiddenMin: { value: new Vector3(1, 1, 1) },
  hiddenMax: { value: new Vector3(-1, -1, -1) },
  colorByLevel: { value: 0 },
  coarsestLevel: { value: 1 },
  palette: { value: null as DataTexture | null }, // of the field's values
  span: { value: new Vector2(0, 1) }, // see kColoring
  depthRange: { value: new Vector2(0, 1) },
  shrink: { value: 0.8 },
  pixelScale: { value: 1 }, // pixels per unit of length, at one unit from the eye
  edgeWidth: { value: 0.4 },
  alpha: { value: new Vector3() },
  beta: { value: new Vector3() },
  box: { value: new Vector3() },
};

type Uniforms = Record<string, IUniform>;
type Parameters = ShaderMaterialParameters;

function material(vertexShader: string, fragmentShader: string, uniforms: Uniforms, parameters: Parameters = {}): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    uniforms: { ...shared, ...uniforms },
    side: DoubleSide,
    blending: NoBlending,
    ...parameters,
  });
}

// Each array has one material per surface, in the order of kSurfaces.
export interface SurfaceMaterials {
  opaque: RawShaderMaterial[];
  depth: RawShaderMaterial[]; // opaque surfaces, depth only: what transparent ones are tested against
  transparent: RawShaderMaterial[];
  edges: RawShaderMaterial[];
}

const kAdditive: Parameters = { blending: CustomBlending, blendSrc: OneFactor, blendDst: OneFactor, depthWrite: false };

// See kTransparentFragment.
const kAccumulation: Parameters = {
  ...kAdditive,
  blendSrcAlpha: ZeroFactor,
  blendDstAlpha: OneMinusSrcAlphaFactor,
  transparent: true,
};

const kAlphaBlending: Parameters = {
  blending: CustomBlending,
  blendSrc: SrcAlphaFactor,
  blendDst: OneMinusSrcAlphaFactor,
  blendSrcAlpha: OneFactor,
  blendDstAlpha: OneMinusSrcAlphaFactor,
  depthWrite: false,
};

const coloredBy = (value: boolean): Parameters => (value ? { defines: { BY_VALUE: '' } } : {});

// byValue: colours show the field's values, which each vertex has then.
export function surfaceMaterials(byValue: boolean): SurfaceMaterials {
  const opacities: Record<SurfaceName, IUniform> = { alpha: { value: 1 }, beta: { value: 1 }, box: { value: 1 } };
  const each = (fragment: string, uniforms: (name: SurfaceName) => Uniforms, parameters: Parameters) =>
    kSurfaces.map((name) => material(shaders.kSurfaceVertex, fragment, uniforms(name), parameters));
  const colorOf = (name: SurfaceName) => ({ color: shared[name] });
  const colorAndOpacityOf = (name: SurfaceName) => ({ color: shared[name], opacity: opacities[name] });
  const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }; // lets edges lie in front
  return {
    opaque: each(shaders.kOpaqueFragment, colorOf, { ...offset, ...coloredBy(byValue) }),
    depth: each(shaders.kTransparentFragment, colorAndOpacityOf, { ...offset, colorWrite: false }),
    transparent: each(shaders.kTransparentFragment, colorAndOpacityOf, { ...kAccumulation, ...coloredBy(byValue) }),
    edges: each(shaders.kEdgeFragment, () => ({ lineColor: { value: new Vector4(0, 0, 0, 0.5) } }), kAlphaBlending),
  };
}

// Applies colours and opacities, and decides which material of each surface is visible.
export function setStyles(materials: SurfaceMaterials, styles: Record<SurfaceName, SurfaceStyle>): void {
  kSurfaces.forEach((name, i) => {
    const { color, opacity } = styles[name];
    const { r, g, b } = new Color().setStyle(color, ''); // without conversion: the shaders make it linear
    shared[name].value.set(r, g, b);
    const opaque = opacity > 0.995;
    materials.opaque[i]!.visible = materials.depth[i]!.visible = opaque;
    materials.transparent[i]!.visible = !opaque && opacity > 0.005;
    materials.transparent[i]!.uniforms['opacity']!.value = opacity;
    materials.edges[i]!.visible = opacity > 0.005;
    materials.edges[i]!.uniforms['lineColor']!.value.set(r * 0.25, g * 0.25, b * 0.25, opaque ? 0.75 : 0.15 + 0.4 * opacity);
  });
}

const kDepthOnly: Parameters = { colorWrite: false };
export const capMaterial = (byValue: boolean) => material(shaders.kCapVertex, shaders.kCapFragment, { color: shared.box }, coloredBy(byValue));
export const capDepthMaterial = () => material(shaders.kCapVertex, shaders.kCapFragment, { color: shared.box }, kDepthOnly);
export const tetsMaterial = (byValue: boolean) => material(shaders.kTetsVertex, shaders.kTetsFragment, {}, coloredBy(byValue));
export const tetsDepthMaterial = () => material(shaders.kTetsVertex, shaders.kTetsFragment, {}, kDepthOnly);

// capFacing: see kThicknessFragment. Without depth test: hidden layers are added, too.
export const thicknessMaterial = (capFacing: -1 | 0 | 1) => {
  const parameters = { ...kAdditive, depthTest: false };
  return material(shaders.kSurfaceVertex, shaders.kThicknessFragment, { capFacing: { value: capFacing } }, parameters);
};

// For a full-screen pass that is blended over the picture.
export const compositeMaterial = (fragment: string, uniforms: Uniforms) =>
  material(shaders.kFullScreenVertex, fragment, uniforms, { ...kAlphaBlending, depthTest: false });

// opacity: 0 to 1.
export const lineMaterial = (depthTest: boolean, opacity: number) =>
  material(shaders.kLineVertex, shaders.kLineFragment, { lineColor: { value: new Vector4(1, 1, 1, opacity) } }, { ...kAlphaBlending, depthTest });

export const distanceMaterial = () => material(shaders.kSurfaceVertex, shaders.kDistanceFragment, {});
export const uploadMaterial = () => material(shaders.kUploadVertex, shaders.kUploadFragment, {});

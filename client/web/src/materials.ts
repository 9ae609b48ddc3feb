// The materials, and the uniforms that they share.
import {
  BackSide, Color, CustomBlending, type DataTexture, DoubleSide, GLSL3, type IUniform, Matrix3, NoBlending, OneFactor, OneMinusSrcAlphaFactor,
  RawShaderMaterial, type ShaderMaterialParameters, SrcAlphaFactor, Vector2, Vector3, Vector4, ZeroFactor,
} from 'three';
import * as shaders from './shaders';
import { kSurfaces, type SurfaceName } from '../package/src/colors';
import { kMostRanges, type Styles } from './state';
import * as volumeShaders from './volume_shaders';

const colors = (): { value: Vector3[] } => ({ value: Array.from({ length: kMostRanges }, () => new Vector3()) });

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
  alpha: colors(), // by range, as the next two
  beta: colors(),
  box: colors(),
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

// Of one range. Each array has one material per surface, in the order of kSurfaces.
export interface SurfaceMaterials {
  opaque: RawShaderMaterial[];
  depth: RawShaderMaterial[]; // opaque surfaces, depth only: what transparent ones are tested against
  transparent: RawShaderMaterial[];
  edges: RawShaderMaterial[];
  pick: RawShaderMaterial[];
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

const picks = (what: 0 | 1 | 2, byValue: boolean): Parameters => ({ defines: { PICKS: what, ...(byValue ? { BY_VALUE: '' } : {}) } });
export const capPickMaterial = (byValue: boolean) => material(shaders.kSurfaceVertex, shaders.kPickFragment, {}, picks(1, byValue));
export const tetsPickMaterial = (byValue: boolean) => material(shaders.kTetsVertex, shaders.kPickFragment, {}, picks(2, byValue));

const kRanges = Array.from({ length: kMostRanges }, (_, range) => range);

// Where ranges overlap, the earlier one lies in front.
const behind = (range: number): Parameters => ({ polygonOffset: range > 0, polygonOffsetFactor: range, polygonOffsetUnits: range });

// By range. byValue: colours show the field's values, which each vertex has then.
export const surfaceMaterials = (byValue: boolean): SurfaceMaterials[] => kRanges.map((range) => materialsOf(range, byValue));

function materialsOf(range: number, byValue: boolean): SurfaceMaterials {
  const opacities: Record<SurfaceName, IUniform> = { alpha: { value: 1 }, beta: { value: 1 }, box: { value: 1 } };
  const each = (fragment: string, uniforms: (name: SurfaceName) => Uniforms, parameters: Parameters) =>
    kSurfaces.map((name) => material(shaders.kSurfaceVertex, fragment, uniforms(name), parameters));
  const colorOf = (name: SurfaceName) => ({ color: { value: shared[name].value[range] } });
  const colorAndOpacityOf = (name: SurfaceName) => ({ ...colorOf(name), opacity: opacities[name] });
  const offset = behind(range + 1); // lets edges lie in front
  return {
    opaque: each(shaders.kOpaqueFragment, colorOf, { ...offset, ...coloredBy(byValue) }),
    depth: each(shaders.kTransparentFragment, colorAndOpacityOf, { ...offset, colorWrite: false }),
    transparent: each(shaders.kTransparentFragment, colorAndOpacityOf, { ...kAccumulation, ...coloredBy(byValue) }),
    pick: each(shaders.kPickFragment, () => ({}), picks(0, byValue)),
    edges: each(shaders.kEdgeFragment, () => ({ lineColor: { value: new Vector4(0, 0, 0, 0.5) } }), kAlphaBlending),
  };
}

// Applies colours and opacities to what is drawn of a range, and decides which material of each surface is visible.
export function setStyles(materials: SurfaceMaterials, range: number, styles: Styles): void {
  kSurfaces.forEach((name, i) => {
    const { color, opacity } = styles[name];
    const { r, g, b } = new Color().setStyle(color, ''); // without conversion: the shaders make it linear
    shared[name].value[range]!.set(r, g, b);
    const opaque = opacity > 0.995;
    materials.opaque[i]!.visible = materials.depth[i]!.visible = opaque;
    materials.transparent[i]!.visible = !opaque && opacity > 0.005;
    materials.transparent[i]!.uniforms['opacity']!.value = opacity;
    materials.edges[i]!.visible = materials.pick[i]!.visible = opacity > 0.005;
    materials.edges[i]!.uniforms['lineColor']!.value.set(r * 0.25, g * 0.25, b * 0.25, opaque ? 0.75 : 0.15 + 0.4 * opacity);
  });
}

const kDepthOnly: Parameters = { colorWrite: false };
const capMaterials = (parameters: Parameters) =>
  kRanges.map((range) =>
    material(shaders.kCapVertex, shaders.kCapFragment, { color: { value: shared.box.value[range] } }, { ...behind(range), ...parameters }),
  );
export const capColorMaterials = (byValue: boolean) => capMaterials(coloredBy(byValue)); // by range, as the next
export const capDepthMaterials = () => capMaterials(kDepthOnly);
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

// See kVolumeVertex and kVolumeFragment; light is added in front of what is there.
export const volumeMaterial = (uniforms: Uniforms) =>
  material(volumeShaders.kVolumeVertex, volumeShaders.kVolumeFragment, uniforms, {
    side: BackSide, blending: CustomBlending, blendSrc: OneFactor, blendDst: OneMinusSrcAlphaFactor, depthTest: false, depthWrite: false, transparent: true,
  });
export const volumeCompositeMaterial = (uniforms: Uniforms) =>
  material(shaders.kFullScreenVertex, volumeShaders.kVolumeCompositeFragment, uniforms, { depthTest: false, depthWrite: false });

export const uploadMaterial = () => material(shaders.kUploadVertex, shaders.kUploadFragment, {});

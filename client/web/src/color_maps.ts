// Colour maps, for shaders and for the legend.

// sRGB colours, each component in [0, 1], at equal distances along the scale.
export type ColorMap = readonly (readonly [number, number, number])[];

// Levels of detail: light for the finest to dark for the coarsest. Lightness is monotone, and no pair differs only in
// red against green (after viridis).
export const kLevelColors: ColorMap = [
  [0.98, 0.88, 0.2],
  [0.45, 0.78, 0.36],
  [0.14, 0.58, 0.56],
  [0.23, 0.36, 0.6],
  [0.32, 0.17, 0.5],
];

// Thickness: dark for zero to light for the maximum (after inferno).
export const kThicknessColors: ColorMap = [
  [0.02, 0.02, 0.1],
  [0.13, 0.05, 0.3],
  [0.34, 0.06, 0.43],
  [0.54, 0.13, 0.42],
  [0.74, 0.21, 0.33],
  [0.9, 0.36, 0.2],
  [0.98, 0.55, 0.04],
  [0.98, 0.78, 0.17],
  [0.97, 0.98, 0.62],
];

// GLSL: vec3 color_map(float t), the interpolated colour at t, which is clamped to [0, 1].
export const colorMapGlsl = (colors: ColorMap): string => `
vec3 color_map(float t) {
  vec3 c[${colors.length}] = vec3[${colors.length}](${colors.map((c) => `vec3(${c.map((x) => x.toFixed(3)).join(',')})`).join(',')});
  float x = clamp(t, 0.0, 1.0) * ${colors.length - 1}.0;
  int i = min(int(x), ${colors.length - 2});
  return mix(c[i], c[i + 1], x - float(i));
}
`;

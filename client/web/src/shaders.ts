// The shaders, in GLSL ES 3.0. Vertices arrive packed, as the worker sends them (see messages.ts), with positions in
// samples. Lighting is computed in linear colour; inputs and outputs are sRGB.
import { colorMapGlsl, kLevelColors, kThicknessColors } from './color_maps';
import { kMostRanges } from './state';

export const kPrecision = `
precision highp float;
precision highp int;
`;

// Vertex shaders: from samples to drawing space (vPosition, see frame.ts) and to clip space.
export const kTransform = `
uniform mat4 viewMatrix, projectionMatrix;
uniform mat3 fromSamples;
uniform vec3 shift;
out vec3 vPosition;
vec3 drawing_position(uvec3 bits) { return fromSamples * uintBitsToFloat(bits) + shift; }
void transform(vec3 p) {
  vPosition = p;
  gl_Position = projectionMatrix * viewMatrix * vec4(p, 1.0);
}
`;

// The field's value at a vertex, where colours show values (BY_VALUE).
const kValue = `
#ifdef BY_VALUE
in float value;
out float vValue;
void pass_value() { vValue = value; }
#else
void pass_value() {}
#endif
`;

export const kSurfaceVertex = `${kPrecision}
in uvec4 position; // the bits of three floats; then the normal and the level of detail
out vec3 vNormal;
flat out float vLevel;
${kTransform}${kValue}
void main() {
  transform(drawing_position(position.xyz));
  pass_value();
  ivec3 n = ivec3(uvec3(position.w << 24, position.w << 16, position.w << 8)) >> 24;
  vNormal = vec3(n) / 127.0;
  vLevel = float(position.w >> 24);
}`;

// A directional light that moves with the camera, above and to the left of it; hemisphere ambient light; a weak
// specular highlight and rim light. Both sides of a surface are lit.
const kLighting = `
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
vec3 to_linear(vec3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }
vec3 to_srgb(vec3 c) { return max(1.055 * pow(max(c, 0.0), vec3(0.41666)) - 0.055, 0.0); }
vec3 lit(vec3 color, vec3 n, vec3 p) {
  vec3 to_eye = normalize(cameraPosition - p);
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 up = vec3(viewMatrix[0][1], viewMatrix[1][1], viewMatrix[2][1]);
  vec3 to_light = normalize(to_eye - 0.35 * right + 0.45 * up);
  float sky = 0.5 + 0.5 * dot(n, up);
  float diffuse = max(dot(n, to_light), 0.0);
  float specular = pow(max(dot(n, normalize(to_light + to_eye)), 0.0), 32.0);
  float rim = 1.0 - max(dot(n, to_eye), 0.0);
  vec3 albedo = to_linear(color);
  vec3 ambient = mix(vec3(0.19, 0.185, 0.18), vec3(0.30, 0.32, 0.35), sky);
  return to_srgb(albedo * (ambient + 0.78 * diffuse) + 0.07 * specular + 0.05 * rim * rim * rim * (0.4 + albedo));
}
`;

// What replaces a surface's colour: that of the field's value, or of the level of detail.
const kColoring = `
#ifdef BY_VALUE
in float vValue;
uniform sampler2D palette; // 256 x 1 texels
uniform vec2 span; // the value of the first colour; 1 / (that of the last - it)
vec3 colored(vec3 color, float level) {
  float t = clamp((vValue - span.x) * span.y, 0.0, 1.0);
  return texture(palette, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb;
}
#else
uniform float colorByLevel; // 1: levels of detail replace the surface's colour; 0: they do not
uniform float coarsestLevel;
${colorMapGlsl(kLevelColors)}
vec3 colored(vec3 color, float level) {
  return mix(color, color_map(level / max(coarsestLevel, 1.0)), colorByLevel);
}
#endif
`;

// Discards fragments beyond the clip plane, and those in the box that shows shrunken tetrahedra instead.
const kClipping = `
uniform vec4 clip; // normal and offset, drawing space; normal 0: no clip plane
uniform vec3 hiddenMin, hiddenMax;
in vec3 vPosition;
bool is_hidden() { return all(greaterThan(vPosition, hiddenMin)) && all(lessThan(vPosition, hiddenMax)); }
void discard_clipped() {
  if (dot(clip.xyz, vPosition) > clip.w || is_hidden()) discard;
}
`;

const kSurfaceColor = `
in vec3 vNormal;
flat in float vLevel;
uniform vec3 color;
${kClipping}${kColoring}${kLighting}
vec3 surface_color() { return lit(colored(color, vLevel), normalize(vNormal + 1e-6), vPosition); }
`;

export const kOpaqueFragment = `${kPrecision}${kSurfaceColor}
out vec4 fragColor;
void main() {
  discard_clipped();
  fragColor = vec4(surface_color(), 1.0);
}`;

// Weighted blended order-independent transparency: McGuire and Bavoil, 2013. Colours are summed with a weight that
// decreases with depth; transmittances are multiplied. Both targets share one blend function (WebGL 2 has no other):
// rgb is added, alpha is multiplied by 1 - source alpha.
export const kTransparentFragment = `${kPrecision}${kSurfaceColor}
uniform float opacity;
uniform vec2 depthRange; // nearest and farthest depth of the data
layout(location = 0) out vec4 accumulation;
layout(location = 1) out vec4 weight;
void main() {
  discard_clipped();
  float depth = -(viewMatrix * vec4(vPosition, 1.0)).z;
  float w = exp2(6.0 - 16.0 * clamp((depth - depthRange.x) / (depthRange.y - depthRange.x), 0.0, 1.0)) * opacity;
  accumulation = vec4(surface_color() * w, opacity);
  weight = vec4(w, 0.0, 0.0, 1.0);
}`;

// The weighted mean of the transparent colours; alpha: 1 - the product of their transmittances.
export const kTransparencyCompositeFragment = `${kPrecision}
in vec2 vUv;
uniform sampler2D accumulations, weights;
out vec4 fragColor;
void main() {
  vec4 sum = texture(accumulations, vUv);
  fragColor = vec4(sum.rgb / max(texture(weights, vUv).r, 1e-6), 1.0 - sum.a);
}`;

export const kEdgeFragment = `${kPrecision}
in vec3 vNormal;
flat in float vLevel;
uniform vec4 lineColor;
uniform float leastSpacing, pixelScale;
${kClipping}
out vec4 fragColor;
void main() {
  discard_clipped();
  // About the length of an edge on screen. Short edges fade: where many lie close together they would merge to black.
  float pixels = exp2(vLevel) * leastSpacing * pixelScale * gl_FragCoord.w;
  fragColor = vec4(lineColor.rgb, lineColor.a * clamp(pixels / 8.0, 0.12, 1.0));
}`;

export const kCapVertex = `${kPrecision}
in uvec4 position; // the bits of three floats; then the distances from the triangle's sides, and the level of detail
out vec3 vSides;
flat out float vLevel;
${kTransform}${kValue}
void main() {
  transform(drawing_position(position.xyz));
  pass_value();
  vSides = vec3(uvec3(position.w, position.w >> 8, position.w >> 16) & 255u) / 255.0;
  vLevel = float(position.w >> 24);
}`;

// The cut faces of tetrahedra, with their edges as dark lines.
export const kCapFragment = `${kPrecision}
in vec3 vSides;
flat in float vLevel;
uniform vec3 color;
uniform float edgeWidth; // half of it, pixels
${kClipping}${kColoring}${kLighting}
out vec4 fragColor;
void main() {
  if (is_hidden()) discard;
  vec3 to_eye = normalize(cameraPosition - vPosition);
  vec3 facing = dot(clip.xyz, to_eye) < 0.0 ? -clip.xyz : clip.xyz;
  // The normal is bent towards the eye, so that a cut seen at a grazing angle is not too dark.
  vec3 shade = lit(colored(color, vLevel), normalize(facing + 0.7 * to_eye), vPosition);
  vec3 slope = fwidth(vSides);
  vec3 pixels = vSides / max(slope, 1e-6);
  float nearest = min(min(pixels.x, pixels.y), pixels.z);
  float line = 1.0 - smoothstep(edgeWidth - 0.5, edgeWidth + 0.5, nearest);
  float fade = clamp(0.14 / max(max(max(slope.x, slope.y), slope.z), 1e-6), 0.0, 1.0); // triangles of a few pixels
  fragColor = vec4(mix(shade, shade * 0.45, line * fade), 1.0);
}`;

export const kTetsVertex = `${kPrecision}
in uvec3 position;
in uvec3 center;
in uint kind; // surface, level of detail and range
uniform float shrink;
out vec3 vUnshrunk;
flat out float vLevel;
flat out uint vRange;
out vec2 vOnSurface; // interpolated over the triangle: 1 where all corners lie on alpha; the same for beta
${kTransform}${kValue}
void main() {
  pass_value();
  vec3 c = drawing_position(center);
  vUnshrunk = drawing_position(position);
  transform(c + (vUnshrunk - c) * shrink);
  uint surface = kind & 255u;
  vOnSurface = vec2(surface == 1u, surface == 2u);
  vLevel = float((kind >> 8) & 255u);
  vRange = (kind >> 16) & 255u;
}`;

export const kTetsFragment = `${kPrecision}
in vec3 vPosition;
in vec3 vUnshrunk;
flat in float vLevel;
flat in uint vRange;
in vec2 vOnSurface;
uniform vec3 alpha[${kMostRanges}], beta[${kMostRanges}], box[${kMostRanges}];
uniform vec4 clip;
${kColoring}${kLighting}
out vec4 fragColor;
void main() {
  vec3 n = normalize(cross(dFdx(vPosition), dFdy(vPosition)));
  if (dot(clip.xyz, vUnshrunk) > clip.w) discard;
  vec3 color = vOnSurface.x > 0.999 ? alpha[vRange] : vOnSurface.y > 0.999 ? beta[vRange] : box[vRange];
  color *= 0.5 + 0.5 * abs(dot(n, normalize(cameraPosition - vPosition))); // darker at grazing angles: shows the gaps
  fragColor = vec4(lit(colored(color, vLevel), n, vPosition), 1.0);
}`;

// Back faces add their distance from the eye, front faces subtract it: the sum is the length of the ray in the solid.
export const kThicknessFragment = `${kPrecision}
in vec3 vPosition;
uniform vec3 cameraPosition;
uniform vec4 clip;
uniform float capFacing; // 0: a mesh surface; 1: a cap seen from outside the solid; -1: a cap seen from inside
out vec4 sum;
void main() {
  if (capFacing == 0.0 && dot(clip.xyz, vPosition) > clip.w) discard;
  bool front = capFacing == 0.0 ? gl_FrontFacing : capFacing > 0.0;
  float eyeDistance = distance(cameraPosition, vPosition);
  sum = vec4(front ? -eyeDistance : eyeDistance, 1.0, 0.0, 0.0);
}`;

export const kThicknessCompositeFragment = `${kPrecision}
in vec2 vUv;
uniform sampler2D thickness;
uniform float maximum; // at the end of the colour map
out vec4 fragColor;
${colorMapGlsl(kThicknessColors)}
void main() {
  float t = clamp(texture(thickness, vUv).r / maximum, 0.0, 1.0);
  fragColor = vec4(color_map(t), smoothstep(0.0, 0.004, t));
}`;

// Reduces the thickness to 32 x 32 blocks: each fragment is the maximum of a block, sampled at every few texels.
export const kBlockMaximumFragment = `${kPrecision}
uniform sampler2D thickness;
uniform ivec2 size;
out vec4 maximum;
void main() {
  ivec2 block = (size + 31) / 32;
  ivec2 first = ivec2(gl_FragCoord.xy) * block;
  ivec2 stride = max(block / 16, 1);
  float greatest = 0.0;
  for (int y = 0; y < block.y; y += stride.y)
    for (int x = 0; x < block.x; x += stride.x)
      greatest = max(greatest, texelFetch(thickness, min(first + ivec2(x, y), size - 1), 0).r);
  maximum = vec4(greatest, 0.0, 0.0, 1.0);
}`;

// For picking: the distance from the eye, the field's value, and 1 if that is known; alpha 1 where something is drawn.
// PICKS: 0 surfaces, 1 the cap, 2 shrunken tetrahedra, each as much of them as the picture shows.
export const kPickFragment = `${kPrecision}
uniform vec3 cameraPosition;
${kClipping}
#if PICKS == 2
in vec3 vUnshrunk;
#endif
#ifdef BY_VALUE
in float vValue;
#endif
out vec4 fragColor;
void main() {
#if PICKS == 0
  discard_clipped();
#elif PICKS == 1
  if (is_hidden()) discard;
#else
  if (dot(clip.xyz, vUnshrunk) > clip.w) discard;
#endif
  fragColor = vec4(distance(cameraPosition, vPosition), 0.0, 0.0, 1.0);
#ifdef BY_VALUE
  fragColor.yz = vec2(vValue, 1.0);
#endif
}`;

// One triangle that covers the screen, without vertex attributes.
export const kFullScreenVertex = `${kPrecision}
out vec2 vUv;
void main() {
  vUv = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  gl_Position = vec4(vUv * 2.0 - 1.0, 0.0, 1.0);
}`;

export const kLineVertex = `${kPrecision}
in vec3 position; // in drawing space
uniform mat4 viewMatrix, projectionMatrix;
void main() { gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0); }`;

export const kLineFragment = `${kPrecision}
uniform vec4 lineColor;
out vec4 fragColor;
void main() { fragColor = lineColor; }`;

// For uploads (upload.ts): reads the attribute, so that its buffer is needed; draws nothing.
export const kUploadVertex = `${kPrecision}
in uvec3 position;
void main() { gl_Position = vec4(uintBitsToFloat(position), 0.0); }`;

export const kUploadFragment = `${kPrecision}
out vec4 fragColor;
void main() { fragColor = vec4(0.0); }`;

// The shaders of what is drawn, in GLSL ES 3.0. Vertices come packed, as the worker sends them: see messages.ts; positions in samples.

// Where a vertex is in drawing space, and what one needs to know of it.
const kPlace = `
uniform mat4 viewMatrix, projectionMatrix;
uniform vec3 spacing, shift;
out vec3 place;
vec3 unpacked(uvec3 bits) { return spacing * uintBitsToFloat(bits) + shift; }
void put(vec3 p) {
  place = p;
  gl_Position = projectionMatrix * viewMatrix * vec4(p, 1.0);
}
`;

const kPrecision = `
precision highp float;
precision highp int;
`;

export const kSkinVertex = `${kPrecision}
in uvec4 position; // three floats' bits; the normal and the level
out vec3 normal;
flat out float level;
${kPlace}
void main() {
  put(unpacked(position.xyz));
  ivec3 n = ivec3(uvec3(position.w << 24, position.w << 16, position.w << 8)) >> 24;
  normal = vec3(n) / 127.0;
  level = float(position.w >> 24);
}`;

// A light at the head, a little to the upper left of it; sky and ground; a soft highlight. From sRGB, to sRGB.
const kLight = `
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
vec3 linear(vec3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }
vec3 srgb(vec3 c) { return max(1.055 * pow(max(c, 0.0), vec3(0.41666)) - 0.055, 0.0); }
vec3 lit(vec3 color, vec3 n, vec3 p) {
  vec3 to_eye = normalize(cameraPosition - p);
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 up = vec3(viewMatrix[0][1], viewMatrix[1][1], viewMatrix[2][1]);
  vec3 to_light = normalize(to_eye - 0.35 * right + 0.45 * up);
  float sky = 0.5 + 0.5 * dot(n, up);
  float diffuse = max(dot(n, to_light), 0.0);
  float highlight = pow(max(dot(n, normalize(to_light + to_eye)), 0.0), 32.0);
  float rim = 1.0 - max(dot(n, to_eye), 0.0);
  vec3 base = linear(color);
  vec3 ambient = mix(vec3(0.19, 0.185, 0.18), vec3(0.30, 0.32, 0.35), sky);
  return srgb(base * (ambient + 0.78 * diffuse) + 0.07 * highlight + 0.05 * rim * rim * rim * (0.4 + base));
}
`;

// Colours along a scale, evenly apart.
export type Ramp = readonly (readonly [number, number, number])[];

// Levels of detail: from fine and light to coarse and dark, even in lightness, told apart without red and green (after viridis).
export const kLevelRamp: Ramp = [
  [0.98, 0.88, 0.2],
  [0.45, 0.78, 0.36],
  [0.14, 0.58, 0.56],
  [0.23, 0.36, 0.6],
  [0.32, 0.17, 0.5],
];
// Thickness: from nothing and dark to much and light (after inferno).
export const kThicknessRamp: Ramp = [
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
// vec3 ramp(float t): a ramp's colour, t from 0 to 1.
const rampOf = (stops: Ramp) => `
vec3 ramp(float t) {
  vec3 c[${stops.length}] = vec3[${stops.length}](${stops.map((c) => `vec3(${c.map((x) => x.toFixed(3)).join(',')})`).join(',')});
  float x = clamp(t, 0.0, 1.0) * ${stops.length - 1}.0;
  int i = min(int(x), ${stops.length - 2});
  return mix(c[i], c[i + 1], x - float(i));
}
`;
const kLevels = `
uniform float byLevel, levels; // 1 where colours are the levels'; the coarsest level
${rampOf(kLevelRamp)}
vec3 colored(vec3 color, float level) { return mix(color, ramp(level / max(levels, 1.0)), byLevel); }
`;

// What is not drawn: beyond the plane, and in the box that shows tetrahedra.
const kCut = `
uniform vec4 clip; // normal and offset; normal 0: none
uniform vec3 hiddenMin, hiddenMax;
in vec3 place;
void cut() {
  if (dot(clip.xyz, place) > clip.w) discard;
  if (all(greaterThan(place, hiddenMin)) && all(lessThan(place, hiddenMax))) discard;
}
`;

const kSkinColor = `
in vec3 normal;
flat in float level;
uniform vec3 color;
${kCut}${kLevels}${kLight}
vec3 skin_color() { return lit(colored(color, level), normalize(normal + 1e-6), place); }
`;

export const kSkinFragment = `${kPrecision}${kSkinColor}
out vec4 picture;
void main() {
  cut();
  picture = vec4(skin_color(), 1.0);
}`;

// Weighted blended transparency: McGuire and Bavoil 2013. Colours are added, each with a weight that falls with the depth; what shines through is
// multiplied. One blend function serves both targets: colours are added, alphas multiplied.
export const kVeilFragment = `${kPrecision}${kSkinColor}
uniform float opacity;
uniform vec2 depths; // nearest and farthest of the data
layout(location = 0) out vec4 sum;
layout(location = 1) out vec4 weight;
void main() {
  cut();
  float depth = -(viewMatrix * vec4(place, 1.0)).z;
  float w = exp2(6.0 - 16.0 * clamp((depth - depths.x) / (depths.y - depths.x), 0.0, 1.0)) * opacity;
  sum = vec4(skin_color() * w, opacity);
  weight = vec4(w, 0.0, 0.0, 1.0);
}`;

export const kEdgeFragment = `${kPrecision}
in vec3 normal;
flat in float level;
uniform vec4 ink;
uniform vec3 spacing;
uniform float pixelScale;
${kCut}
out vec4 picture;
void main() {
  cut();
  float pixels = exp2(level) * min(spacing.x, min(spacing.y, spacing.z)) * pixelScale * gl_FragCoord.w; // about an edge's length
  picture = vec4(ink.rgb, ink.a * clamp(pixels / 8.0, 0.12, 1.0)); // many thin lines in a place would be but dark
}`;

export const kCapVertex = `${kPrecision}
in uvec4 position; // three floats' bits; distances from three sides, and the level
out vec3 sides;
flat out float level;
${kPlace}
void main() {
  put(unpacked(position.xyz));
  sides = vec3(uvec3(position.w, position.w >> 8, position.w >> 16) & 255u) / 255.0;
  level = float(position.w >> 24);
}`;

export const kCapFragment = `${kPrecision}
in vec3 place;
in vec3 sides;
flat in float level;
uniform vec3 color;
uniform vec4 clip;
uniform vec3 hiddenMin, hiddenMax;
uniform float outline; // pixels
${kLevels}${kLight}
out vec4 picture;
void main() {
  if (all(greaterThan(place, hiddenMin)) && all(lessThan(place, hiddenMax))) discard;
  vec3 to_eye = normalize(cameraPosition - place);
  vec3 facing = dot(clip.xyz, to_eye) < 0.0 ? -clip.xyz : clip.xyz;
  vec3 shade = lit(colored(color, level), normalize(facing + 0.7 * to_eye), place); // a cut at a slant is to be read, too
  vec3 slope = fwidth(sides);
  vec3 pixels = sides / max(slope, 1e-6);
  float near = min(min(pixels.x, pixels.y), pixels.z);
  float line = 1.0 - smoothstep(outline - 0.5, outline + 0.5, near);
  float small = clamp(0.14 / max(max(max(slope.x, slope.y), slope.z), 1e-6), 0.0, 1.0); // fades where triangles are but a few pixels
  picture = vec4(mix(shade, shade * 0.45, line * small), 1.0);
}`;

export const kTetsVertex = `${kPrecision}
in uvec3 position;
in uvec3 center;
in uint kind; // surface and level
uniform float shrink;
out vec3 whole; // the place before shrinking
flat out float level;
out vec2 share; // how many corners are on alpha and on beta, over the triangle
${kPlace}
void main() {
  vec3 c = unpacked(center);
  whole = unpacked(position);
  put(c + (whole - c) * shrink);
  uint surface = kind & 255u;
  share = vec2(surface == 1u, surface == 2u);
  level = float((kind >> 8) & 255u);
}`;

export const kTetsFragment = `${kPrecision}
in vec3 place;
in vec3 whole;
flat in float level;
in vec2 share;
uniform vec3 alpha, beta, box;
uniform vec4 clip;
${kLevels}${kLight}
out vec4 picture;
void main() {
  vec3 n = normalize(cross(dFdx(place), dFdy(place)));
  if (dot(clip.xyz, whole) > clip.w) discard;
  vec3 color = share.x > 0.999 ? alpha : share.y > 0.999 ? beta : box;
  color *= 0.5 + 0.5 * abs(dot(n, normalize(cameraPosition - place))); // what is seen at a slant is darker, or gaps do not show
  picture = vec4(lit(colored(color, level), n, place), 1.0);
}`;

// Adds what is behind to, and takes what is in front from, the way of each ray: the sum is its length within the solid.
export const kThicknessFragment = `${kPrecision}
in vec3 place;
uniform vec3 cameraPosition;
uniform vec4 clip;
uniform float capFacing; // 0: the skin; otherwise a cap, 1 where it is seen from outside, -1 from inside
out vec4 sum;
void main() {
  if (capFacing == 0.0 && dot(clip.xyz, place) > clip.w) discard;
  bool front = capFacing == 0.0 ? gl_FrontFacing : capFacing > 0.0;
  float way = distance(cameraPosition, place);
  sum = vec4(front ? -way : way, 1.0, 0.0, 0.0);
}`;

export const kDistanceFragment = `${kPrecision}
uniform vec3 cameraPosition;
${kCut}
out vec4 picture;
void main() {
  cut();
  picture = vec4(distance(cameraPosition, place), 0.0, 0.0, 1.0);
}`;

export const kFullScreenVertex = `${kPrecision}
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
}`;

export const kVeilOverFragment = `${kPrecision}
in vec2 at;
uniform sampler2D sums, weights;
out vec4 picture;
void main() {
  vec4 sum = texture(sums, at);
  picture = vec4(sum.rgb / max(texture(weights, at).r, 1e-6), 1.0 - sum.a);
}`;

// Thin is dark and thick is bright: inferno, by a polynomial of degree 6 (Matt Zucker's fit, public domain).
export const kThicknessOverFragment = `${kPrecision}
in vec2 at;
uniform sampler2D sums;
uniform float most; // what the end of the ramp stands for
out vec4 picture;
${rampOf(kThicknessRamp)}
void main() {
  float way = texture(sums, at).r;
  float t = clamp(way / most, 0.0, 1.0);
  picture = vec4(ramp(t), smoothstep(0.0, 0.004, t));
}`;

export const kLineVertex = `${kPrecision}
in vec3 position; // in drawing space
uniform mat4 viewMatrix, projectionMatrix;
void main() { gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0); }`;

export const kLineFragment = `${kPrecision}
uniform vec4 ink;
out vec4 picture;
void main() { picture = ink; }`;

// Draws nothing; but what is given to it to draw is uploaded.
export const kStagingVertex = `${kPrecision}
in uvec3 position;
void main() { gl_Position = vec4(uintBitsToFloat(position), 0.0); }`;

export const kStagingFragment = `${kPrecision}
out vec4 picture;
void main() { picture = vec4(0.0); }`;

// The greatest of a block's sums, of which one in a stride is looked at.
export const kMostFragment = `${kPrecision}
uniform sampler2D sums;
uniform ivec2 size;
out vec4 most;
void main() {
  ivec2 block = (size + 31) / 32;
  ivec2 first = ivec2(gl_FragCoord.xy) * block;
  ivec2 stride = max(block / 16, 1);
  float greatest = 0.0;
  for (int y = 0; y < block.y; y += stride.y)
    for (int x = 0; x < block.x; x += stride.x)
      greatest = max(greatest, texelFetch(sums, min(first + ivec2(x, y), size - 1), 0).r);
  most = vec4(greatest, 0.0, 0.0, 1.0);
}`;

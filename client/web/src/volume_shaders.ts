// The shaders of volume rendering (volume.ts).
import { kPrecision, kTransform } from './shaders';

// A tetrahedron is an instance; its faces that are seen from inside are drawn, so each pixel
// that it covers once, also around an eye that is in it. Along a ray the barycentric coordinates change linearly.
export const kVolumeVertex = `${kPrecision}
in uint order; // the tetrahedron's number
uniform highp sampler2D points; // position in samples, and value
uniform highp usampler2D tets; // points; the first has the range in its upper two bits
uniform vec2 values;
uniform vec3 cameraPosition;
flat out vec4 vAtEye; // barycentric coordinates of the eye
out vec4 vAtExit; // ... of the point that is drawn
flat out vec4 vPlaces; // of the corners' values in the table of transfer: 0 to 1
flat out int vRow; // of that table
${kTransform}
ivec2 texel(uint i) { return ivec2(i & 4095u, i >> 12u); }
// Of the eye: 1 at the corner, 0 on the face abc.
float share(vec3 corner, vec3 a, vec3 b, vec3 c) {
  vec3 normal = cross(b - a, c - a);
  float height = dot(corner - a, normal);
  return height == 0.0 ? 0.0 : dot(cameraPosition - a, normal) / height;
}
void main() {
  uvec4 corners = texelFetch(tets, texel(order), 0);
  vRow = int(corners.x >> 30u);
  corners.x &= 0x3fffffffu;
  vec3 p[4];
  for (int k = 0; k < 4; ++k) {
    vec4 point = texelFetch(points, texel(corners[k]), 0);
    p[k] = fromSamples * point.xyz + shift;
    vPlaces[k] = clamp((point.w - values.x) * values.y, 0.0, 1.0);
  }
  vAtEye = vec4(share(p[0], p[1], p[2], p[3]), share(p[1], p[2], p[3], p[0]), share(p[2], p[3], p[0], p[1]), share(p[3], p[0], p[1], p[2]));
  vAtExit = vec4(equal(ivec4(0, 1, 2, 3), ivec4(gl_VertexID)));
  transform(p[gl_VertexID]);
}`;

// The light of a piece of a ray as TransferFunction::add has it (common/view/transfer_function.cpp): absorption, and
// emission times it, from their integrals over values; long pieces are divided.
export const kVolumeFragment = `${kPrecision}
flat in vec4 vAtEye;
in vec4 vAtExit;
flat in vec4 vPlaces;
flat in int vRow;
in vec3 vPosition;
uniform vec3 cameraPosition;
uniform vec4 clip;
uniform float lengthScale; // units of length in a unit of the world
uniform highp sampler2D transfer; // see transferTable() in opacity.ts: rates and integrals, for each range
out vec4 fragColor;
const int kCells = 1024;
vec4 rates_at(float place) {
  float at = place * float(kCells);
  int cell = min(int(at), kCells - 1);
  return mix(texelFetch(transfer, ivec2(cell, 2 * vRow), 0), texelFetch(transfer, ivec2(cell + 1, 2 * vRow), 0), at - float(cell));
}
vec4 sum_to(float place) {
  float at = place * float(kCells);
  int cell = min(int(at), kCells - 1);
  float t = at - float(cell);
  vec4 low = texelFetch(transfer, ivec2(cell, 2 * vRow), 0), high = texelFetch(transfer, ivec2(cell + 1, 2 * vRow), 0);
  return texelFetch(transfer, ivec2(cell, 2 * vRow + 1), 0) + t * (low + 0.5 * t * (high - low)) / float(kCells);
}
// Where both are near, differences of the integrals would have too few digits.
vec4 mean_of(float from, float to) {
  if (abs(to - from) * float(kCells) < 1.0) return rates_at(0.5 * (from + to));
  return (sum_to(to) - sum_to(from)) / (to - from);
}
void follow(inout vec4 light, vec4 mean, float along) {
  if (!(mean.a > 0.0)) return;
  float depth = mean.a * along;
  float absorbed = depth < 1e-3 ? depth * (1.0 - 0.5 * depth) : 1.0 - exp(-depth);
  light += (1.0 - light.a) * absorbed * vec4(mean.rgb / mean.a, 1.0);
}
void main() {
  // From the exit back to the eye: the ray is in the tetrahedron between these shares of the way.
  vec4 rise = vAtExit - vAtEye;
  float first = 0.0, last = 1.0;
  for (int k = 0; k < 4; ++k) if (rise[k] > 0.0) last = min(last, max(vAtExit[k], 0.0) / rise[k]);
  float out_there = dot(clip.xyz, vPosition) - clip.w, out_here = dot(clip.xyz, cameraPosition) - clip.w;
  if (out_there > 0.0) first = out_here < 0.0 ? out_there / (out_there - out_here) : 1.0;
  else if (out_here > 0.0) last = min(last, out_there / (out_there - out_here));
  if (!(first < last)) discard;
  float from = clamp(dot(vPlaces, vAtExit - last * rise), 0.0, 1.0), to = clamp(dot(vPlaces, vAtExit - first * rise), 0.0, 1.0);
  float along = (last - first) * distance(cameraPosition, vPosition) * lengthScale;
  vec4 light = vec4(0.0), mean = mean_of(from, to);
  int pieces = clamp(int(ceil(min(mean.a * along / 0.25, abs(to - from) * 256.0))), 1, 64);
  if (pieces == 1) follow(light, mean, along);
  else for (int i = 0; i < pieces && light.a < 0.9999; ++i) {
    vec2 ends = mix(vec2(from), vec2(to), vec2(i, i + 1) / float(pieces));
    follow(light, mean_of(ends.x, ends.y), along / float(pieces));
  }
  fragColor = light;
}`;

// Over the background.
export const kVolumeCompositeFragment = `${kPrecision}
in vec2 vUv;
uniform sampler2D light; // linear, and opacity
uniform vec3 background; // sRGB
out vec4 fragColor;
void main() {
  vec4 sum = texture(light, vUv);
  vec3 color = sum.rgb + (1.0 - sum.a) * pow(background, vec3(2.2));
  fragColor = vec4(pow(max(color, 0.0), vec3(1.0 / 2.2)), 1.0);
}`;

// The vertex and fragment shaders of a Canvas.
#pragma once

namespace intervale {

inline constexpr unsigned kPositionAttribute = 0, kNormalAttribute = 1, kLookAttribute = 2, kValueAttribute = 3;

// One triangle that covers everything.
inline constexpr char kBackgroundVertexShader[] = R"(#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
})";

// Between the beginning of the mesh's fragment shader and the rest of it.
inline constexpr char kByValue[] = "const bool by_value = true;\n", kBySurface[] = "const bool by_value = false;\n";

// The beginning of both fragment shaders. Colours are mixed as linear light, and converted to sRGB at the end.
inline constexpr char kFragmentPreamble[] = R"(#version 300 es
precision highp float;
uniform float height;
out vec4 colour;
vec3 background() { return mix(vec3(0.83, 0.86, 0.90), vec3(0.98, 0.985, 0.99), smoothstep(-0.1, 0.9, gl_FragCoord.y / height)); }
vec3 encoded(vec3 light) { return pow(clamp(light, 0.0, 1.0), vec3(1.0 / 2.2)); }
)";

// Alpha tells where something was drawn.
inline constexpr char kBackgroundFragmentShader[] = R"(void main() { colour = vec4(encoded(background()), 0.0); })";

inline constexpr char kMeshVertexShader[] = R"(#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in uint look;
layout(location = 3) in float value;
uniform mat4 projection;
uniform mat3 rotation;
uniform vec3 eye;
out vec3 v_normal;
out vec3 v_to_eye;
out vec3 v_sides;  // how far from each side that is drawn, 1 in the corner opposite it; of the others always 1
flat out uint v_part;
out float v_value;
void main() {
  gl_Position = projection * vec4(position, 1.0);
  v_normal = rotation * normal;
  v_to_eye = rotation * (eye - position);
  for (int side = 0; side < 3; ++side)
    v_sides[side] = (look >> uint(2 + side) & 1u) == 0u || gl_VertexID % 3 == side ? 1.0 : 0.0;
  v_part = look & 3u;
  v_value = value;
})";

// A light beside the eye and a soft one from above. Distant parts are paler, as a cue for depth; but not where colours
// are values: there a face towards the eye has nearly the palette's own, and surfaces shine, so that dark ones have a
// shape too.
// Sides are drawn about a pixel wide; where triangles are only a few pixels wide, they fade, or they would hide
// everything else.
inline constexpr char kMeshFragmentShader[] = R"(in vec3 v_normal;
in vec3 v_to_eye;
in vec3 v_sides;
flat in uint v_part;
in float v_value;
uniform sampler2D palette;
uniform vec2 nearest_to_far;
const vec3 parts[4] = vec3[4](vec3(0.040, 0.220, 0.540), vec3(0.860, 0.250, 0.030), vec3(0.820, 0.680, 0.400), vec3(0.860, 0.725, 0.450));
const vec3 line = vec3(0.014, 0.020, 0.035);
const vec3 light = vec3(-0.34, 0.53, 0.78);

// Of the palette's 256 colours, from the middle of the first to that of the last.
vec3 colour_of_value() { return pow(texture(palette, vec2((0.5 + 255.0 * clamp(v_value, 0.0, 1.0)) / 256.0, 0.5)).rgb, vec3(2.2)); }

float line_cover() {
  float cover = 0.0;
  for (int side = 0; side < 3; ++side) {
    float per_pixel = max(length(vec2(dFdx(v_sides[side]), dFdy(v_sides[side]))), 1e-6);
    float near = 1.0 - smoothstep(0.25, 1.0, v_sides[side] / per_pixel);
    cover = max(cover, near * smoothstep(2.0, 9.0, 1.0 / per_pixel));
  }
  return cover;
}

void main() {
  vec3 normal = normalize(gl_FrontFacing ? v_normal : -v_normal);
  vec3 to_eye = normalize(v_to_eye);
  vec3 albedo = by_value ? colour_of_value() : parts[v_part];
  float key = max(dot(normal, light), 0.0);
  float head = max(dot(normal, to_eye), 0.0);
  float fill = 0.5 + 0.5 * normal.y;
  vec3 lit = albedo * (0.92 * key + 0.22 * head + 0.05 + 0.16 * fill);
  if (v_part < 2u) lit += (by_value ? 0.08 : 0.16) * pow(max(dot(normal, normalize(light + to_eye)), 0.0), by_value ? 24.0 : 60.0);
  lit = mix(lit, line, 0.72 * line_cover());
  float away = clamp((v_to_eye.z - nearest_to_far.x) / (nearest_to_far.y - nearest_to_far.x), 0.0, 1.0);
  colour = vec4(encoded(mix(lit, background(), by_value ? 0.0 : 0.24 * away)), 1.0);
})";

}  // namespace intervale

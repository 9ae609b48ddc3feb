#include "common/picture/canvas.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <string>

#include "common/picture/shaders.h"

namespace intervale {
namespace {

constexpr GLsizei kSamples = 4;
constexpr GLfloat kBackFaceOffset = 1;  // depths by which back faces give way to front faces that they coincide with

Result<GLuint> compiled(const Gl& gl, GLenum kind, const std::vector<const char*>& source) {
  const GLuint shader = gl.CreateShader(kind);
  gl.ShaderSource(shader, GLsizei(source.size()), source.data(), nullptr);
  gl.CompileShader(shader);
  GLint done = GL_FALSE;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &done);
  if (done == GL_TRUE) return shader;
  std::array<char, 1024> log{};
  gl.GetShaderInfoLog(shader, GLsizei(log.size()), nullptr, log.data());
  return fail(std::string("cannot draw a picture: this machine's OpenGL ES refuses a shader: ") + log.data());
}

Result<GLuint> linked(const Gl& gl, const char* vertex, const std::vector<const char*>& fragment) {
  const GLuint program = gl.CreateProgram();
  auto vertex_shader = compiled(gl, GL_VERTEX_SHADER, {vertex});
  if (!vertex_shader) return vertex_shader;
  auto fragment_shader = compiled(gl, GL_FRAGMENT_SHADER, fragment);
  if (!fragment_shader) return fragment_shader;
  gl.AttachShader(program, *vertex_shader);
  gl.AttachShader(program, *fragment_shader);
  gl.LinkProgram(program);
  GLint done = GL_FALSE;
  gl.GetProgramiv(program, GL_LINK_STATUS, &done);
  if (done != GL_TRUE) return fail("cannot draw a picture: this machine's OpenGL ES cannot link the shaders");
  return program;
}

void attach(const Gl& gl, GLenum attachment, GLenum format, const std::array<int, 2>& size, GLsizei samples) {
  GLuint buffer = 0;
  gl.GenRenderbuffers(1, &buffer);
  gl.BindRenderbuffer(GL_RENDERBUFFER, buffer);
  gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, size[0], size[1]);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
}

// A framebuffer, bound. With as many samples as there can be, up to kSamples: where multisampling fails, edges are
// rough, but there they are.
Result<GLuint> framebuffer(const Gl& gl, const std::array<int, 2>& size, bool is_drawn_into) {
  GLint most = 0;
  gl.GetIntegerv(GL_MAX_SAMPLES, &most);
  for (GLsizei samples = is_drawn_into ? std::min<GLsizei>(kSamples, most) : 0;; samples = 0) {
    GLuint made = 0;
    gl.GenFramebuffers(1, &made);
    gl.BindFramebuffer(GL_FRAMEBUFFER, made);
    attach(gl, GL_COLOR_ATTACHMENT0, GL_RGBA8, size, samples);
    if (is_drawn_into) attach(gl, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, size, samples);
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE && gl.GetError() == GL_NO_ERROR) return made;
    if (samples == 0)
      return fail(fmt::format("cannot draw a picture of {} x {} pixels: no memory for it; take a smaller viewport", size[0], size[1]));
    while (gl.GetError() != GL_NO_ERROR) {
    }
  }
}

// The palette is the only texture.
void use_palette(const Gl& gl, const Palette& palette) {
  const Palette::Bytes bytes = palette.bytes();
  GLuint texture = 0;
  gl.GenTextures(1, &texture);
  gl.BindTexture(GL_TEXTURE_2D, texture);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, GLsizei(bytes.size()), 1, 0, GL_RGB, GL_UNSIGNED_BYTE, bytes.data());
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) gl.TexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) gl.TexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
}

// A buffer, bound, for corners.
void describe_corners(const Gl& gl) {
  GLuint array = 0, buffer = 0;
  gl.GenVertexArrays(1, &array);
  gl.BindVertexArray(array);
  gl.GenBuffers(1, &buffer);
  gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
  const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
  gl.VertexAttribPointer(kPositionAttribute, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), offset(offsetof(Corner, position)));
  gl.VertexAttribPointer(kNormalAttribute, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), offset(offsetof(Corner, normal)));
  gl.VertexAttribIPointer(kLookAttribute, 1, GL_UNSIGNED_INT, sizeof(Corner), offset(offsetof(Corner, look)));
  gl.VertexAttribPointer(kValueAttribute, 1, GL_FLOAT, GL_FALSE, sizeof(Corner), offset(offsetof(Corner, value)));
  for (const GLenum attribute : {kPositionAttribute, kNormalAttribute, kLookAttribute, kValueAttribute}) gl.EnableVertexAttribArray(attribute);
}

}  // namespace

Result<void> Canvas::begin(const Viewpoint& viewpoint, const std::optional<Palette>& palette) {
  const Gl& gl = context_.gl();
  GLint longest = 0;
  gl.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &longest);
  if (std::max(size_[0], size_[1]) > longest)
    return misuse(fmt::format("a picture has at most {} pixels each way on this machine, not {} x {}", longest, size_[0], size_[1]));
  const auto buffer = framebuffer(gl, size_, true);
  if (!buffer) return tl::unexpected(buffer.error());
  drawn_ = *buffer;
  gl.Viewport(0, 0, size_[0], size_[1]);
  gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (auto done = draw_background(); !done) return done;
  return prepare(viewpoint, palette);
}

Result<void> Canvas::draw_background() const {
  const Gl& gl = context_.gl();
  const auto program = linked(gl, kBackgroundVertexShader, {kFragmentPreamble, kBackgroundFragmentShader});
  if (!program) return tl::unexpected(program.error());
  GLuint no_attributes = 0;
  gl.GenVertexArrays(1, &no_attributes);
  gl.BindVertexArray(no_attributes);
  gl.UseProgram(*program);
  gl.Uniform1f(gl.GetUniformLocation(*program, "height"), GLfloat(size_[1]));
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  return {};
}

Result<void> Canvas::prepare(const Viewpoint& viewpoint, const std::optional<Palette>& palette) const {
  const Gl& gl = context_.gl();
  const auto program = linked(gl, kMeshVertexShader, {kFragmentPreamble, palette ? kByValue : kBySurface, kMeshFragmentShader});
  if (!program) return tl::unexpected(program.error());
  gl.UseProgram(*program);
  const auto at = [&](const char* name) { return gl.GetUniformLocation(*program, name); };
  gl.UniformMatrix4fv(at("projection"), 1, GL_FALSE, viewpoint.projection.data());
  gl.UniformMatrix3fv(at("rotation"), 1, GL_FALSE, viewpoint.rotation.data());
  gl.Uniform3fv(at("eye"), 1, viewpoint.eye.data());
  gl.Uniform2fv(at("nearest_to_far"), 1, viewpoint.nearest_to_far.data());
  gl.Uniform1f(at("height"), GLfloat(size_[1]));
  if (palette) use_palette(gl, *palette);
  describe_corners(gl);
  gl.Enable(GL_DEPTH_TEST);
  gl.Enable(GL_CULL_FACE);
  gl.PolygonOffset(kBackFaceOffset, kBackFaceOffset);
  return {};
}

Result<Canvas> Canvas::create(const std::array<int, 2>& size, const Viewpoint& viewpoint, const std::optional<Palette>& palette) {
  auto context = GlContext::create();
  if (!context) return tl::unexpected(context.error());
  Canvas canvas(std::move(*context), size);
  if (auto begun = canvas.begin(viewpoint, palette); !begun) return tl::unexpected(begun.error());
  return canvas;
}

void Canvas::draw(std::span<const Corner> corners) {
  const Gl& gl = context_.gl();
  gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(corners.size_bytes()), corners.data(), GL_STREAM_DRAW);
  for (const GLenum hidden : {GL_BACK, GL_FRONT}) {
    gl.CullFace(hidden);
    if (hidden == GL_FRONT) gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.DrawArrays(GL_TRIANGLES, 0, GLsizei(corners.size()));
  }
  gl.Disable(GL_POLYGON_OFFSET_FILL);
}

Result<Pixels> Canvas::finish() {
  const Gl& gl = context_.gl();
  const int width = size_[0], height = size_[1];
  const auto resolved = framebuffer(gl, size_, false);
  if (!resolved) return tl::unexpected(resolved.error());
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, drawn_);
  gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, *resolved);
  std::vector<std::uint8_t> rgba(std::size_t(width) * std::size_t(height) * 4);
  gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  if (const GLenum error = gl.GetError(); error != GL_NO_ERROR)
    return fail(fmt::format("cannot draw a picture of {} x {} pixels: OpenGL ES error {:#x}", width, height, error));

  Pixels pixels{width, height, {}, false};
  pixels.rgb.reserve(rgba.size() / 4 * 3);
  for (int row = height - 1; row >= 0; --row) {  // the library's rows begin at the bottom
    const std::uint8_t* from = rgba.data() + std::size_t(row) * std::size_t(width) * 4;
    for (int column = 0; column < width; ++column, from += 4) {
      pixels.rgb.insert(pixels.rgb.end(), from, from + 3);
      pixels.has_drawing |= from[3] != 0;
    }
  }
  return pixels;
}

}  // namespace intervale

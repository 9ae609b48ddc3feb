// OpenGL ES 3 without a display, by Mesa's EGL. Loaded when the first picture is drawn, so that machines that draw none
// do not need it.
#pragma once

#include <EGL/egl.h>
#include <GLES3/gl3.h>

#include "common/util/result.h"

namespace intervale {

// The functions that a Canvas calls, by the library's own names without "gl".
// clang-format 14 does not agree with its own output here.
// clang-format off
#define INTERVALE_GL_FUNCTIONS(F) \
  F(AttachShader) F(BindBuffer) F(BindFramebuffer) F(BindRenderbuffer) F(BindTexture) F(BindVertexArray) F(BlitFramebuffer) \
  F(BufferData) F(CheckFramebufferStatus) F(Clear) F(CompileShader) F(CreateProgram) F(CreateShader) F(CullFace) \
  F(Disable) F(DrawArrays) F(Enable) F(EnableVertexAttribArray) F(FramebufferRenderbuffer) \
  F(GenBuffers) F(GenFramebuffers) F(GenRenderbuffers) F(GenTextures) F(GenVertexArrays) F(GetError) F(GetIntegerv) \
  F(GetProgramiv) F(GetShaderInfoLog) F(GetShaderiv) F(GetUniformLocation) F(LinkProgram) F(PolygonOffset) \
  F(ReadPixels) F(RenderbufferStorageMultisample) F(ShaderSource) F(Uniform1f) F(Uniform2fv) F(Uniform3fv) \
  F(UniformMatrix3fv) F(UniformMatrix4fv) F(UseProgram) F(VertexAttribIPointer) F(VertexAttribPointer) \
  F(TexImage2D) F(TexParameteri) F(Viewport)
// clang-format on

struct Gl {
#define INTERVALE_GL_MEMBER(name) decltype(&::gl##name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
  INTERVALE_GL_FUNCTIONS(INTERVALE_GL_MEMBER)
#undef INTERVALE_GL_MEMBER
};

// A context, current in the thread that created it while it exists; it owns all objects created in it. One thread.
class GlContext {
 public:
  // Fails, with what to install, where there is no EGL or it has no OpenGL ES 3 without a display.
  static Result<GlContext> create();
  GlContext(GlContext&& other) noexcept;
  GlContext& operator=(GlContext&&) = delete;
  ~GlContext();

  [[nodiscard]] const Gl& gl() const { return gl_; }

 private:
  GlContext() = default;
  struct Egl;
  const Egl* egl_ = nullptr;
  EGLContext context_ = EGL_NO_CONTEXT;
  Gl gl_;
};

}  // namespace intervale

#include "common/picture/gl.h"

#include <EGL/eglext.h>
#include <dlfcn.h>
#include <fmt/core.h>

#include <cstdlib>
#include <string>
#include <utility>

namespace intervale {
namespace {

tl::unexpected<Error> no_gl(const std::string& why) {
  return fail("cannot draw a picture: " + why + "; install Mesa's software renderer (Debian: libegl1 libgl1-mesa-dri)");
}

// Before the library is there to read them; what the user has set stays. Processors draw the same picture on every
// machine, and need no permission to use a device; nothing is told on stderr but our own one line; nothing is left in
// the user's cache.
void choose_software() {
  constexpr int kKeep = 0;
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "true", kKeep);
  ::setenv("EGL_LOG_LEVEL", "fatal", kKeep);
  ::setenv("MESA_SHADER_CACHE_DISABLE", "true", kKeep);
}

}  // namespace

#define INTERVALE_EGL_FUNCTIONS(F) \
  F(BindAPI)                       \
  F(CreateContext) F(DestroyContext) F(GetError) F(GetPlatformDisplay) F(GetProcAddress) F(Initialize) F(MakeCurrent) F(ReleaseThread)

struct GlContext::Egl {
#define INTERVALE_EGL_MEMBER(name) decltype(&::egl##name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
  INTERVALE_EGL_FUNCTIONS(INTERVALE_EGL_MEMBER)
#undef INTERVALE_EGL_MEMBER
  EGLDisplay display = EGL_NO_DISPLAY;

  // The library and its display stay once they are there: to end a display unloads its driver, which loses memory
  // thereby.
  static Result<Egl> load() {
    choose_software();
    void* const library = ::dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) return no_gl("no EGL on this machine");
    Egl egl;
    bool complete = true;
    const auto find = [&]<class Function>(Function& function, const char* name) {
      function = reinterpret_cast<Function>(::dlsym(library, name));
      complete = complete && function != nullptr;
    };
#define INTERVALE_EGL_FIND(name) find(egl.name, "egl" #name);
    INTERVALE_EGL_FUNCTIONS(INTERVALE_EGL_FIND)
#undef INTERVALE_EGL_FIND
    if (!complete) return no_gl("this machine's EGL is older than 1.5");
    egl.display = egl.GetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (egl.display == EGL_NO_DISPLAY || egl.Initialize(egl.display, nullptr, nullptr) != EGL_TRUE)
      return no_gl("this machine's EGL cannot do without a display");
    return egl;
  }
};

Result<GlContext> GlContext::create() {
  static const Result<Egl> loaded = Egl::load();
  if (!loaded) return tl::unexpected(loaded.error());
  const Egl& egl = *loaded;
  GlContext made;
  made.egl_ = &egl;
  constexpr EGLint kVersion3[]{EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  if (egl.BindAPI(EGL_OPENGL_ES_API) == EGL_TRUE)
    made.context_ = egl.CreateContext(egl.display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, std::begin(kVersion3));
  if (made.context_ == EGL_NO_CONTEXT || egl.MakeCurrent(egl.display, EGL_NO_SURFACE, EGL_NO_SURFACE, made.context_) != EGL_TRUE)
    return no_gl(fmt::format("this machine's EGL has no OpenGL ES 3 (error {:#x})", unsigned(egl.GetError())));
  bool complete = true;
  const auto find = [&]<class Function>(Function& function, const char* name) {
    function = reinterpret_cast<Function>(egl.GetProcAddress(name));
    complete = complete && function != nullptr;
  };
#define INTERVALE_GL_FIND(name) find(made.gl_.name, "gl" #name);
  INTERVALE_GL_FUNCTIONS(INTERVALE_GL_FIND)
#undef INTERVALE_GL_FIND
  if (!complete) return no_gl("this machine's OpenGL ES is older than 3.0");
  return made;
}

GlContext::GlContext(GlContext&& other) noexcept : egl_(other.egl_), context_(std::exchange(other.context_, EGL_NO_CONTEXT)), gl_(other.gl_) {}

GlContext::~GlContext() {
  if (context_ == EGL_NO_CONTEXT) return;
  egl_->MakeCurrent(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  egl_->DestroyContext(egl_->display, context_);
  egl_->ReleaseThread();
}

}  // namespace intervale

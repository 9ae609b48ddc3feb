#include "common/program/lod_options.h"

#include <array>
#include <cmath>
#include <string>

namespace intervale {
namespace {

// The parser accepts "nan" and "inf", which are meaningless for these options.
double finite(double value, const char* option) {
  if (!std::isfinite(value)) throw CLI::ValidationError(option, "must be a finite number");
  return value;
}

void add_count(CLI::App& app, const std::string& name, std::optional<std::uint64_t>& count, const std::string& description) {
  app.add_option_function<std::uint64_t>(
         name, [&count](std::uint64_t value) { count = value; }, description)
      ->check(
          // The parser would wrap -1 around.
          [](const std::string& text) { return std::string(text.starts_with('-') ? "must be at least 0" : ""); })
      ->type_name("N")
      ->group("Level of detail");
}

// --eye, and the options that need it.
void add_camera_options(CLI::App& app, std::optional<Camera>& camera) {
  const auto add = [&]<class T>(const char* name, T Camera::*member, const char* type, const char* description) {
    const auto set = [&camera, member](const T& value) {
      if (!camera) camera.emplace();
      (*camera).*member = value;
    };
    return app.add_option_function<T>(name, set, description)->type_name(type)->group("View");
  };
  CLI::Option* eye = add("--eye", &Camera::eye, "X Y Z", "Camera position in world coordinates: refines what the camera sees");
  CLI::Option* at = add("--look-at", &Camera::look_at, "X Y Z", "World point at the centre of the picture")->needs(eye);
  eye->needs(at);
  add("--up", &Camera::up, "X Y Z", "Up direction of the camera (default 0 1 0)")->needs(eye);
  add("--fov", &Camera::fov, "DEGREES", "Vertical field of view (default 45)")->needs(eye);
  add("--viewport", &Camera::viewport, "W H", "Size of the picture in pixels (default 1920 1080)")->needs(eye);
  add("--pixel-error", &Camera::pixel_error, "PX", "Largest screen-space error of the surfaces (default 1)")->needs(eye);
}

Box box_of(const std::array<double, 6>& corners) {
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = finite(corners[axis], "--roi");
    box.max[axis] = finite(corners[axis + 3], "--roi");
    if (box.min[axis] > box.max[axis]) throw CLI::ValidationError("--roi", "X0 Y0 Z0 must not be greater than X1 Y1 Z1");
  }
  return box;
}

}  // namespace

void add_lod_options(CLI::App& app, Lod& lod) {
  const auto set_error = [&lod](double value) {
    if (finite(value, "--error") < 0) throw CLI::ValidationError("--error", "must be at least 0");
    lod.error = value;
  };
  const auto set_percent = [&lod](double value) {
    if (finite(value, "--error-percent") < 0 || value > 100) throw CLI::ValidationError("--error-percent", "must be 0 to 100");
    lod.error_percent = value;
  };
  CLI::Option* error = app.add_option_function<double>("--error", set_error, "Largest error, in field units; 0: every update (default)");
  CLI::Option* percent = app.add_option_function<double>("--error-percent", set_percent, "Largest error, in percent of the data set's max_error");
  error->type_name("E")->group("Level of detail");
  percent->type_name("P")->group("Level of detail")->excludes(error);
  app.add_option_function<std::array<double, 6>>(
         "--roi", [&lod](const std::array<double, 6>& corners) { lod.roi = box_of(corners); },
         "World box refined to the error; outside, the mesh is as coarse as a mesh without cracks allows")
      ->type_name("X0 Y0 Z0 X1 Y1 Z1")
      ->group("Level of detail");
  add_camera_options(app, lod.camera);
  add_count(app, "--max-tets", lod.max_tets, "Stop before the mesh has more tetrahedra; greatest errors first");
  add_count(app, "--max-updates", lod.max_updates, "Stop after this many updates; greatest errors first");
}

void add_max_bytes_option(CLI::App& app, std::optional<std::uint64_t>& max_bytes) {
  add_count(app, "--max-bytes", max_bytes, "Stop before more bytes are received; greatest errors first");
}

}  // namespace intervale

#include "common/program/lod_options.h"

#include <array>
#include <cmath>
#include <string>

namespace intervale {
namespace {

// The parser reads "nan" and "inf" as numbers, which no option here means anything by.
double finite(double value, const char* option) {
  if (!std::isfinite(value)) throw CLI::ValidationError(option, "a finite number is wanted");
  return value;
}

void add_count(CLI::App& app, const std::string& name, std::optional<std::uint64_t>& count, const std::string& description) {
  app.add_option_function<std::uint64_t>(
         name, [&count](std::uint64_t value) { count = value; }, description)
      ->check(
          [](const std::string& text) { return std::string(text.starts_with('-') ? "must be at least 0" : ""); })  // the parser would wrap -1 around
      ->type_name("N")
      ->group("Level of detail");
}

Box box_of(const std::array<double, 6>& corners) {
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = finite(corners[axis], "--roi");
    box.max[axis] = finite(corners[axis + 3], "--roi");
    if (box.min[axis] > box.max[axis]) throw CLI::ValidationError("--roi", "each of X0 Y0 Z0 must be at most the X1 Y1 Z1 that belongs to it");
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
  CLI::Option* error = app.add_option_function<double>("--error", set_error, "Largest error, in the field's units; 0: every update (default)");
  CLI::Option* percent = app.add_option_function<double>("--error-percent", set_percent, "The same, in percent of the data set's max_error");
  error->type_name("E")->group("Level of detail");
  percent->type_name("P")->group("Level of detail")->excludes(error);
  app.add_option_function<std::array<double, 6>>(
         "--roi", [&lod](const std::array<double, 6>& corners) { lod.roi = box_of(corners); },
         "World box refined to the error; elsewhere as coarse as conformity allows")
      ->type_name("X0 Y0 Z0 X1 Y1 Z1")
      ->group("Level of detail");
  add_count(app, "--max-tets", lod.max_tets, "Stop before the mesh has more tetrahedra, best first");
  add_count(app, "--max-updates", lod.max_updates, "Stop after this many updates, best first");
}

void add_max_bytes_option(CLI::App& app, std::optional<std::uint64_t>& max_bytes) {
  add_count(app, "--max-bytes", max_bytes, "Stop before more bytes are received, best first");
}

}  // namespace intervale

#include "server/volume/read_volume.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "server/volume/input_file.h"
#include "server/volume/nrrd.h"

namespace intervale {
namespace {

bool is_nrrd(const std::filesystem::path& path) {
  auto extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return extension == ".nrrd" || extension == ".nhdr";
}

std::string position_of(std::size_t index, const Grid& grid) {
  const auto x = static_cast<std::size_t>(grid.dims[0]), y = static_cast<std::size_t>(grid.dims[1]);
  return std::string("(") + std::to_string(index % x) + ", " + std::to_string(index / x % y) + ", " + std::to_string(index / x / y) + ")";
}

template <class Float>
Result<void> check_floats(std::span<Float> samples, std::optional<double> replacement, const Volume& volume) {
  const auto bad = [](Float value) { return !std::isfinite(value); };
  if (replacement) {
    const auto value = static_cast<Float>(*replacement);
    if (bad(value)) return misuse(std::string("--nan needs a number that is finite as ") + name_of(volume.type));
    std::replace_if(samples.begin(), samples.end(), bad, value);
    return {};
  }
  const auto first = std::find_if(samples.begin(), samples.end(), bad);
  if (first == samples.end()) return {};
  return fail(std::string("sample ") + position_of(static_cast<std::size_t>(first - samples.begin()) / volume.components, volume.grid) + " of '" +
              volume.name + "' is " + (std::isnan(*first) ? "NaN" : "infinite") + "; give such samples a value with --nan VALUE");
}

}  // namespace

Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout) {
  if (is_nrrd(path)) {
    if (layout) return misuse(in_quotes(path) + " describes itself: leave out --dims and --type, or rename the file if its samples are raw");
    return read_nrrd(path);
  }
  if (!layout) return misuse(in_quotes(path) + " is not .nrrd or .nhdr: say what its raw samples are with --dims X Y Z and --type TYPE");
  return read_raw(path, *layout);
}

Volume component_of(const Volume& volume, unsigned component) {
  Volume one{volume.name, volume.grid, volume.type, {}, volume.labels};
  if (volume.components == 1) {
    one.bytes = volume.bytes;
    return one;
  }
  const std::size_t width = size_of(volume.type), samples = volume.grid.sample_count();
  one.bytes.resize(samples * width);
  for (std::size_t i = 0; i < samples; ++i) {
    std::memcpy(&one.bytes[i * width], &volume.bytes[(i * volume.components + component) * width], width);
  }
  return one;
}

Result<void> check_finite(Volume& volume, std::optional<double> replacement) {
  auto* const data = volume.bytes.data();
  const auto count = volume.bytes.size() / size_of(volume.type);
  if (volume.type == SampleType::f32) return check_floats(std::span(reinterpret_cast<float*>(data), count), replacement, volume);
  if (volume.type == SampleType::f64) return check_floats(std::span(reinterpret_cast<double*>(data), count), replacement, volume);
  return {};
}

}  // namespace intervale

#include "server/readers/zarr_array.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "common/patch/visit_samples.h"
#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxMetadata = 16 << 20;
constexpr std::size_t kMostArrays = 1000;
constexpr std::uint64_t kGreatestRatio = 10'000;  // of compression: more is said than stored

// A file of metadata; null if there is none.
Result<Json> metadata_in(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::exists(path, none)) return Json();
  const auto text = InputFile::open(path).and_then([](const InputFile& file) { return read_start(file, kMaxMetadata); });
  if (!text) return tl::unexpected<Error>(text.error());
  Json json = Json::parse(*text, nullptr, false);
  if (json.is_discarded()) return fail(in_quotes(path) + " is no JSON");
  return json;
}

bool set_type(const std::string& text, ZarrArray& array) {
  constexpr std::array<std::string_view, 8> kTypes{"u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"};  // in SampleType's order
  if (text.size() != 3 || std::string_view("<>|").find(text[0]) == std::string_view::npos) return false;
  const auto found = std::find(kTypes.begin(), kTypes.end(), std::string_view(text).substr(1));
  if (found == kTypes.end()) return false;
  array.type = SampleType(found - kTypes.begin());
  array.big_endian = text[0] == '>';
  return true;
}

void set_fill(const Json& value, ZarrArray& array) {
  array.fill.assign(size_of(array.type), std::byte{});
  double number = value.is_number() ? value.get<double>() : 0;
  if (value == "NaN") number = std::numeric_limits<double>::quiet_NaN();
  if (value == "Infinity") number = std::numeric_limits<double>::infinity();
  if (value == "-Infinity") number = -std::numeric_limits<double>::infinity();
  const Volume shape{{}, {}, array.type, {}};
  visit_samples(shape, [&]<class T>(std::span<const T>) {
    const bool fits =
        std::is_floating_point_v<T> || (number >= double(std::numeric_limits<T>::lowest()) && number <= double(std::numeric_limits<T>::max()));
    const auto sample = fits ? T(number) : T(0);
    std::memcpy(array.fill.data(), &sample, sizeof sample);
  });
}

// What .zarray says. None: not an array of numbers with three to five axes.
Result<std::optional<ZarrArray>> array_in(const std::filesystem::path& folder, const std::string& name) {
  const auto json = metadata_in(folder / ".zarray");
  if (!json) return tl::unexpected<Error>(json.error());
  if (json->is_null()) return std::optional<ZarrArray>();
  const std::string where = in_quotes(folder / ".zarray");
  if (json->value("zarr_format", 0) != 2) return fail(where + ": version 2 of Zarr is read, and this is another one");
  ZarrArray array;
  array.name = name;
  array.folder = folder;
  array.shape = json->at("shape").get<std::vector<std::uint64_t>>();
  array.chunk = json->at("chunks").get<std::vector<std::uint64_t>>();
  if (array.shape.size() < 3 || array.shape.size() > 5 || !json->at("dtype").is_string() || !set_type(json->at("dtype").get<std::string>(), array))
    return std::optional<ZarrArray>();
  std::uint64_t bytes = size_of(array.type);
  if (array.chunk.size() != array.shape.size()) return fail(where + ": its chunks have other axes than it");
  for (const std::uint64_t side : array.chunk) {
    if (side == 0 || side > kMostChunk / bytes) return fail(where + ": its chunks are empty, or larger than 2 GiB");
    bytes *= side;
  }
  if (!json->value("filters", Json()).empty()) return fail(where + ": filters are not read; save it without them");
  const Json compressor = json->value("compressor", Json());
  if (!compressor.is_null()) array.codec = compressor.at("id").get<std::string>();
  if (!array.codec.empty() && array.codec != "blosc" && array.codec != "zstd" && array.codec != "zlib" && array.codec != "gzip")
    return fail(where + ": chunks compressed by '" + array.codec + "' are not read; blosc, zstd, zlib and gzip are");
  array.is_fortran = json->value("order", "C") == "F";
  array.separator = json->value("dimension_separator", ".") == "/" ? '/' : '.';
  set_fill(json->value("fill_value", Json()), array);
  constexpr std::array<ZarrAxis, 5> kAxes{ZarrAxis::time, ZarrAxis::channel, ZarrAxis::z, ZarrAxis::y, ZarrAxis::x};
  array.axes.assign(kAxes.end() - 3, kAxes.end());
  if (array.shape.size() == 4) array.axes.insert(array.axes.begin(), ZarrAxis::time);
  if (array.shape.size() == 5) array.axes.assign(kAxes.begin(), kAxes.end());
  array.scale.assign(array.axes.size(), 1);
  array.translation.assign(array.axes.size(), 0);
  return std::optional(std::move(array));
}

// What a list of transformations of OME-Zarr says, after what was said before.
void transform(const Json& list, ZarrArray& array) {
  if (!list.is_array()) return;
  for (const Json& one : list) {
    const std::string kind = one.value("type", "");
    const Json numbers = one.value(kind, Json());
    if ((kind != "scale" && kind != "translation") || !numbers.is_array() || numbers.size() != array.axes.size()) continue;
    for (std::size_t k = 0; k < array.axes.size(); ++k) {
      const double number = numbers[k].get<double>();
      if (kind == "translation") array.translation[k] += number;
      if (kind == "scale") array.scale[k] *= number, array.translation[k] *= number;
    }
  }
}

// Names the axes as `multiscales` does. False if they are not those of a volume.
bool set_axes(const Json& axes, ZarrArray& array) {
  if (!axes.is_array() || axes.size() != array.axes.size()) return false;
  std::vector<ZarrAxis> named;
  std::string unit;
  for (const Json& axis : axes) {
    const std::string name = axis.is_string() ? axis.get<std::string>() : axis.value("name", "");
    constexpr std::string_view kNames = "tczyx";
    const auto at = kNames.find(name);
    if (name.size() != 1 || at == std::string_view::npos || std::find(named.begin(), named.end(), ZarrAxis(at)) != named.end()) return false;
    named.push_back(ZarrAxis(at));
    if (at >= 2 && axis.is_object()) unit = axis.value("unit", "");
  }
  array.axes = named;
  const std::size_t z = array.axis(ZarrAxis::z), y = array.axis(ZarrAxis::y), x = array.axis(ZarrAxis::x);
  if (x >= named.size() || !(z < y && y < x)) return false;
  array.unit = unit == "micrometer" ? "\u00b5m" : unit == "millimeter" ? "mm" : unit == "nanometer" ? "nm" : unit;
  return true;
}

bool is_inside(const std::filesystem::path& relative) {
  return !relative.empty() && relative.is_relative() && std::find(relative.begin(), relative.end(), "..") == relative.end();
}

// The arrays of `multiscales`, fine ones first.
Result<std::vector<ZarrArray>> arrays_of_ome(const std::filesystem::path& root, const Json& multiscales) {
  std::vector<ZarrArray> arrays;
  for (const Json& one : multiscales) {
    for (const Json& dataset : one.at("datasets")) {
      const std::filesystem::path path = dataset.at("path").get<std::string>();
      if (!is_inside(path)) return fail(in_quotes(root) + " names an array outside itself");
      auto array = array_in(root / path, "/" + path.string());
      if (!array) return tl::unexpected<Error>(array.error());
      if (!*array) continue;
      if (one.contains("axes") && !set_axes(one["axes"], **array)) continue;
      transform(dataset.value("coordinateTransformations", Json()), **array);
      transform(one.value("coordinateTransformations", Json()), **array);
      arrays.push_back(std::move(**array));
      if (arrays.size() > kMostArrays) return fail(in_quotes(root) + " has too many arrays");
    }
  }
  return arrays;
}

Result<std::vector<ZarrArray>> all_arrays_in(const std::filesystem::path& root) {
  const auto attributes = metadata_in(root / ".zattrs");
  if (!attributes) return tl::unexpected<Error>(attributes.error());
  if (attributes->is_object() && attributes->contains("multiscales")) return arrays_of_ome(root, attributes->at("multiscales"));
  std::vector<std::filesystem::path> folders{root};
  std::error_code error;
  const auto end = std::filesystem::recursive_directory_iterator();
  for (auto entry = std::filesystem::recursive_directory_iterator(root, error); !error && entry != end; entry.increment(error)) {
    std::error_code none;
    if (!entry->is_directory(none)) continue;
    const bool is_array = std::filesystem::exists(entry->path() / ".zarray", none),
               is_group = std::filesystem::exists(entry->path() / ".zgroup", none);
    if (is_array) folders.push_back(entry->path());
    if (!is_group) entry.disable_recursion_pending();  // chunks
    if (folders.size() > kMostArrays) return fail(in_quotes(root) + " has too many arrays");
  }
  if (error) return fail(in_quotes(root) + ": " + error.message());
  std::sort(folders.begin(), folders.end());
  std::vector<ZarrArray> arrays;
  for (const auto& folder : folders) {
    auto array = array_in(folder, folder == root ? "/" : "/" + folder.lexically_relative(root).string());
    if (!array) return tl::unexpected<Error>(array.error());
    if (*array) arrays.push_back(std::move(**array));
  }
  return arrays;
}

// Each channel by itself.
std::vector<ZarrArray> channels_of(const std::vector<ZarrArray>& arrays) {
  std::vector<ZarrArray> all;
  for (const ZarrArray& array : arrays) {
    const std::uint64_t channels = std::min<std::uint64_t>(array.length(ZarrAxis::channel), kMostArrays);
    for (std::uint64_t c = 0; c < channels; ++c) {
      all.push_back(array);
      all.back().channel = c;
      if (channels > 1) all.back().name += ":" + std::to_string(c);
    }
  }
  return all;
}

// Bytes in the files of an array.
std::uint64_t stored_bytes(const ZarrArray& array) {
  std::uint64_t bytes = 0;
  std::error_code error;
  const auto end = std::filesystem::recursive_directory_iterator();
  for (auto entry = std::filesystem::recursive_directory_iterator(array.folder, error); !error && entry != end; entry.increment(error)) {
    std::error_code none;
    if (entry->is_regular_file(none)) bytes += entry->file_size(none);
  }
  return bytes;
}

}  // namespace

Result<std::vector<ZarrArray>> zarr_arrays_in(const std::filesystem::path& root) { return all_arrays_in(root).map(channels_of); }

Result<VolumeHeader> header_of(const ZarrArray& array, const std::string& where) {
  VolumeHeader header;
  header.parts_are = "arrays";
  header.type = array.type;
  header.time_points = array.length(ZarrAxis::time);
  const std::array<std::size_t, 3> xyz{array.axis(ZarrAxis::x), array.axis(ZarrAxis::y), array.axis(ZarrAxis::z)};
  Vec3 spacing, origin;
  std::array<std::int64_t, 3> dims{};
  for (std::size_t k = 0; k < 3; ++k) {
    dims[k] = std::int64_t(std::min<std::uint64_t>(array.shape[xyz[k]], INT64_MAX));
    spacing[k] = array.scale[xyz[k]];
    origin[k] = array.translation[xyz[k]];
  }
  const auto grid = make_grid(dims, Affine::of(spacing, origin), where);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (is_label(array.unit)) header.labels.unit = array.unit;
  if (auto size = check_size(header, where); !size) return tl::unexpected<Error>(size.error());
  if (const std::uint64_t stored = stored_bytes(array); header.data_bytes() / kGreatestRatio > stored)
    return fail(where + ": '" + array.name + "' has " + std::to_string(stored) + " bytes, which cannot be the " +
                std::to_string(header.data_bytes()) + " of its samples");
  return header;
}

// A chunk from its file's bytes. False if they are damaged.

}  // namespace intervale

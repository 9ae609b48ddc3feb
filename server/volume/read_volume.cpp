#include "server/volume/read_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/util/printable.h"
#include "server/volume/child_reader.h"
#include "server/volume/decoder.h"
#include "server/volume/header_bytes.h"
#include "server/volume/input_file.h"
#include "server/volume/library_formats.h"
#include "server/volume/metaimage_header.h"
#include "server/volume/mrc_header.h"
#include "server/volume/nifti_header.h"
#include "server/volume/npy_header.h"
#include "server/volume/nrrd_header.h"
#include "server/volume/volume_reader.h"
#include "server/volume/vti_header.h"
#include "server/volume/vtk_header.h"

namespace intervale {

const char* const kVolumeFormats = "NRRD, NIfTI, MetaImage, MRC, NumPy, VTK, TIFF, DICOM, HDF5 or Zarr";
namespace {

// A format of files that describe themselves.
struct FileFormat {
  std::array<std::string_view, 3> endings;  // of their names; empty: none
  bool (*begins)(std::string_view start);   // whether one may begin like this
  Result<VolumeHeader> (*read_header)(const InputFile& file);
};

bool is_nrrd(std::string_view start) { return start.starts_with("NRRD000"); }

constexpr unsigned kVectorComponents = 3;
constexpr std::size_t kStart = 1024;  // bytes, enough for all of these
constexpr std::array<FileFormat, 7> kFormats{{{{".nrrd", ".nhdr"}, is_nrrd, read_nrrd_header},
                                              {{".npy"}, is_npy, read_npy_header},
                                              {{".vtk"}, is_legacy_vtk, read_vtk_header},
                                              {{".vti"}, is_vti, read_vti_header},
                                              {{".nii", ".nii.gz", ".hdr"}, is_nifti, read_nifti_header},
                                              {{".mrc", ".map"}, is_mrc, read_mrc_header},
                                              {{".mha", ".mhd"}, is_metaimage, read_metaimage_header}}};

// Of a file that begins like this.
const FileFormat* find_format(std::string_view start) {
  const auto* const found = std::find_if(kFormats.begin(), kFormats.end(), [start](const FileFormat& format) { return format.begins(start); });
  return found == kFormats.end() ? nullptr : found;
}

// Of a file with this name.
const FileFormat* find_format_by_name(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  std::transform(name.begin(), name.end(), name.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  const auto has = [&name](std::string_view ending) { return !ending.empty() && name.ends_with(ending); };
  const auto* const found = std::find_if(kFormats.begin(), kFormats.end(),
                                         [&](const FileFormat& format) { return std::any_of(format.endings.begin(), format.endings.end(), has); });
  return found == kFormats.end() ? nullptr : found;
}

// What a file that is compressed as a whole begins with; nothing if it is not, or damaged.
std::string decoded_start(const InputFile& file) {
  std::string start(kStart, '\0');
  const auto got = decode({file}, 0, std::as_writable_bytes(std::span(start)));
  start.resize(got.value_or(0));
  return start;
}

// What `part` is the number of, from 0, as --part N or FILE:/N: a component of each sample, or else a time point.
Result<void> choose_part(VolumeHeader& header, const std::optional<std::string>& part, const std::string& where) {
  if (!part) return {};
  const std::uint64_t parts = header.components > 1 ? header.components : header.time_points;
  if (parts == 1) return misuse(where + " has one volume: leave out --part, or what follows ':'");
  const auto number = number_of<std::uint64_t>(std::string_view(*part).substr(part->starts_with('/') ? 1 : 0));
  if (!number || *number >= parts) return misuse(where + " has no part '" + printable(*part) + "': its parts are 0 to " + std::to_string(parts - 1));
  (header.components > 1 ? header.component : header.time_point) = *number;
  return {};
}

// first: of the samples that were read, in the file.
std::string position_of(std::size_t index, const Grid& grid, const std::array<std::int64_t, 3>& first) {
  const auto x = static_cast<std::size_t>(grid.dims[0]), y = static_cast<std::size_t>(grid.dims[1]);
  const std::array<std::size_t, 3> at{index % x, index / x % y, index / x / y};
  std::string text = "(";
  for (std::size_t axis = 0; axis < 3; ++axis) text += (axis == 0 ? "" : ", ") + std::to_string(std::int64_t(at[axis]) + first[axis]);
  return text + ")";
}

template <class Float>
Result<void> check_floats(std::span<Float> samples, std::optional<double> replacement, const Volume& volume, const std::array<std::int64_t, 3>& at) {
  const auto bad = [](Float value) { return !std::isfinite(value); };
  if (replacement) {
    const auto value = static_cast<Float>(*replacement);
    if (bad(value)) return misuse(std::string("--nan needs a number that is finite as ") + name_of(volume.type));
    std::replace_if(samples.begin(), samples.end(), bad, value);
    return {};
  }
  const auto first = std::find_if(samples.begin(), samples.end(), bad);
  if (first == samples.end()) return {};
  return fail(std::string("sample ") + position_of(static_cast<std::size_t>(first - samples.begin()) / volume.components, volume.grid, at) + " of '" +
              volume.name + "' is " + (std::isnan(*first) ? "NaN" : "infinite") + "; give such samples a value with --nan VALUE");
}

}  // namespace

NamedVolume named_volume(const std::string& text, const std::optional<std::string>& part) {
  std::error_code none;
  const auto colon = text.find(":/");
  if (colon == std::string::npos || colon == 0 || part || std::filesystem::exists(text, none)) return {text, part};
  return {text.substr(0, colon), text.substr(colon + 1)};
}

Result<std::optional<VolumeHeader>> read_volume_header(const std::filesystem::path& path, const std::optional<std::string>& part) {
  const auto program = find_reader_program(path);
  if (!program) return tl::unexpected<Error>(program.error());
  if (*program != nullptr) return read_header_by(**program, path, part).map([](VolumeHeader header) { return std::optional(std::move(header)); });
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  const auto start = read_start(*file, kStart);
  if (!start) return tl::unexpected<Error>(start.error());
  const bool is_gzip = start->starts_with("\x1f\x8b");
  const FileFormat* format = find_format(is_gzip ? decoded_start(*file) : *start);
  if (is_gzip && format != nullptr && format->begins != is_nifti)
    return fail(in_quotes(path) + " is compressed as a whole, which only NIfTI files may be: unpack it with gunzip first");
  if (format == nullptr) format = find_format_by_name(path);
  if (format == nullptr && part) return misuse(in_quotes(path) + " has one volume: leave out --part");
  if (format == nullptr) return std::optional<VolumeHeader>();
  auto header = format->read_header(*file);
  if (!header) return tl::unexpected<Error>(header.error());
  if (auto chosen = choose_part(*header, part, in_quotes(path)); !chosen) return tl::unexpected<Error>(chosen.error());
  return std::optional(std::move(*header));
}

Result<std::unique_ptr<VolumeReader>> open_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout,
                                                  std::optional<std::uint64_t> time_point, const std::optional<std::string>& part) {
  const auto program = find_reader_program(path);
  if (!layout && program && *program != nullptr) return open_by(**program, path, part, time_point);
  const auto header = read_volume_header(path, part);
  if (layout && header && !*header) {
    if (time_point.value_or(0) != 0) return misuse("raw samples have one time point: leave out --time-point, and --skip what is before them");
    return open_raw(path, *layout);
  }
  if (layout && (header || find_format_by_name(path) != nullptr))
    return misuse(in_quotes(path) + " describes itself: leave out --dims and --type, or rename the file if its samples are raw");
  if (!header) return tl::unexpected<Error>(header.error());
  if (!*header) return misuse(in_quotes(path) + " is not " + kVolumeFormats + ": say what its raw samples are with --dims X Y Z and --type TYPE");
  const VolumeHeader& found = **header;
  if (found.time_point) {
    if (time_point && time_point != found.time_point)
      return misuse(in_quotes(path) + ": --part and --time-point choose different time points: give one of them");
    time_point = found.time_point;
  }
  if (!found.component && found.components != 1 && found.components != kVectorComponents)
    return misuse(in_quotes(path) + " has " + std::to_string(found.components) + " numbers a sample: choose one, 0 to " +
                  std::to_string(found.components - 1) + ", with --part, of a channel with FILE:/N");
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return open_samples(*file, found, time_point);
}

std::string volume_name(const std::filesystem::path& path) {
  const auto whole = path.lexically_normal();
  return whole.has_filename() ? whole.stem().string() : whole.parent_path().filename().string();  // a folder's may end with '/'
}

Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout, std::optional<std::uint64_t> time_point,
                           const std::optional<std::string>& part, const std::optional<SampleBox>& crop) {
  const auto reader = open_volume(path, layout, time_point, part);
  if (!reader) return tl::unexpected<Error>(reader.error());
  auto volume = read_samples(**reader, crop);
  if (volume) volume->name = volume_name(path);
  return volume;
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

Result<void> check_finite(Volume& volume, std::optional<double> replacement, const std::array<std::int64_t, 3>& first) {
  auto* const data = volume.bytes.data();
  const auto count = volume.bytes.size() / size_of(volume.type);
  if (volume.type == SampleType::f32) return check_floats(std::span(reinterpret_cast<float*>(data), count), replacement, volume, first);
  if (volume.type == SampleType::f64) return check_floats(std::span(reinterpret_cast<double*>(data), count), replacement, volume, first);
  return {};
}

}  // namespace intervale

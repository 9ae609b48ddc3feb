#include "server/volume/mrc_header.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::size_t kMrcSize = 1024;  // bytes of the header
// Where its fields are.
constexpr std::size_t kDims = 0, kMode = 12, kFirstIndex = 16, kIntervals = 28, kCell = 40, kAngles = 52, kAxes = 64, kExtended = 92, kOrigin = 196,
                      kMap = 208, kStamp = 212;

// By the machine stamp; without one as its mode is a small number.
bool is_big_endian(std::string_view start) {
  if (start[kStamp] == '\0') return HeaderBytes(start, false).number<std::uint32_t>(kMode) > 0xffff;
  return start[kStamp] == '\x11';
}

std::optional<SampleType> mrc_type(std::int32_t mode) {
  switch (mode) {
    case 0:
      return SampleType::i8;
    case 1:
      return SampleType::i16;
    case 2:
      return SampleType::f32;
    case 6:
      return SampleType::u16;
    default:
      return {};
  }
}

std::array<std::int32_t, 3> three_integers(const HeaderBytes& bytes, std::size_t at) {
  return {bytes.number<std::int32_t>(at), bytes.number<std::int32_t>(at + 4), bytes.number<std::int32_t>(at + 8)};
}
Vec3 three_reals(const HeaderBytes& bytes, std::size_t at) {
  return {bytes.number<float>(at), bytes.number<float>(at + 4), bytes.number<float>(at + 8)};
}

// The steps from one sample to the next along the cell's axes a, b and c.
std::array<Vec3, 3> steps_of(const HeaderBytes& bytes) {
  const Vec3 cell = three_reals(bytes, kCell), angles = three_reals(bytes, kAngles);
  const auto intervals = three_integers(bytes, kIntervals);
  Vec3 step{1, 1, 1};
  for (std::size_t k = 0; k < 3; ++k) {
    if (intervals[k] > 0 && std::isfinite(cell[k]) && cell[k] > 0) step[k] = cell[k] / intervals[k];
  }
  const auto is_angle = [](double degrees) { return degrees > 0 && degrees < 180 && degrees != 90; };
  if (!is_angle(angles[0]) && !is_angle(angles[1]) && !is_angle(angles[2])) return {{{step[0], 0, 0}, {0, step[1], 0}, {0, 0, step[2]}}};
  const auto cosine = [](double degrees) { return degrees > 0 && degrees < 180 && degrees != 90 ? std::cos(degrees * std::numbers::pi / 180) : 0; };
  const double alpha = cosine(angles[0]), beta = cosine(angles[1]), gamma = cosine(angles[2]);
  const double sine = std::sqrt(1 - gamma * gamma), y = (alpha - beta * gamma) / sine;
  return {{{step[0], 0, 0}, {step[1] * gamma, step[1] * sine, 0}, {step[2] * beta, step[2] * y, step[2] * std::sqrt(1 - beta * beta - y * y)}}};
}

}  // namespace

bool is_mrc(std::string_view start) { return start.size() >= kMrcSize && start.substr(kMap, 4) == "MAP "; }

Result<VolumeHeader> read_mrc_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  const auto start = read_start(file, kMrcSize);
  if (!start) return tl::unexpected<Error>(start.error());
  if (!is_mrc(*start)) return fail(name + " is not an MRC file: it has no header of 1024 bytes with 'MAP '");
  VolumeHeader header;
  header.format = "MRC";
  header.big_endian = is_big_endian(*start);
  header.labels.unit = "Å";
  const HeaderBytes bytes(*start, header.big_endian);
  const auto mode = bytes.number<std::int32_t>(kMode);
  const auto type = mrc_type(mode);
  if (!type) return fail(name + ": MRC samples of mode " + std::to_string(mode) + " are not read; convert them to mode 2, floats");
  header.type = *type;

  const auto dims = three_integers(bytes, kDims), first = three_integers(bytes, kFirstIndex);
  auto axes = three_integers(bytes, kAxes);  // of the cell, 1 to 3: along which columns, rows and sections follow each other
  if (axes == std::array<std::int32_t, 3>{}) axes = {1, 2, 3};
  unsigned seen = 0;
  for (const std::int32_t axis : axes) seen |= axis >= 1 && axis <= 3 ? 1u << axis : 0;
  if (seen != 0b1110) return fail(name + ": the MRC header does not say which axis is which");
  const auto steps = steps_of(bytes);
  std::array<Vec3, 3> columns;
  Vec3 origin = three_reals(bytes, kOrigin);
  const bool has_origin = origin != Vec3{};
  for (std::size_t k = 0; k < 3; ++k) {
    columns[k] = steps[std::size_t(axes[k] - 1)];
    for (std::size_t at = 0; at < 3 && !has_origin; ++at) origin[at] += first[k] * columns[k][at];
  }
  const auto grid = make_grid({dims[0], dims[1], dims[2]}, Affine::of_columns(columns, origin), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  const auto extended = bytes.number<std::int32_t>(kExtended);
  if (extended < 0) return fail(name + ": the MRC header has an extension of " + std::to_string(extended) + " bytes");
  header.data_offset = kMrcSize + std::uint64_t(extended);
  return header;
}

}  // namespace intervale

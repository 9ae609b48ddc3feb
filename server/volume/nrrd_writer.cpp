#include <array>
#include <charconv>
#include <string>
#include <string_view>

#include "server/volume/nrrd.h"

namespace intervale {
namespace {

// In SampleType's order.
constexpr std::array<const char*, 8> kTypeNames{"uint8", "int8", "uint16", "int16", "uint32", "int32", "float", "double"};

std::string shortest(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

std::string in_brackets(const Vec3& v) { return "(" + shortest(v[0]) + "," + shortest(v[1]) + "," + shortest(v[2]) + ")"; }

std::string in_marks(std::string_view text) {
  std::string line = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') line += '\\';
    line += c;
  }
  return line + "\"";
}

// The line that says the world's axes, or only how many there are.
std::string space_line(std::string_view space) {
  if (space == "RAS") return "space: right-anterior-superior\n";
  if (space == "LAS") return "space: left-anterior-superior\n";
  if (space == "LPS") return "space: left-posterior-superior\n";
  return "space dimension: 3\n";
}

// `space directions` rather than `spacings`: a NRRD has an origin in space only together with them. NRRD0004 is the
// first with either.
std::string header(const Volume& volume) {
  const auto& [dims, affine] = volume.grid;
  std::string text = "NRRD0004\n# written by Intervale " INTERVALE_VERSION "\ntype: ";
  text.append(kTypeNames[std::size_t(volume.type)]).append("\ndimension: 3\n").append(space_line(volume.labels.space)).append("sizes:");
  for (const auto side : dims) text.append(" ").append(std::to_string(side));
  text += "\nspace directions:";
  for (std::size_t axis = 0; axis < 3; ++axis) text += " " + in_brackets(affine.column(axis));
  text += "\nspace origin: " + in_brackets(affine.origin()) + "\nkinds: domain domain domain\n";
  const auto& [unit, field, field_unit, space] = volume.labels;
  if (!unit.empty()) text += "space units: " + in_marks(unit) + " " + in_marks(unit) + " " + in_marks(unit) + "\n";
  if (!field.empty()) text += "content: " + field + "\n";
  if (!field_unit.empty()) text += "sample units: " + in_marks(field_unit) + "\n";
  if (size_of(volume.type) > 1) text += "endian: little\n";
  return text + "encoding: raw\n\n";
}

}  // namespace

Result<NrrdWriter> NrrdWriter::create(const std::filesystem::path& path, const Volume& volume) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  const auto text = header(volume);
  if (auto written = file->write(std::as_bytes(std::span(text))); !written) return tl::unexpected(written.error());
  return NrrdWriter(*std::move(file));
}

Result<void> write_nrrd(const std::filesystem::path& path, const Volume& volume) {
  auto file = NrrdWriter::create(path, volume);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(volume.bytes); !written) return written;
  return file->commit();
}

}  // namespace intervale

// teem parses the grammar of fields, their aliases and types, but is not safe with hostile input. It overflows buffers
// on long lines (its messages) and long words (its text reader), takes the header's file name for a printf format, and
// leaves gzip's checksum unread. So the header is cut out and screened here, teem parses what is left, from memory and
// without touching any file, and the data is read in file_samples.cpp.
#include "server/volume/nrrd_header.h"

#include <teem/biff.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string_view>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1 << 20;
constexpr std::size_t kMaxLine = 512;  // teem formats its messages, with the line in them, into 1 KiB by vsprintf
constexpr std::string_view kMagic = "NRRD000";

struct Screened {
  std::string text;  // the lines that are passed to teem
  std::optional<std::string> data_file;
  Labels labels;
  std::uint64_t end = 0;  // where the data begins, if attached
};

// A field's name without case and blanks: a superset of the spellings that teem takes for one field.
std::string canonical(std::string_view name) {
  std::string plain;
  for (const char c : name)
    if (c != ' ' && c != '\t') plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return plain;
}

// Fields that describe neither the position nor the type of the samples.
bool is_decoration(const std::string& field) {
  constexpr std::array<std::string_view, 12> kDecorations{"content", "number", "thicknesses", "labels",      "units",      "min",
                                                          "max",     "oldmin", "oldmax",      "sampleunits", "spaceunits", "measurementframe"};
  return std::find(kDecorations.begin(), kDecorations.end(), field) != kDecorations.end();
}

// The one text that all of a line's quoted texts are; empty if they differ or there is none.
std::string common_text(std::string_view line) {
  std::string first, text;
  bool is_quoted = false, is_first = true;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (is_quoted && line[i] == '\\' && i + 1 < line.size()) {
      text += line[++i];
    } else if (line[i] != '"') {
      if (is_quoted) text += line[i];
    } else if (is_quoted = !is_quoted; !is_quoted) {
      if (is_first) first = text;
      if (text != first) return {};
      is_first = false;
      text.clear();
    }
  }
  return first;
}

// Keeps what a line says about units or the field, if that is a label.
void take_label(const std::string& field, std::string_view value, Labels& labels) {
  if (field == "content" && is_label(value)) labels.field = value;
  if (field == "sampleunits") {
    const std::string text = value.starts_with('"') ? common_text(value) : std::string(value);
    if (is_label(text)) labels.field_unit = text;
  }
  if (field == "spaceunits") {
    const std::string text = common_text(value);
    if (is_label(text)) labels.unit = text;
  }
}

Result<Screened> screen(std::string_view file, const std::string& name) {
  Screened screened;
  bool blank_line = false, has_dimension = false;
  std::string kinds;  // passed last: teem leaks if they come before the dimension
  std::size_t position = 0;
  for (bool first = true; position < file.size(); first = false) {
    const auto end = std::min(file.find('\n', position), file.size());
    auto line = file.substr(position, end - position);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (first && !(line.size() == kMagic.size() + 1 && line.starts_with(kMagic) && line.back() >= '1' && line.back() <= '6'))
      return fail(name + " is not an NRRD file: it does not begin with NRRD0001 to NRRD0006");
    position = std::min(end + 1, file.size());
    if (line.empty()) {
      blank_line = true;
      break;
    }
    if (line.find('\0') != line.npos) return fail(name + ": zero bytes in the NRRD header; is it cut short or damaged?");
    const auto colon = line.find(": ");
    const auto field = canonical(line.substr(0, colon));
    const bool pair = line.find(":=") < colon;
    if (line.front() == '#' || pair) continue;
    if (colon != line.npos && is_decoration(field)) {
      take_label(field, trimmed(line.substr(colon + 1)), screened.labels);
      continue;
    }
    if (colon != line.npos && field == "datafile") {
      if (screened.data_file) return fail(name + ": two 'data file' lines in the NRRD header");
      screened.data_file = trimmed(line.substr(colon + 1));
      continue;
    }
    if (line.size() > kMaxLine) return fail(name + ": a line of the NRRD header is longer than " + std::to_string(kMaxLine) + " characters");
    has_dimension = has_dimension || field == "dimension";
    (field == "kinds" ? kinds : screened.text).append(line).append("\n");
  }
  if (!blank_line && !screened.data_file)
    return fail(name + ": the NRRD header " +
                (file.size() == kMaxHeaderBytes ? "is longer than 1 MiB" : "ends without a blank line before the data; is it cut short?"));
  if (has_dimension) screened.text += kinds;
  screened.end = position;
  return screened;
}

// The innermost of teem's messages, the most specific, without the name of teem's function.
std::string last_teem_error() {
  const std::unique_ptr<char, void (*)(void*)> all(biffGetDone(NRRD), std::free);
  if (!all) return "unknown error";
  std::string_view text = trimmed(all.get());
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  text = text.substr(text.rfind('\n') + 1);
  const auto colon = text.find(": ");
  if (colon != text.npos) text.remove_prefix(colon + 2);
  std::string line;
  for (const char c : text.substr(0, 200)) line += std::isprint(static_cast<unsigned char>(c)) ? c : '?';
  return line;
}

Result<SampleType> sample_type(int type, const std::string& name) {
  // In SampleType's order.
  constexpr std::array<int, 8> kTypes{nrrdTypeUChar, nrrdTypeChar, nrrdTypeUShort, nrrdTypeShort,
                                      nrrdTypeUInt,  nrrdTypeInt,  nrrdTypeFloat,  nrrdTypeDouble};
  const auto* const found = std::find(kTypes.begin(), kTypes.end(), type);
  if (found != kTypes.end()) return SampleType(found - kTypes.begin());
  if (type == nrrdTypeLLong || type == nrrdTypeULLong)
    return fail(name + ": 64-bit integers do not fit a double exactly; convert them first, e.g. unu convert -t double");
  return fail(name + ": samples of type 'block' are not numbers");
}

Result<Encoding> encoding_of(const NrrdEncoding* encoding, const std::string& name) {
  if (encoding == nrrdEncodingRaw) return Encoding::raw;
  if (encoding == nrrdEncodingGzip) return Encoding::deflate;
  if (encoding == nrrdEncodingBzip2) return Encoding::bzip2;
  if (encoding == nrrdEncodingAscii) return Encoding::text;
  return fail(name + ": NRRD encoding '" + encoding->name + "' is not read; convert it first, e.g. unu save -f nrrd -e gzip");
}

// Where samples lie on an axis: from the first one to the next, and the first one. `spacings`, which may be negative; or else
// `axis mins` and `axis maxs`, which are those of the samples, or of their cells if `centerings` says so.
struct AxisPlaces {
  double spacing = 1, first = 0;
};
AxisPlaces places_on(const NrrdAxisInfo& axis) {
  const auto is_usable = [](double value) { return std::isfinite(value) && value != 0; };
  AxisPlaces places;
  if (std::isfinite(axis.min)) places.first = axis.min;
  if (is_usable(axis.spacing)) {
    places.spacing = axis.spacing;
  } else if (std::isfinite(axis.min) && std::isfinite(axis.max)) {
    const bool is_cell = axis.center == nrrdCenterCell;
    const double steps = double(axis.size) - (is_cell ? 0 : 1), between = axis.max / steps - axis.min / steps;
    if (steps > 0 && is_usable(between)) {
      places.spacing = between;
      if (is_cell) places.first += between / 2;
    }
  }
  return places;
}

// `space directions` if there are any, or else along the axes. The axes of the world are the header's own.
// first_axis: the first one in space.
Result<Affine> affine_of(const Nrrd& nrrd, unsigned first_axis, const std::string& name) {
  Vec3 spacing{}, origin{};
  std::array<Vec3, 3> directions;
  int found = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto& info = nrrd.axis[first_axis + axis];
    found += nrrd.spaceDim > 0 && !std::isnan(info.spaceDirection[0]) ? 1 : 0;
    for (unsigned k = 0; k < 3; ++k) directions[axis][k] = info.spaceDirection[k];
    const AxisPlaces places = places_on(info);
    spacing[axis] = places.spacing;
    if (nrrd.spaceDim != 3)
      origin[axis] = places.first;
    else if (std::isfinite(nrrd.spaceOrigin[axis]))
      origin[axis] = nrrd.spaceOrigin[axis];
  }
  if (found == 0) return Affine::of(spacing, origin);
  if (nrrd.spaceDim != 3) return fail(name + ": 'space directions' in " + std::to_string(nrrd.spaceDim) + " dimensions; a volume has 3");
  if (found < 3) return fail(name + ": 'space directions' has directions for " + std::to_string(found) + " of 3 axes; a volume has all or none");
  return Affine::of_columns(directions, origin);
}

// Whether the first of four axes has the components of samples: it is said to, or has three and is not said to be one in
// space.
bool has_components(const Nrrd& nrrd) {
  const auto& first = nrrd.axis[0];
  const bool is_in_space = first.kind == nrrdKindDomain || first.kind == nrrdKindSpace || first.kind == nrrdKindTime || first.kind == nrrdKindPoint;
  const bool is_beside_space = nrrd.spaceDim == 3 && std::isnan(first.spaceDirection[0]) && !std::isnan(nrrd.axis[3].spaceDirection[0]);
  return nrrd.dim == 4 && !is_in_space && (first.size == 3 || first.kind >= nrrdKindList || is_beside_space);
}

// Whether the last of four axes has volumes, one after the other: it is not one in space.
bool has_time_points(const Nrrd& nrrd) {
  const auto& last = nrrd.axis[3];
  const bool is_in_space = last.kind == nrrdKindDomain || last.kind == nrrdKindSpace || (nrrd.spaceDim > 0 && !std::isnan(last.spaceDirection[0]));
  return nrrd.dim == 4 && last.kind <= nrrdKindList && !is_in_space;
}

const char* space_of(int space) {
  switch (space) {
    case nrrdSpaceRightAnteriorSuperior:
      return "RAS";
    case nrrdSpaceLeftAnteriorSuperior:
      return "LAS";
    case nrrdSpaceLeftPosteriorSuperior:
      return "LPS";
    default:
      return "";
  }
}

Result<VolumeHeader> judged(const Nrrd& nrrd, const NrrdIoState& state, const std::string& name) {
  VolumeHeader header;
  header.format = "NRRD";
  for (const int field : {nrrdField_type, nrrdField_dimension, nrrdField_sizes, nrrdField_encoding})
    if (!state.seen[field]) return fail(name + ": the NRRD header has no '" + airEnumStr(nrrdField, field) + "' line");
  const unsigned first_axis = has_components(nrrd) ? 1 : 0;
  if (first_axis == 1) {
    if (auto few = check_components(nrrd.axis[0].size, name); !few) return tl::unexpected<Error>(few.error());
    header.components = unsigned(nrrd.axis[0].size);
  }
  if (first_axis == 0 && has_time_points(nrrd)) {
    header.time_points = nrrd.axis[3].size;
  } else if (nrrd.dim != 3 + first_axis) {
    return fail(name + " has " + std::to_string(nrrd.dim) + (nrrd.dim == 1 ? " axis" : " axes") + "; a volume has 3");
  }
  std::array<std::int64_t, 3> dims{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto& info = nrrd.axis[first_axis + axis];
    if (info.kind >= nrrdKindList)
      return fail(name + ": axis " + std::to_string(first_axis + axis + 1) + " holds the parts of a '" + airEnumStr(nrrdKind, info.kind) +
                  "'; a volume has 3 axes in space and one number a sample");
    dims[axis] = static_cast<std::int64_t>(std::min<std::uint64_t>(info.size, INT64_MAX));
  }
  const auto type = sample_type(nrrd.type, name);
  if (!type) return tl::unexpected<Error>(type.error());
  const auto encoding = encoding_of(state.encoding, name);
  if (!encoding) return tl::unexpected<Error>(encoding.error());
  header.type = *type;
  header.encoding = *encoding;
  header.big_endian = state.encoding->endianMatters && state.endian == airEndianBig;
  header.line_skip = state.lineSkip;
  header.byte_skip = state.byteSkip;
  const auto affine = affine_of(nrrd, first_axis, name);
  if (!affine) return tl::unexpected<Error>(affine.error());
  const auto grid = make_grid(dims, *affine, name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  return header;
}

}  // namespace

Result<VolumeHeader> read_nrrd_header(const InputFile& file) {
  static std::mutex teem;
  const auto name = in_quotes(file.path());
  const auto bytes = read_start(file, kMaxHeaderBytes);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  const auto screened = screen(*bytes, name);
  if (!screened) return tl::unexpected<Error>(screened.error());

  const std::lock_guard one_at_a_time(teem);
  const std::unique_ptr<Nrrd, Nrrd* (*)(Nrrd*)> nrrd(nrrdNew(), nrrdNix);
  const std::unique_ptr<NrrdIoState, NrrdIoState* (*)(NrrdIoState*)> state(nrrdIoStateNew(), nrrdIoStateNix);
  if (!nrrd || !state) return fail("no memory left to read '" + name + "'");
  state->skipData = 1;  // or teem would allocate what the header claims
  if (nrrdStringRead(nrrd.get(), screened->text.c_str(), state.get()) != 0) return fail(name + ": bad NRRD header: " + last_teem_error());
  auto header = judged(*nrrd, *state, name);
  if (header) {
    header->data_file = screened->data_file;
    header->labels = screened->labels;
    const bool has_directions =
        std::any_of(nrrd->axis, nrrd->axis + nrrd->dim, [](const NrrdAxisInfo& axis) { return !std::isnan(axis.spaceDirection[0]); });
    if (nrrd->spaceDim > 0 && has_directions) header->labels.space = space_of(nrrd->space);
    header->data_offset = screened->data_file ? 0 : screened->end;
  }
  return header;
}

}  // namespace intervale

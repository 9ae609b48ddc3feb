#include "server/volume/metaimage_header.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

// The lines "Key = Value" up to that of ElementDataFile, by key in small letters.
struct KeyedLines {
  std::map<std::string, std::string> value;
  std::size_t end = 0;  // where an attached header's data begins

  [[nodiscard]] bool has(const std::string& key) const { return value.count(key) != 0; }
  // Of the first of these keys that is there; null if none is.
  [[nodiscard]] const std::string* find(std::initializer_list<const char*> keys) const {
    for (const char* key : keys) {
      if (const auto found = value.find(key); found != value.end()) return &found->second;
    }
    return nullptr;
  }
};

// What a line should have: so many numbers, or a truth value. Set to `instead` where there is no such line; false if it
// has something else.
template <class T, std::size_t N>
bool take(const std::string* line, std::array<T, N>& numbers, const std::array<T, N>& instead) {
  const auto found = line == nullptr ? std::optional(instead) : numbers_of<T, N>(words_of(*line));
  if (found) numbers = *found;
  return found.has_value();
}
bool take(const std::string* line, bool& value, bool instead) {
  const std::string word = line == nullptr ? (instead ? "true" : "false") : lower(*line);
  const auto is_one_of = [&word](std::initializer_list<const char*> words) { return std::find(words.begin(), words.end(), word) != words.end(); };
  value = is_one_of({"true", "t", "yes", "y", "1"});
  return value || is_one_of({"false", "f", "no", "n", "0"});
}

constexpr const char* kLastKey = "elementdatafile";

KeyedLines keyed_lines_of(std::string_view text) {
  KeyedLines lines;
  for (std::size_t at = 0; at < text.size() && !lines.has(kLastKey);) {
    const auto end = std::min(text.find('\n', at), text.size());
    const std::string_view line = text.substr(at, end - at);
    const auto mark = line.find_first_of("=:");
    if (mark == line.npos && !trimmed(line).empty()) break;
    if (mark != line.npos) lines.value.emplace(lower(trimmed(line.substr(0, mark))), trimmed(line.substr(mark + 1)));
    at = lines.end = std::min(end + 1, text.size());
  }
  return lines;
}

std::optional<SampleType> metaimage_type(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, SampleType>, 10> kTypes{{{"MET_UCHAR", SampleType::u8},
                                                                            {"MET_CHAR", SampleType::i8},
                                                                            {"MET_USHORT", SampleType::u16},
                                                                            {"MET_SHORT", SampleType::i16},
                                                                            {"MET_UINT", SampleType::u32},
                                                                            {"MET_INT", SampleType::i32},
                                                                            {"MET_ULONG", SampleType::u32},
                                                                            {"MET_LONG", SampleType::i32},
                                                                            {"MET_FLOAT", SampleType::f32},
                                                                            {"MET_DOUBLE", SampleType::f64}}};
  const auto* const found = std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& type) { return name == type.first; });
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

// Of as many dimensions as N; what a fourth one says of distance, position and direction is left out.
template <std::size_t N>
Result<Affine> metaimage_affine(const KeyedLines& lines, const std::string& name) {
  std::array<double, N> spacing{}, offset{}, ones{};
  std::array<double, N * N> matrix{}, identity{};
  ones.fill(1);
  for (std::size_t k = 0; k < N; ++k) identity[k * (N + 1)] = 1;
  if (!take(lines.find({"elementspacing", "elementsize"}), spacing, ones) || !take(lines.find({"offset", "position", "origin"}), offset, {}) ||
      !take(lines.find({"transformmatrix", "rotation", "orientation"}), matrix, identity))
    return fail(name + ": bad MetaImage header: ElementSpacing, Offset or TransformMatrix has other than its " + std::to_string(N) + " or " +
                std::to_string(N * N) + " numbers");
  std::array<Vec3, 3> columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) columns[axis][k] = spacing[axis] * matrix[axis * N + k];
  }
  return Affine::of_columns(columns, {offset[0], offset[1], offset[2]});
}

}  // namespace

bool is_metaimage(std::string_view start) {
  const KeyedLines lines = keyed_lines_of(start.substr(0, 512));
  return lines.has("objecttype") ? lower(lines.value.at("objecttype")) == "image" : lines.has("ndims") && lines.has("dimsize");
}

Result<VolumeHeader> read_metaimage_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  const auto start = read_start(file, kMaxTextHeader);
  if (!start) return tl::unexpected<Error>(start.error());
  const KeyedLines lines = keyed_lines_of(*start);
  const auto unusable = [&name](const char* key) { return fail(name + ": the MetaImage header has no usable " + key + " line"); };
  VolumeHeader header;
  header.format = "MetaImage";
  const std::string* const dims_line = lines.find({"dimsize"});
  const std::vector<std::string_view> sides = dims_line == nullptr ? std::vector<std::string_view>() : words_of(*dims_line);
  std::array<std::int64_t, 1> ndims{}, channels{}, skip{};
  if (!take(lines.find({"ndims"}), ndims, {0}) || sides.empty() || std::int64_t(sides.size()) != ndims[0]) return unusable("NDims or DimSize");
  if (sides.size() < 3 || sides.size() > 4)
    return fail(name + " has " + std::to_string(sides.size()) + (sides.size() == 1 ? " axis" : " axes") + "; a volume has 3");
  const auto dims = numbers_of<std::int64_t, 3>(std::span(sides).first(3));
  const auto time_points = sides.size() == 4 ? number_of<std::uint64_t>(sides[3]) : std::optional<std::uint64_t>(1);
  if (!dims || !time_points) return unusable("DimSize");
  header.time_points = *time_points;
  if (!lines.has(kLastKey)) return unusable("ElementDataFile");
  const auto type = lines.has("elementtype") ? metaimage_type(lines.value.at("elementtype")) : std::nullopt;
  if (!type) return unusable("ElementType, of integers of 8 to 32 bits or floats,");
  header.type = *type;
  if (!take(lines.find({"elementnumberofchannels"}), channels, {1}) || channels[0] < 0) return unusable("ElementNumberOfChannels");
  if (auto few = check_components(std::uint64_t(channels[0]), name); !few) return tl::unexpected<Error>(few.error());
  header.components = unsigned(channels[0]);
  const auto affine = sides.size() == 3 ? metaimage_affine<3>(lines, name) : metaimage_affine<4>(lines, name);
  if (!affine) return tl::unexpected<Error>(affine.error());
  const auto grid = make_grid(*dims, *affine, name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  if (lines.has("anatomicalorientation") && lines.value.at("anatomicalorientation").find('?') == std::string::npos) header.labels.space = "LPS";
  bool is_binary = true, is_compressed = false, data_msb = false, element_msb = false;
  if (!take(lines.find({"binarydata"}), is_binary, true) || !take(lines.find({"compresseddata"}), is_compressed, false))
    return unusable("BinaryData or CompressedData");
  if (!is_binary) return fail(name + ": MetaImage data as text is not read; write it with BinaryData = True");
  if (is_compressed) header.encoding = Encoding::deflate;
  const std::string *const data_order = lines.find({"binarydatabyteordermsb"}), *const element_order = lines.find({"elementbyteordermsb"});
  if (!take(data_order, data_msb, false) || !take(element_order, element_msb, data_msb) || (data_order != nullptr && data_msb != element_msb))
    return unusable("BinaryDataByteOrderMSB or ElementByteOrderMSB");
  header.big_endian = element_msb;
  if (!take(lines.find({"headersize"}), skip, {0}) || skip[0] < -1) return unusable("HeaderSize");
  header.byte_skip = skip[0];
  if (const std::string& data = lines.value.at(kLastKey); lower(data) == "local") {
    header.data_offset = lines.end;
  } else {
    header.data_file = data;
  }
  return header;
}

}  // namespace intervale

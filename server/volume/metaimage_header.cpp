#include "server/volume/metaimage_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <map>
#include <string>
#include <vector>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

std::string lower(std::string_view text) {
  std::string plain(text);
  std::transform(plain.begin(), plain.end(), plain.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return plain;
}

// The numbers of a line, or none if something else is among them.
std::vector<double> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const auto end = std::min(text.find_first_of(" \t"), text.size());
    double number = 0;
    const auto [last, error] = std::from_chars(text.data(), text.data() + end, number);
    if (error != std::errc() || last != text.data() + end || numbers.size() == 32) return {};
    numbers.push_back(number);
    text.remove_prefix(end);
  }
  return numbers;
}

// The lines "Key = Value" up to that of ElementDataFile, by key in small letters.
struct KeyedLines {
  std::map<std::string, std::string> value;
  std::size_t end = 0;  // where an attached header's data begins

  [[nodiscard]] bool is_true(const std::string& key) const { return has(key) && lower(value.at(key)).starts_with('t'); }
  [[nodiscard]] bool has(const std::string& key) const { return value.count(key) != 0; }
  // The numbers of the first of these keys that is there.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys) const {
    for (const char* key : keys) {
      if (has(key)) return numbers_of(value.at(key));
    }
    return {};
  }
};

constexpr const char* kLastKey = "elementdatafile";

KeyedLines keyed_lines_of(std::string_view text) {
  KeyedLines lines;
  for (std::size_t at = 0; at < text.size() && !lines.has(kLastKey);) {
    const auto end = std::min(text.find('\n', at), text.size());
    const std::string_view line = text.substr(at, end - at);
    const auto equals = line.find('=');
    if (equals == line.npos) break;
    lines.value.emplace(lower(trimmed(line.substr(0, equals))), trimmed(line.substr(equals + 1)));
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
  const auto* const found = std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& type) { return name.starts_with(type.first); });
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

// A fourth dimension's distance, position and directions are left out.
Result<Affine> metaimage_affine(const KeyedLines& lines, std::size_t dimensions, const std::string& name) {
  auto spacing = lines.numbers({"elementspacing", "elementsize"}), offset = lines.numbers({"offset", "position", "origin"});
  auto matrix = lines.numbers({"transformmatrix", "rotation", "orientation"});
  spacing.resize(3, 1);
  offset.resize(3, 0);
  if (matrix.empty()) return Affine::of({spacing[0], spacing[1], spacing[2]}, {offset[0], offset[1], offset[2]});
  if (matrix.size() != dimensions * dimensions)
    return fail(name + ": TransformMatrix has " + std::to_string(matrix.size()) + " numbers, not " + std::to_string(dimensions * dimensions));
  std::array<Vec3, 3> columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) columns[axis][k] = spacing[axis] * matrix[axis * dimensions + k];
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
  const auto missing = [&name](const char* key) { return fail(name + ": the MetaImage header has no usable " + key + " line"); };
  VolumeHeader header;
  header.format = "MetaImage";
  const auto dims = lines.numbers({"dimsize"});
  const auto ndims = lines.numbers({"ndims"});
  if (ndims.size() != 1 || dims.empty() || double(dims.size()) != ndims[0]) return missing("NDims or DimSize");
  if (dims.size() < 3 || dims.size() > 4)
    return fail(name + " has " + std::to_string(dims.size()) + (dims.size() == 1 ? " axis" : " axes") + "; a volume has 3");
  const auto count = [&dims](std::size_t axis) { return dims[axis] >= 0 && dims[axis] < 0x1p53 ? std::int64_t(dims[axis]) : 0; };
  if (dims.size() == 4) header.time_points = std::uint64_t(count(3));
  if (!lines.has(kLastKey)) return missing("ElementDataFile");
  const auto type = lines.has("elementtype") ? metaimage_type(lines.value.at("elementtype")) : std::nullopt;
  if (!type) return missing("ElementType, of integers of 8 to 32 bits or floats,");
  header.type = *type;
  if (const auto channels = lines.numbers({"elementnumberofchannels"}); !channels.empty() && channels[0] != 1) {
    if (channels[0] != 3) return fail(name + " has " + lines.value.at("elementnumberofchannels") + " numbers a sample; 1 and 3 are read");
    header.components = 3;
  }
  const auto affine = metaimage_affine(lines, dims.size(), name);
  if (!affine) return tl::unexpected<Error>(affine.error());
  const auto grid = make_grid({count(0), count(1), count(2)}, *affine, name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  if (lines.has("anatomicalorientation") && lines.value.at("anatomicalorientation").find('?') == std::string::npos) header.space = "LPS";
  if (lines.has("binarydata") && !lines.is_true("binarydata"))
    return fail(name + ": MetaImage data as text is not read; write it with BinaryData = True");
  header.big_endian = lines.is_true("binarydatabyteordermsb") || lines.is_true("elementbyteordermsb");
  if (lines.is_true("compresseddata")) header.encoding = Encoding::deflate;
  if (const auto skip = lines.numbers({"headersize"}); !skip.empty()) {
    if (!(skip[0] >= -1 && skip[0] < 0x1p53)) return missing("HeaderSize");
    header.byte_skip = std::int64_t(skip[0]);
  }
  if (const std::string& data = lines.value.at(kLastKey); lower(data) == "local") {
    header.data_offset = lines.end;
  } else {
    header.data_file = data;
  }
  return header;
}

}  // namespace intervale

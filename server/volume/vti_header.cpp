// pugixml keeps the elements that it has read where the text ends or becomes binary. What is not there is told about
// by name, so that its own errors are not needed.
#include "server/volume/vti_header.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "server/volume/decoder.h"
#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::size_t kMaxXml = 1 << 20;  // bytes
constexpr const char* kCompressor = "vtkZLibDataCompressor";

std::optional<SampleType> vti_type(std::string_view name) {
  constexpr std::array<std::string_view, 8> kTypes{"UInt8", "Int8", "UInt16", "Int16", "UInt32", "Int32", "Float32", "Float64"};
  const auto* const found = std::find(kTypes.begin(), kTypes.end(), name);  // in SampleType's order
  return found == kTypes.end() ? std::nullopt : std::optional(SampleType(found - kTypes.begin()));
}

// As many numbers as an attribute should have, or what there is instead if it is missing; else nothing.
template <class T, std::size_t N>
std::optional<std::array<T, N>> numbers_in(const pugi::xml_attribute& attribute, const std::array<T, N>& instead) {
  return attribute ? numbers_of<T, N>(words_of(attribute.value())) : instead;
}

// Which of the words an attribute is, the first if it is missing; else nothing.
std::optional<std::size_t> word_in(const pugi::xml_attribute& attribute, std::initializer_list<std::string_view> words) {
  const auto* const found = attribute ? std::find(words.begin(), words.end(), attribute.value()) : words.begin();
  return found == words.end() ? std::nullopt : std::optional(std::size_t(found - words.begin()));
}

struct Extent {
  std::array<std::int64_t, 3> dims{}, first{};
  friend bool operator==(const Extent&, const Extent&) = default;
};

std::optional<Extent> extent_of(const pugi::xml_attribute& attribute) {
  const auto numbers = numbers_in<std::int32_t, 6>(attribute, {0, -1, 0, -1, 0, -1});
  if (!numbers) return {};
  Extent extent;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent.first[axis] = (*numbers)[2 * axis];
    extent.dims[axis] = std::int64_t((*numbers)[2 * axis + 1]) - extent.first[axis] + 1;
  }
  return extent;
}

// Sample (0, 0, 0) is the extent's first one. Direction has the axes' directions as columns.
std::optional<Affine> vti_affine(const pugi::xml_node& image, const Extent& extent) {
  const auto origin = numbers_in<double, 3>(image.attribute("Origin"), {0, 0, 0});
  const auto spacing = numbers_in<double, 3>(image.attribute("Spacing"), {1, 1, 1});
  const auto direction = numbers_in<double, 9>(image.attribute("Direction"), {1, 0, 0, 0, 1, 0, 0, 0, 1});
  if (!origin || !spacing || !direction) return {};
  std::array<Vec3, 3> columns;
  Vec3 first = *origin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) {
      columns[axis][k] = (*spacing)[axis] * (*direction)[3 * k + axis];
      first[k] += double(extent.first[axis]) * columns[axis][k];
    }
  }
  return Affine::of_columns(columns, first);
}

// The active scalars; without any the first array.
pugi::xml_node find_array(const pugi::xml_node& data) {
  const pugi::xml_attribute scalars = data.attribute("Scalars");
  return scalars && *scalars.value() != '\0' ? data.find_child_by_attribute("DataArray", "Name", scalars.value()) : data.child("DataArray");
}

// Where an element's content begins in the text: behind the first '>' outside quotes. Its size if there is none.
std::size_t content_of(std::string_view text, const pugi::xml_node& node) {
  char quote = '\0';
  for (std::size_t at = node.offset_debug() < 0 ? text.size() : std::size_t(node.offset_debug()); at < text.size(); ++at) {
    const char c = text[at];
    if (quote == '\0' && c == '>') return at + 1;
    if (c == quote) {
      quote = '\0';
    } else if (quote == '\0' && (c == '"' || c == '\'')) {
      quote = c;
    }
  }
  return text.size();
}

// The first numbers of the data, of 4 or 8 bytes each.
Result<std::vector<std::uint64_t>> read_counts(const InputFile& file, const VolumeHeader& header, std::uint64_t count, std::size_t width) {
  const auto cut_short = [&file] { return fail(in_quotes(file.path()) + ": the data of the VTK file ends too early; is it cut short?"); };
  if (count > file.size() / width) return cut_short();
  std::string bytes(count * width, '\0');
  const std::span<std::byte> out = std::as_writable_bytes(std::span(bytes));
  const auto got = header.base64_skip ? decode({file, Encoding::raw, header.data_offset, 0}, 0, out)
                                      : file.read_some(header.data_offset, out).map([](std::size_t some) { return std::uint64_t(some); });
  if (!got) return tl::unexpected<Error>(got.error());
  if (*got < bytes.size()) return cut_short();
  const HeaderBytes numbers(bytes, header.big_endian);
  std::vector<std::uint64_t> counts(count);
  for (std::size_t i = 0; i < count; ++i)
    counts[i] = width == 4 ? std::uint64_t(numbers.number<std::uint32_t>(4 * i)) : numbers.number<std::uint64_t>(8 * i);
  return counts;
}

// Sets where the data is: behind the counts that precede it. Those are for plain data its bytes; for compressed data the
// number of blocks, the bytes of a block and of the last one if that is shorter, and the compressed bytes of each.
Result<void> skip_counts(const InputFile& file, std::size_t width, VolumeHeader& header) {
  const bool is_compressed = header.encoding == Encoding::deflate;
  const std::uint64_t expected = header.data_bytes();
  auto counts = read_counts(file, header, is_compressed ? 3 : 1, width);
  if (!counts) return tl::unexpected<Error>(counts.error());
  std::uint64_t bytes = counts->front();
  if (is_compressed) {
    const std::uint64_t blocks = (*counts)[0], size = (*counts)[1], last = (*counts)[2];
    const bool is_possible = blocks >= 1 && blocks <= expected && size >= 1 && size <= expected && last < size;
    bytes = is_possible ? (blocks - (last == 0 ? 0 : 1)) * size + last : 0;
    if (!is_possible || blocks - 1 > expected / size) bytes = 0;
  }
  if (bytes != expected)
    return fail(in_quotes(file.path()) + ": bad VTK file: the array needs " + std::to_string(expected) + " bytes, and its data has other counts");
  header.coded_bytes = bytes;
  if (is_compressed) {
    counts = read_counts(file, header, 3 + counts->front(), width);
    if (!counts) return tl::unexpected<Error>(counts.error());
    header.coded_bytes = 0;
    for (std::size_t i = 3; i < counts->size(); ++i) header.coded_bytes += std::min((*counts)[i], file.size());
  }
  if (header.base64_skip) {
    header.base64_skip = counts->size() * width;
  } else {
    header.data_offset += counts->size() * width;
  }
  return {};
}

}  // namespace

bool is_vti(std::string_view start) {
  if (start.find("<VTKFile") == start.npos) return false;
  pugi::xml_document document;
  document.load_buffer(start.data(), start.size(), pugi::parse_default, pugi::encoding_utf8);
  return std::string_view(document.child("VTKFile").attribute("type").value()) == "ImageData";
}

Result<VolumeHeader> read_vti_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  const auto bad = [&name](const std::string& what) { return fail(name + ": bad VTK file: " + what); };
  const auto start = read_start(file, kMaxXml);
  if (!start) return tl::unexpected<Error>(start.error());
  if (!is_vti(*start)) return fail(name + " is not a VTK file of ImageData: it has no VTKFile element of this type");
  pugi::xml_document document;
  document.load_buffer(start->data(), start->size(), pugi::parse_default, pugi::encoding_utf8);
  const pugi::xml_node root = document.child("VTKFile"), image = root.child("ImageData"), piece = image.child("Piece");
  const pugi::xml_node array = find_array(piece.child("PointData"));
  if (!array) return bad("it has no array of point data, or not the active scalars, in its first MiB");
  if (piece.next_sibling("Piece")) return fail(name + " has several pieces; write it as one");

  VolumeHeader header;
  header.format = "VTK ImageData";
  const auto order = word_in(root.attribute("byte_order"), {"LittleEndian", "BigEndian"});
  const auto width = word_in(root.attribute("header_type"), {"UInt32", "UInt64"});
  if (!order || !width) return bad("byte_order or header_type is not known");
  header.big_endian = *order == 1;
  if (image.attribute("NumberOfTimeSteps").as_uint(1) > 1 || array.attribute("TimeStep"))
    return fail(name + " has time steps; write one of them alone");
  const auto whole = extent_of(image.attribute("WholeExtent")), extent = extent_of(piece.attribute("Extent"));
  if (!whole || !extent || *whole != *extent) return bad("the extent of its piece is not the whole extent");
  const auto affine = vti_affine(image, *extent);
  if (!affine) return bad("Origin, Spacing or Direction are not numbers");
  const auto grid = make_grid(extent->dims, *affine, name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  const auto type = vti_type(array.attribute("type").value());
  if (!type) return fail(name + ": VTK samples of another type than Int8 to Int32, UInt8 to UInt32, Float32 and Float64 are not read");
  header.type = *type;
  const auto components = numbers_in<unsigned, 1>(array.attribute("NumberOfComponents"), {1});
  if (!components) return fail(name + ": NumberOfComponents is no number");
  if (auto few = check_components(components->front(), name); !few) return tl::unexpected<Error>(few.error());
  header.components = components->front();
  const auto tuples = numbers_in<std::uint64_t, 1>(array.attribute("NumberOfTuples"), {grid->sample_count()});
  if (!tuples || tuples->front() != grid->sample_count()) return bad("its array has not as many tuples as the grid has points");
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  if (const std::string_view field = array.attribute("Name").value(); is_label(field)) header.labels.field = field;

  const std::string_view format = array.attribute("format").value();
  header.data_offset = content_of(*start, array);
  if (format == "ascii") {
    header.encoding = Encoding::text;
    header.big_endian = false;
    return header;
  }
  if (format == "appended") {
    const pugi::xml_node appended = root.child("AppendedData");
    const auto mark = start->find('_', content_of(*start, appended));
    if (!appended || mark == start->npos) return bad("its data is not in its first MiB");
    const auto offset = number_of<std::uint64_t>(array.attribute("offset").value());
    const auto encoding = word_in(appended.attribute("encoding"), {"base64", "raw"});
    if (!offset || *offset > INT64_MAX || !encoding) return bad("the offset of its array, or the encoding of AppendedData, is not known");
    header.data_offset = mark + 1 + *offset;
    if (*encoding == 0) header.base64_skip = 0;
  } else if (format == "binary") {
    header.base64_skip = 0;
  } else {
    return bad("the format of its array is not ascii, binary or appended");
  }
  const std::string_view compressor = root.attribute("compressor").value();
  if (!compressor.empty() && compressor != kCompressor) return fail(name + " is compressed by other than zlib; write it with vtkZLibDataCompressor");
  if (!compressor.empty()) header.encoding = Encoding::deflate;
  if (auto skipped = skip_counts(file, *width == 1 ? 8 : 4, header); !skipped) return tl::unexpected<Error>(skipped.error());
  return header;
}

}  // namespace intervale

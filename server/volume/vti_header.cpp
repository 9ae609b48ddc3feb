// pugixml keeps the elements that it has read where the text ends or becomes binary. What is not there is told about
// by name, so that its own errors are not needed.
#include "server/volume/vti_header.h"

#include <algorithm>
#include <array>
#include <charconv>
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

// Exactly as many numbers as an attribute should have, or what there is instead if it is missing; else nothing.
template <class T, std::size_t N>
std::optional<std::array<T, N>> numbers_in(const pugi::xml_attribute& attribute, const std::array<T, N>& instead) {
  if (!attribute) return instead;
  std::array<T, N> numbers{};
  std::string_view text = trimmed(attribute.value());
  for (T& number : numbers) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return {};
    text = trimmed(text.substr(std::size_t(end - text.data())));
  }
  return text.empty() ? std::optional(numbers) : std::nullopt;
}

struct Extent {
  std::array<std::int64_t, 3> dims{}, first{};
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
  return scalars ? data.find_child_by_attribute("DataArray", "Name", scalars.value()) : data.child("DataArray");
}

// Where an element's content begins in the text; its size if that is not to be found. No quoted attribute of a file that
// VTK writes has a '>'.
std::size_t content_of(std::string_view text, const pugi::xml_node& node) {
  const auto begin = node.offset_debug();
  const auto end = begin < 0 ? text.npos : text.find('>', std::size_t(begin));
  return end == text.npos ? text.size() : end + 1;
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
  auto counts = read_counts(file, header, 1, width);
  if (counts && header.encoding == Encoding::deflate) {
    const std::uint64_t blocks = counts->front();
    if (blocks == 0 || blocks > file.size()) return fail(in_quotes(file.path()) + ": bad VTK file: the number of compressed blocks is wrong");
    counts = read_counts(file, header, 3 + blocks, width);
  }
  if (!counts) return tl::unexpected<Error>(counts.error());
  header.coded_bytes = counts->front();
  if (header.encoding == Encoding::deflate) {
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
  const auto tag = start.find("<VTKFile");
  if (tag == start.npos) return false;
  const std::string_view attributes = start.substr(tag, start.find('>', tag) - tag);
  return attributes.find("type=\"ImageData\"") != attributes.npos;
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
  header.big_endian = std::string_view(root.attribute("byte_order").value()) == "BigEndian";
  const auto whole = extent_of(image.attribute("WholeExtent")), extent = extent_of(piece.attribute("Extent"));
  if (!whole || !extent || whole->dims != extent->dims) return bad("the extent of its piece is not the whole extent");
  const auto affine = vti_affine(image, *extent);
  if (!affine) return bad("Origin, Spacing or Direction are not numbers");
  const auto grid = make_grid(extent->dims, *affine, name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  const auto type = vti_type(array.attribute("type").value());
  if (!type) return fail(name + ": VTK samples of another type than Int8 to Int32, UInt8 to UInt32, Float32 and Float64 are not read");
  header.type = *type;
  header.components = array.attribute("NumberOfComponents").as_uint(1);
  if (header.components != 1 && header.components != 3)
    return fail(name + ": its array has " + std::to_string(header.components) + " components; 1 or 3 are read");
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
    const std::uint64_t offset = array.attribute("offset").as_ullong();
    if (offset > INT64_MAX) return bad("its data is at no place in the file");
    header.data_offset = mark + 1 + offset;
    if (std::string_view(appended.attribute("encoding").value()) != "raw") header.base64_skip = 0;
  } else if (format == "binary") {
    header.base64_skip = 0;
  } else {
    return bad("the format of its array is not ascii, binary or appended");
  }
  const std::string_view compressor = root.attribute("compressor").value(), width = root.attribute("header_type").value();
  if (!compressor.empty() && compressor != kCompressor) return fail(name + " is compressed by other than zlib; write it with vtkZLibDataCompressor");
  if (!compressor.empty()) header.encoding = Encoding::deflate;
  if (auto skipped = skip_counts(file, width == "UInt64" ? 8 : 4, header); !skipped) return tl::unexpected<Error>(skipped.error());
  return header;
}

}  // namespace intervale

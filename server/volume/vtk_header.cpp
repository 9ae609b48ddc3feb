#include "server/volume/vtk_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <string>
#include <vector>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::string_view kVtkMagic = "# vtk DataFile Version ";

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return words;
}

// A file's lines, one after the other.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : text_(text) {}
  [[nodiscard]] bool has_more() const { return at_ < text_.size(); }
  [[nodiscard]] std::size_t position() const { return at_; }
  std::string_view next() {
    const auto end = std::min(text_.find('\n', at_), text_.size());
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    return line;
  }
  // The words of the next line with any, the first in capitals; none at the end.
  std::vector<std::string_view> next_words(std::string& first) {
    std::vector<std::string_view> words;
    while (words.empty() && has_more()) words = words_of(next());
    first = words.empty() ? std::string_view() : words[0];
    std::transform(first.begin(), first.end(), first.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return words;
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

std::optional<SampleType> vtk_type(std::string_view name) {
  constexpr std::array<std::string_view, 8> kTypes{"unsigned_char", "char", "unsigned_short", "short", "unsigned_int", "int", "float", "double"};
  const auto* const found = std::find(kTypes.begin(), kTypes.end(), name);  // in SampleType's order
  return found == kTypes.end() ? std::nullopt : std::optional(SampleType(found - kTypes.begin()));
}

template <class T>
bool parse(std::string_view text, T& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

template <class T>
bool parse_three(const std::vector<std::string_view>& words, std::array<T, 3>& numbers) {
  if (words.size() != 4) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!parse(words[k + 1], numbers[k])) return false;
  }
  return true;
}

// What the lines say of the grid and of the first array.
struct Parsed {
  std::array<std::int64_t, 3> dims{};
  Vec3 origin{}, spacing{1, 1, 1};
  std::string_view array, type;
  std::uint64_t components = 1;
  bool is_color = false;  // in text they would be fractions of 255
};

// Sets the name, type and components of the array that a line begins; false if it begins none.
bool take_array(const std::string& keyword, const std::vector<std::string_view>& words, LineReader& lines, Parsed& parsed) {
  std::string first;
  if (keyword == "SCALARS" && words.size() >= 3) {
    parsed.array = words[1];
    parsed.type = words[2];
    if (words.size() > 3 && !parse(words[3], parsed.components)) parsed.components = 0;
    LineReader ahead = lines;  // a table of colours may be named, or not
    ahead.next_words(first);
    if (first == "LOOKUP_TABLE") lines = ahead;
    return true;
  }
  if (keyword == "COLOR_SCALARS" && words.size() == 3) {  // VTK writes all scalars of this type so
    parsed.array = words[1];
    parsed.type = "unsigned_char";
    parsed.is_color = true;
    if (!parse(words[2], parsed.components)) parsed.components = 0;
    return true;
  }
  if ((keyword == "VECTORS" || keyword == "NORMALS") && words.size() >= 3) {
    parsed.array = words[1];
    parsed.type = words[2];
    parsed.components = 3;
    return true;
  }
  if (keyword != "FIELD") return false;
  const auto array = lines.next_words(first);
  if (array.size() != 4 || !parse(array[1], parsed.components)) parsed.components = 0;
  if (array.size() == 4) {
    parsed.array = array[0];
    parsed.type = array[3];
  }
  return true;
}

}  // namespace

bool is_legacy_vtk(std::string_view start) { return start.starts_with(kVtkMagic); }

Result<VolumeHeader> read_vtk_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  const auto start = read_start(file, kMaxTextHeader);
  if (!start) return tl::unexpected<Error>(start.error());
  if (!is_legacy_vtk(*start)) return fail(name + " is not a legacy VTK file: it does not begin with '# vtk DataFile Version'");
  LineReader lines(*start);
  lines.next();
  lines.next();  // the title
  VolumeHeader header;
  header.format = "legacy VTK";
  std::string keyword;
  lines.next_words(keyword);
  if (keyword != "ASCII" && keyword != "BINARY") return fail(name + ": bad VTK header: the third line is not ASCII or BINARY");
  header.encoding = keyword == "ASCII" ? Encoding::text : Encoding::raw;
  header.big_endian = keyword == "BINARY";

  Parsed parsed;
  bool has_points = false, has_data = false;
  while (!has_data) {
    const auto words = lines.next_words(keyword);
    if (words.empty())
      return fail(name + ": the VTK file has no array of point data" + (start->size() == kMaxTextHeader ? " in its first 64 KiB" : ""));
    bool is_right = true;
    if (keyword == "DATASET") {
      if (words.size() < 2 || words[1] != "STRUCTURED_POINTS")
        return fail(name + ": the dataset of the VTK file is not STRUCTURED_POINTS, a regular grid; resample it first");
    } else if (keyword == "DIMENSIONS") {
      is_right = parse_three(words, parsed.dims);
    } else if (keyword == "ORIGIN") {
      is_right = parse_three(words, parsed.origin);
    } else if (keyword == "SPACING" || keyword == "ASPECT_RATIO") {
      is_right = parse_three(words, parsed.spacing);
    } else if (keyword == "CELL_DATA") {
      return fail(name + " has data of cells first; values at points are read");
    } else if (keyword == "POINT_DATA") {
      has_points = true;
    } else if (keyword == "METADATA") {
      while (!trimmed(lines.next()).empty()) {
      }
    } else {
      has_data = is_right = has_points && take_array(keyword, words, lines, parsed);
    }
    if (!is_right) return fail(name + ": bad VTK header: its line " + keyword.substr(0, 32) + " is not understood");
  }
  const auto type = vtk_type(parsed.type);
  if (!type) return fail(name + ": VTK samples of another type than char, short, int, unsigned or not, float and double are not read");
  header.type = *type;
  if (parsed.components != 1 && parsed.components != 3)
    return fail(name + ": the first array of the VTK file has another number of components than 1 or 3");
  header.components = unsigned(parsed.components);
  if (parsed.is_color && header.encoding == Encoding::text) return fail(name + ": COLOR_SCALARS as text are not read; write the file as BINARY");
  const auto grid = make_grid(parsed.dims, Affine::of(parsed.spacing, parsed.origin), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (is_label(parsed.array)) header.labels.field = parsed.array;
  header.data_offset = lines.position();
  return header;
}

}  // namespace intervale

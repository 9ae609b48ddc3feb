#include "server/volume/vtk_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::string_view kVtkMagic = "# vtk DataFile Version ";

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
  bool skip(std::uint64_t bytes) {  // false if there are not as many
    if (bytes > text_.size() - at_) return false;
    at_ += std::size_t(bytes);
    return true;
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
  const auto* const found = std::find(kTypes.begin(), kTypes.end(), lower(name));  // in SampleType's order
  return found == kTypes.end() ? std::nullopt : std::optional(SampleType(found - kTypes.begin()));
}

using Words = std::vector<std::string_view>;

// Sets the three numbers behind a line's keyword; false if it has something else.
template <class T>
bool parse_three(const Words& words, std::array<T, 3>& numbers) {
  const auto found = numbers_of<T, 3>(std::span(words).subspan(1));
  if (found) numbers = *found;
  return found.has_value();
}

// Sets the number that is a line's word `k`, 0 if it is something else.
void parse_word(const Words& words, std::size_t k, std::uint64_t& number) { number = number_of<std::uint64_t>(words[k]).value_or(0); }

// As VTK writes names: %20 for a blank, and so on.
std::string decoded_name(std::string_view name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    unsigned code = 0;
    const bool is_code =
        name[i] == '%' && i + 2 < name.size() && std::from_chars(name.data() + i + 1, name.data() + i + 3, code, 16).ptr == name.data() + i + 3;
    text += is_code ? char(code) : name[i];
    if (is_code) i += 2;
  }
  return text;
}

// What the lines say of the grid and of the first array.
struct Parsed {
  bool is_text = false, has_grid = false;
  std::array<std::int64_t, 3> dims{};
  Vec3 origin{}, spacing{1, 1, 1};
  std::optional<std::uint64_t> points;  // that POINT_DATA says there are
  std::string_view array, type;
  std::uint64_t components = 1, tuples = 0;  // of a FIELD's array; otherwise of as many points
  bool is_color = false;                     // in text they would be fractions of 255
};

// The line of an array of a FIELD: its name, components, tuples and type.
bool take_field_array(LineReader& lines, Parsed& parsed) {
  std::string first;
  const Words words = lines.next_words(first);
  if (words.size() != 4) return false;
  parsed.array = words[0];
  parse_word(words, 1, parsed.components);
  parse_word(words, 2, parsed.tuples);
  parsed.type = words[3];
  return true;
}

// Skips the arrays of a FIELD before the grid's own data, such as the time; false if that cannot be done.
bool skip_field(const Words& words, LineReader& lines, const Parsed& parsed) {
  std::uint64_t arrays = 0;
  if (words.size() != 3) return false;
  for (parse_word(words, 2, arrays); arrays > 0 && lines.has_more(); --arrays) {
    Parsed array;
    if (!take_field_array(lines, array)) return false;
    const auto type = vtk_type(array.type);
    if (!type || array.components > kMaxTextHeader || array.tuples > kMaxTextHeader) return false;
    const std::uint64_t numbers = array.components * array.tuples;
    if (!parsed.is_text) {
      if (!lines.skip(numbers * size_of(*type))) return false;
      continue;
    }
    std::string first;
    for (std::uint64_t seen = 0; seen < numbers;) {
      const std::size_t some = lines.next_words(first).size();
      if (some == 0) return false;
      seen += some;
    }
  }
  return arrays == 0;
}

// Sets the name, type and components of the array that a line begins; false if it begins none.
bool take_array(const std::string& keyword, const Words& words, LineReader& lines, Parsed& parsed) {
  parsed.tuples = parsed.points.value_or(0);
  if (keyword == "FIELD") return take_field_array(lines, parsed);
  if (words.size() < 3) return false;
  parsed.array = words[1];
  parsed.type = words[2];
  if (keyword == "SCALARS") {
    std::string first;
    if (words.size() > 3) parse_word(words, 3, parsed.components);
    lines.next_words(first);  // VTK itself wants this line
    return words.size() <= 4 && first == "LOOKUP_TABLE";
  }
  if (keyword == "COLOR_SCALARS") {  // VTK writes all scalars of this type so
    parse_word(words, 2, parsed.components);
    parsed.type = "unsigned_char";
    parsed.is_color = true;
    return true;
  }
  parsed.components = 3;
  return keyword == "VECTORS" || keyword == "NORMALS";
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
  parsed.is_text = header.encoding == Encoding::text;
  bool has_data = false;
  while (!has_data) {
    const auto words = lines.next_words(keyword);
    if (words.empty())
      return fail(name + ": the VTK file has no array of point data" + (start->size() == kMaxTextHeader ? " in its first 64 KiB" : ""));
    bool is_right = true;
    if (keyword == "DATASET") {
      parsed.has_grid = words.size() >= 2 && lower(words[1]) == "structured_points";
      if (!parsed.has_grid) return fail(name + ": the dataset of the VTK file is not STRUCTURED_POINTS, a regular grid; resample it first");
    } else if (keyword == "DIMENSIONS") {
      is_right = parse_three(words, parsed.dims);
    } else if (keyword == "ORIGIN") {
      is_right = parse_three(words, parsed.origin);
    } else if (keyword == "SPACING" || keyword == "ASPECT_RATIO") {
      is_right = parse_three(words, parsed.spacing);
    } else if (keyword == "CELL_DATA") {
      return fail(name + " has data of cells first; values at points are read");
    } else if (keyword == "POINT_DATA") {
      parsed.points = words.size() == 2 ? number_of<std::uint64_t>(words[1]) : std::nullopt;
      is_right = parsed.points.has_value();
    } else if (keyword == "METADATA") {
      while (!trimmed(lines.next()).empty()) {
      }
    } else if (keyword == "FIELD" && !parsed.points) {
      is_right = skip_field(words, lines, parsed);
    } else {
      has_data = is_right = parsed.points && take_array(keyword, words, lines, parsed);
    }
    if (!is_right) return fail(name + ": bad VTK header: its line " + keyword.substr(0, 32) + " is not understood");
  }
  if (!parsed.has_grid) return fail(name + ": bad VTK header: it has no line DATASET STRUCTURED_POINTS");
  const auto type = vtk_type(parsed.type);
  if (!type) return fail(name + ": VTK samples of another type than char, short, int, unsigned or not, float and double are not read");
  header.type = *type;
  if (auto few = check_components(parsed.components, name); !few) return tl::unexpected<Error>(few.error());
  header.components = unsigned(parsed.components);
  if (parsed.is_color && header.encoding == Encoding::text) return fail(name + ": COLOR_SCALARS as text are not read; write the file as BINARY");
  const auto grid = make_grid(parsed.dims, Affine::of(parsed.spacing, parsed.origin), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  const std::uint64_t points = grid->sample_count();
  if (parsed.points != points || parsed.tuples != points)
    return fail(name + ": bad VTK header: the grid has " + std::to_string(points) + " points, its data " + std::to_string(parsed.points.value_or(0)) +
                " and the first array " + std::to_string(parsed.tuples));
  if (const std::string field = decoded_name(parsed.array); is_label(field)) header.labels.field = field;
  header.data_offset = lines.position();
  return header;
}

}  // namespace intervale

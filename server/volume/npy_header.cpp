#include "server/volume/npy_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";

// What follows 'key': in the text of a Python dictionary; empty if it is not there.
std::string_view value_of(std::string_view text, std::string_view key) {
  const std::string quoted = "'" + std::string(key) + "':";
  const auto at = text.find(quoted);
  return at == text.npos ? std::string_view() : trimmed(text.substr(at + quoted.size()));
}

// The numbers of a tuple; none if it is not one of at most 8.
std::vector<std::int64_t> tuple_of(std::string_view text) {
  std::vector<std::int64_t> numbers;
  if (!text.starts_with('(')) return {};
  const auto end = text.find(')');
  if (end == text.npos) return {};
  text = text.substr(1, end - 1);
  while (!trimmed(text).empty() && numbers.size() < 8) {
    const auto comma = std::min(text.find(','), text.size());
    const std::string_view item = trimmed(text.substr(0, comma));
    const auto number = number_of<std::int64_t>(item);
    if (!number) return {};
    numbers.push_back(*number);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return numbers;
}

// Of '<f4' and the like, without the byte order.
std::optional<SampleType> npy_type(std::string_view kind) {
  constexpr std::array<std::string_view, 8> kKinds{"u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"};  // in SampleType's order
  const auto* const found = std::find(kKinds.begin(), kKinds.end(), kind);
  if (kind == "b1") return SampleType::u8;
  return found == kKinds.end() ? std::nullopt : std::optional(SampleType(found - kKinds.begin()));
}

}  // namespace

bool is_npy(std::string_view start) { return start.starts_with(kNpyMagic); }

Result<VolumeHeader> read_npy_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  const auto start = read_start(file, kMaxTextHeader + 12);
  if (!start) return tl::unexpected<Error>(start.error());
  const auto damaged = [&name](const std::string& why) { return fail(name + ": bad NumPy header: " + why); };
  if (!is_npy(*start)) return fail(name + " is not a NumPy file: it does not begin with \\x93NUMPY");
  if (start->size() < 12) return damaged("it is cut short");
  const auto version = std::uint8_t((*start)[6]);
  if (version < 1 || version > 3) return damaged("version " + std::to_string(version) + " is not known");
  const HeaderBytes bytes(*start, false);
  const std::size_t before = version == 1 ? 10 : 12;
  const std::size_t length = version == 1 ? bytes.number<std::uint16_t>(8) : bytes.number<std::uint32_t>(8);
  if (length > kMaxTextHeader) return damaged("it is longer than 64 KiB");
  if (before + length > start->size()) return damaged("it is cut short");
  const std::string_view text = std::string_view(*start).substr(before, length);

  VolumeHeader header;
  header.format = "NumPy";
  header.data_offset = before + length;
  const std::string_view descr = value_of(text, "descr"), order = value_of(text, "fortran_order");
  if (descr.size() < 5 || descr[0] != '\'') return damaged("'descr' is not one type");
  const std::string_view kind = descr.substr(2, descr.substr(1).find('\'') == std::string_view::npos ? 0 : descr.find('\'', 1) - 2);
  const auto type = npy_type(kind);
  if (!type || std::string_view("<>|=").find(descr[1]) == std::string_view::npos)
    return fail(name +
                ": NumPy samples of another type than bool, int8 to int32, uint8 to uint32, float32 and float64 are not read; "
                "convert them with astype");
  header.type = *type;
  header.big_endian = descr[1] == '>';
  const bool is_fortran = order.starts_with("True");
  if (!is_fortran && !order.starts_with("False")) return damaged("'fortran_order' is not True or False");
  auto shape = tuple_of(value_of(text, "shape"));
  if (shape.empty()) return damaged("'shape' is not a tuple of numbers");
  if (!is_fortran) std::reverse(shape.begin(), shape.end());  // from here on x first
  if (shape.size() == 4 && !is_fortran && shape[0] == 3) {
    header.components = 3;
    shape.erase(shape.begin());
  } else if (shape.size() == 4 && shape[3] > 0) {
    header.time_points = std::uint64_t(shape[3]);
    shape.pop_back();
  }
  if (shape.size() != 3) return fail(name + " has " + std::to_string(shape.size()) + (shape.size() == 1 ? " axis" : " axes") + "; a volume has 3");
  const auto grid = make_grid({shape[0], shape[1], shape[2]}, Affine(), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  return header;
}

}  // namespace intervale

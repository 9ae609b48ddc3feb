#include "common/codec/value_table.h"

#include <cstring>
#include <utility>

#include "common/codec/byte_planes.h"

namespace intervale {
namespace {

constexpr unsigned kWidth = 8;        // bytes a value
constexpr int kTableCompression = 9;  // zstd
constexpr std::uint64_t kSign = std::uint64_t(1) << 63;

std::uint64_t order_number(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}

double value_of(std::uint64_t order_number) {
  const std::uint64_t bits = (order_number & kSign) != 0 ? order_number ^ kSign : ~order_number;
  double value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace

std::vector<std::uint8_t> encode_value_table(std::span<const double> table) {
  std::vector<std::uint64_t> words;
  words.reserve(table.size());
  std::uint64_t before = 0;
  for (const double value : table) {
    const std::uint64_t number = order_number(value);
    words.push_back(number - std::exchange(before, number));
  }
  std::vector<std::uint8_t> bytes;
  append_plane(bytes, split_bytes(words, kWidth), kTableCompression);
  return bytes;
}

Result<std::vector<double>> decode_value_table(std::span<const std::uint8_t> bytes, std::size_t count) {
  const auto plane = take_plane(bytes, count * kWidth);
  if (!plane || plane->size() != count * kWidth || !bytes.empty()) return fail("the table of values is damaged");
  std::vector<double> table;
  table.reserve(count);
  std::uint64_t number = 0;
  for (const std::uint64_t step : join_bytes(*plane, kWidth)) table.push_back(value_of(number += step));
  return table;
}

}  // namespace intervale

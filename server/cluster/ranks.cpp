#include "server/cluster/ranks.h"

#include <algorithm>

namespace intervale {

std::vector<double> joined_in_order(Ranks& ranks, std::span<const double> values) {
  const std::uint64_t own = values.size();
  const std::vector<std::uint64_t> sizes = joined<std::uint64_t>(ranks, std::span(&own, 1));
  std::vector<double> all = joined<double>(ranks, values);
  auto middle = all.begin();
  for (const std::uint64_t size : sizes) {
    std::inplace_merge(all.begin(), middle, middle + std::ptrdiff_t(size));
    middle += std::ptrdiff_t(size);
  }
  return all;
}

Result<void> agree(Ranks& ranks, const Result<void>& result) {
  std::string text;
  if (!result) text = (result.error().usage ? 'u' : 'f') + result.error().message;
  for (const std::vector<std::byte>& bytes : ranks.gather(std::as_bytes(std::span(text)))) {
    if (bytes.empty()) continue;
    std::string message(reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1);
    return char(bytes[0]) == 'u' ? misuse(std::move(message)) : fail(std::move(message));
  }
  return {};
}

}  // namespace intervale

#include "server/scratch/small_arrays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <utility>

namespace intervale {
namespace {

// Bytes of places, four sizes from each power of two to the next: 128, 160, 192, 224, 256, 320 … 16 KiB.
constexpr auto kSizes = [] {
  std::array<std::size_t, SmallArrays::kSizeClasses> sizes{};
  for (std::size_t n = 0; n < sizes.size(); ++n) sizes[n] = (SmallArrays::kLeastBytes << n / 4) / 4 * (4 + n % 4);
  return sizes;
}();
static_assert(kSizes.back() == SmallArrays::kMostBytes);

std::size_t size_class_of(std::size_t bytes) { return std::size_t(std::lower_bound(kSizes.begin(), kSizes.end(), bytes) - kSizes.begin()); }

}  // namespace

std::byte* SmallArrays::take(std::size_t bytes) {
  const std::size_t size_class = size_class_of(bytes);
  auto& candidates = with_room_[size_class];
  if (candidates.empty()) return nullptr;
  auto& [at, chunk] = *candidates.back();
  const auto word = std::find_if(chunk.free.begin(), chunk.free.end(), [](std::uint64_t bits) { return bits != 0; });
  const auto bit = std::size_t(std::countr_zero(*word));
  *word &= *word - 1;
  ++chunk.used;
  if (std::all_of(word, chunk.free.end(), [](std::uint64_t bits) { return bits == 0; })) candidates.pop_back();
  return at + (std::size_t(word - chunk.free.begin()) * 64 + bit) * kSizes[size_class];
}

void SmallArrays::add(std::size_t bytes, std::byte* at) {
  const std::size_t size_class = size_class_of(bytes), places = kChunkBytes / kSizes[size_class];
  Chunk chunk{.size_class = size_class, .used = 0, .place = with_room_[size_class].size()};
  chunk.free.assign((places + 63) / 64, ~std::uint64_t(0));
  if (places % 64 != 0) chunk.free.back() = (std::uint64_t(1) << (places % 64)) - 1;
  with_room_[size_class].push_back(chunks_.emplace(at, std::move(chunk)).first);
}

SmallArrays::Freed SmallArrays::free(std::byte* array) {
  auto found = chunks_.upper_bound(array);
  if (found == chunks_.begin()) return {};
  found = std::prev(found);
  auto& [at, chunk] = *found;
  if (array >= at + kChunkBytes) return {};
  const std::size_t place = std::size_t(array - at) / kSizes[chunk.size_class];
  auto& candidates = with_room_[chunk.size_class];
  const bool had_room = chunk.place < candidates.size() && candidates[chunk.place] == found;
  chunk.free[place / 64] |= std::uint64_t(1) << (place % 64);
  --chunk.used;
  if (!had_room) {
    chunk.place = candidates.size();
    candidates.push_back(found);
  }
  // One stays, for arrays that come and go.
  if (chunk.used != 0 || candidates.size() == 1) return {true, nullptr};
  std::byte* const unused = at;
  candidates[chunk.place] = candidates.back();
  candidates[chunk.place]->second.place = chunk.place;
  candidates.pop_back();
  chunks_.erase(found);
  return {true, unused};
}

}  // namespace intervale

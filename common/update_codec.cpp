#include "common/update_codec.h"

#include <algorithm>
#include <utility>

#include "common/planes.h"
#include "common/update.h"

namespace intervale {
namespace {

constexpr int kCompression = 1;  // zstd: on such planes faster and smaller than 3
constexpr unsigned kSlotBytes = 7;

// Calls visit(group, slot) in the order in which updates are applied; stops when it returns false.
template <class Visit>
void for_each_update(std::span<const BatchGroup> groups, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < groups.size(); begin = end) {
    const int scale = scale_of_key(groups[begin].key);
    while (end < groups.size() && scale_of_key(groups[end].key) == scale) ++end;
    for (const std::uint64_t cls : kSlotsOfClass) {
      for (std::size_t g = begin; g < end; ++g) {
        for (std::uint64_t left = groups[g].slots & cls; left != 0; left &= left - 1) {
          if (!visit(groups[g], std::countr_zero(left))) return;
        }
      }
    }
  }
}

tl::unexpected<Error> damaged(const char* what) { return fail(std::string("a batch is damaged: ") + what); }

// The names of a batch: bricks as steps from one to the next with a word for which supercubes, then a word of slots for each supercube.
Result<std::vector<BatchGroup>> take_names(std::span<const std::uint8_t>& in) {
  const auto steps = take_plane(in, 10 * kBatchUpdatesMost), masks = take_plane(in, 8 * kBatchUpdatesMost),
             slots = take_plane(in, kSlotBytes * kBatchUpdatesMost);
  if (!steps || !masks || !slots || masks->size() % 8 != 0 || slots->size() % kSlotBytes != 0) return damaged("its names");
  const auto brick_masks = join_bytes(*masks, 8), words = join_bytes(*slots, kSlotBytes);
  std::vector<BatchGroup> groups;
  groups.reserve(words.size());
  std::span<const std::uint8_t> left(*steps);
  std::uint64_t brick = 0;
  for (std::size_t b = 0; b < brick_masks.size(); ++b) {
    const auto step = take_varint(left);
    if (!step || (b > 0 && *step == 0) || *step >= (std::uint64_t(1) << 56) - brick || brick_masks[b] == 0)
      return damaged("its bricks do not ascend");
    brick += *step;
    const SupercubeKey key = brick << 6;
    if (scale_of_key(key) < 0 || scale_of_key(key) >= kMaxLevels) return damaged("a brick of no scale");
    for (std::uint64_t mask = brick_masks[b]; mask != 0; mask &= mask - 1) {
      if (groups.size() == words.size()) return damaged("more supercubes than words of slots");
      const std::uint64_t word = words[groups.size()];
      if (word == 0) return damaged("a supercube without a diamond");
      groups.push_back({0, 0, key + unsigned(std::countr_zero(mask)), word});
    }
  }
  if (groups.size() != words.size() || !left.empty()) return damaged("its names do not add up");
  return groups;
}

}  // namespace

std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, std::span<const BatchGroup> groups) {
  std::vector<std::uint8_t> steps, sides, first, other;
  std::vector<std::uint64_t> masks, slots;
  std::uint64_t previous = 0;
  for (const BatchGroup& g : groups) {
    const std::uint64_t brick = g.key >> 6;
    if (masks.empty() || brick != previous) {
      append_varint(steps, brick - previous);
      masks.push_back(0);
      previous = brick;
    }
    masks.back() |= std::uint64_t(1) << (g.key & 63);
    slots.push_back(g.slots);
  }
  for_each_update(groups, [&](const BatchGroup& g, int slot) {
    const UpdateView u = volume.update(volume.set().place_in(g.brick, g.supercube, g.key, slot));
    sides.push_back(std::uint8_t(u.side_difference));
    const auto firsts = std::ptrdiff_t(u.first_cuts);
    first.insert(first.end(), u.differences.begin(), u.differences.begin() + firsts);
    other.insert(other.end(), u.differences.begin() + firsts, u.differences.end());
    return true;
  });
  std::vector<std::uint8_t> out;
  append_plane(out, steps, kCompression);
  append_plane(out, split_bytes(masks, 8), kCompression);
  append_plane(out, split_bytes(slots, kSlotBytes), kCompression);
  append_plane(out, pack_pairs(sides), kCompression);
  append_plane(out, first, kCompression);
  append_plane(out, other, kCompression);
  return out;
}

Result<Applied> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::optional<std::uint64_t> max_tets) {
  const auto groups = take_names(bytes);
  if (!groups) return tl::unexpected(groups.error());
  std::uint64_t named = 0;
  for (const BatchGroup& g : *groups) named += std::popcount(g.slots);
  if (named > kBatchUpdatesMost) return damaged("too many updates");
  const auto sides = take_plane(bytes, (named + 3) / 4), first = take_plane(bytes, 2 * named),
             other = take_plane(bytes, std::size_t(kMaxCuts) * named);
  if (!sides || !first || !other || !bytes.empty() || sides->size() != (named + 3) / 4) return damaged("its planes");

  Applied applied;
  const char* wrong = nullptr;
  std::size_t next = 0;
  std::span<const std::uint8_t> firsts(*first), others(*other);
  Front::Cursor cursor(front);
  SupercubeKey at = 0;
  for_each_update(*groups, [&](const BatchGroup& g, int slot) {
    if (std::exchange(at, g.key) != g.key) cursor.move_to(g.key);
    const DiamondContext* const context = cursor.look(slot);
    const unsigned side_difference = pair_at(*sides, next++);
    if (context == nullptr || !cursor.can_be_split() || side_difference > 2) {
      wrong = "it splits a diamond that cannot be split now";
      return false;
    }
    Prediction prediction(*context);
    const Side side = Side((unsigned(prediction.side()) + side_difference) % 3);
    const auto count = context->count_cuts(side);
    const auto first_count = std::size_t(count.first), other_count = std::size_t(count.all - count.first);
    if (first_count > firsts.size() || other_count > others.size()) {
      wrong = "it has fewer coefficients than its updates call for";
      return false;
    }
    std::array<std::uint8_t, kMaxCuts> differences, cuts;
    std::copy_n(others.begin(), other_count, std::copy_n(firsts.begin(), first_count, differences.begin()));
    firsts = firsts.subspan(first_count);
    others = others.subspan(other_count);
    prediction.decode(side, std::span(differences).first(std::size_t(count.all)), cuts.data());
    cursor.split(side, std::span(cuts).first(std::size_t(count.all)));
    if (max_tets && front.tet_count() > *max_tets) {
      front.merge(cursor.diamond().centre);
      applied.over_budget = true;
      return false;
    }
    ++applied.updates;
    return true;
  });
  if (wrong != nullptr) return damaged(wrong);
  if (!applied.over_budget && !(firsts.empty() && others.empty())) return damaged("it has more coefficients than its updates call for");
  return applied;
}

}  // namespace intervale

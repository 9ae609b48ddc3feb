#include "common/update_codec.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/planes.h"
#include "common/update.h"

namespace intervale {
namespace {

constexpr int kCompression = 1;  // zstd: on such planes faster and smaller than 3
constexpr std::size_t kFlagPlanes = 6;

// The plane of a flag: by class, and by whether the diamond's vertices lie on different sides.
constexpr std::size_t flag_plane(int cls, bool mixed) { return std::size_t(3 * mixed + cls); }

// Calls visit(group number, class) in the order in which updates are applied; stops when it returns false. key(g): of group g.
template <class Key, class Visit>
void for_each_class(std::size_t groups, const Key& key, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < groups; begin = end) {
    const int scale = scale_of_key(key(begin));
    while (end < groups && scale_of_key(key(end)) == scale) ++end;
    for (int cls = 0; cls < 3; ++cls) {
      for (std::size_t g = begin; g < end; ++g) {
        if (!visit(g, cls)) return;
      }
    }
  }
}

tl::unexpected<Error> damaged(const char* what) { return fail(std::string("a batch is damaged: ") + what); }

// Bits in bytes, lowest first.
class Flags {
 public:
  void put(bool flag) {
    if (count_ % 8 == 0) bytes_.push_back(0);
    bytes_.back() = std::uint8_t(bytes_.back() | unsigned(flag) << count_ % 8);
    ++count_;
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t count_ = 0;
};
class FlagReader {
 public:
  explicit FlagReader(std::vector<std::uint8_t> bytes = {}) : bytes_(std::move(bytes)) {}
  [[nodiscard]] bool is_at_end() const { return next_ / 8 == bytes_.size(); }
  bool take() {  // not at the end
    const bool flag = (bytes_[next_ / 8] >> next_ % 8 & 1) != 0;
    ++next_;
    return flag;
  }
  // Whether nothing is left but what fills the last byte.
  [[nodiscard]] bool is_used_up() const { return (next_ + 7) / 8 == bytes_.size() && (next_ % 8 == 0 || bytes_.back() >> next_ % 8 == 0); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t next_ = 0;
};

// Whether the vertices of an update's diamond lie on different sides. If they do not, all of them or none are across a surface from the centre.
bool is_mixed(UpdateCode code, int vertices) {
  const int cuts = int(code.coefficients());
  return cuts != 0 && cuts != 2 * vertices && !(cuts == vertices && code.first_cuts() == 1);
}

// The supercubes of a batch: bricks as steps from one to the next, each with a word for which supercubes.
Result<std::vector<SupercubeKey>> take_supercubes(std::span<const std::uint8_t>& in) {
  const auto steps = take_plane(in, 10 * kBatchUpdatesMost), masks = take_plane(in, 8 * kBatchUpdatesMost);
  if (!steps || !masks || masks->size() % 8 != 0) return damaged("its names");
  std::vector<SupercubeKey> keys;
  std::span<const std::uint8_t> left(*steps);
  std::uint64_t brick = 0;
  bool is_first = true;
  for (std::uint64_t mask : join_bytes(*masks, 8)) {
    const auto step = take_varint(left);
    if (!step || (!is_first && *step == 0) || *step >= (std::uint64_t(1) << 56) - brick || mask == 0) return damaged("its bricks do not ascend");
    is_first = false;
    brick += *step;
    const SupercubeKey key = brick << 6;
    if (scale_of_key(key) < 0 || scale_of_key(key) >= kMaxLevels) return damaged("a brick of no scale");
    if (keys.size() + std::popcount(mask) > kBatchUpdatesMost) return damaged("too many supercubes");
    for (; mask != 0; mask &= mask - 1) keys.push_back(key + unsigned(std::countr_zero(mask)));
  }
  if (!left.empty()) return damaged("its names do not add up");
  return keys;
}

}  // namespace

std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, const SplitSet& split, std::span<const SlotGroup> groups) {
  const SupercubeSet& set = volume.set();
  std::vector<std::uint8_t> steps, sides, first, other;
  std::vector<std::uint64_t> masks;
  std::array<Flags, kFlagPlanes> flags;
  std::uint64_t previous = 0;
  // Of each group: what can be split when its turn comes, and what of that has vertices on different sides.
  struct Candidates {
    std::uint64_t ready = 0, mixed = 0;
  };
  std::vector<Candidates> candidates;
  candidates.reserve(groups.size());
  Readiness readiness(set, volume.domain(), split);
  for (const SlotGroup& g : groups) {
    const std::uint64_t brick = g.key >> 6;
    if (masks.empty() || brick != previous) {
      append_varint(steps, brick - previous);
      masks.push_back(0);
      previous = brick;
    }
    masks.back() |= std::uint64_t(1) << (g.key & 63);
    readiness.move_to(g.key);
    Candidates& c = candidates.emplace_back();
    c.ready = readiness.ready() & (~split.slots(set, g.brick, g.supercube) | g.slots);
    const bool interior = is_interior(volume.domain(), scale_of_key(g.key), position_of_key(g.key));
    UpdateIndex i = set.first(g.brick, g.supercube);
    for (std::uint64_t left = set.occupancy()[g.supercube]; left != 0; left &= left - 1, ++i) {
      const int slot = std::countr_zero(left);
      if (!(c.ready >> slot & 1)) continue;
      int vertices = diamond_type(kTypeOfSlot[slot]).vertices;
      if (!interior) {
        const Diamond d(centre_of(g.key, slot));
        vertices = std::popcount(Domain::vertices(*d.row, volume.domain().tets(d)));
      }
      c.mixed |= std::uint64_t(is_mixed(volume.codes()[i], vertices)) << slot;
    }
  }
  for_each_class(
      groups.size(), [&](std::size_t g) { return groups[g].key; },
      [&](std::size_t k, int cls) {
        const SlotGroup& g = groups[k];
        for (std::uint64_t left = candidates[k].ready & kSlotsOfClass[cls]; left != 0; left &= left - 1) {
          const int slot = std::countr_zero(left);
          const bool is_named = (g.slots >> slot & 1) != 0;
          flags[flag_plane(cls, (candidates[k].mixed >> slot & 1) != 0)].put(is_named);
          if (!is_named) continue;
          const UpdateView u = volume.update(set.place_in(g.brick, g.supercube, g.key, slot));
          sides.push_back(std::uint8_t(u.side_difference));
          const auto firsts = std::ptrdiff_t(u.first_cuts);
          first.insert(first.end(), u.differences.begin(), u.differences.begin() + firsts);
          other.insert(other.end(), u.differences.begin() + firsts, u.differences.end());
        }
        return true;
      });
  std::vector<std::uint8_t> out;
  append_plane(out, steps, kCompression);
  append_plane(out, split_bytes(masks, 8), kCompression);
  for (const Flags& f : flags) append_plane(out, f.bytes(), kCompression);
  append_plane(out, pack_pairs(sides), kCompression);
  append_plane(out, first, kCompression);
  append_plane(out, other, kCompression);
  return out;
}

Result<Applied> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::optional<std::uint64_t> max_tets) {
  const auto keys = take_supercubes(bytes);
  if (!keys) return tl::unexpected(keys.error());
  std::array<FlagReader, kFlagPlanes> flags;
  for (FlagReader& f : flags) {
    auto plane = take_plane(bytes, kSlots * kBatchUpdatesMost / 8);
    if (!plane) return damaged("its flags");
    f = FlagReader(std::move(*plane));
  }
  const auto sides = take_plane(bytes, (kBatchUpdatesMost + 3) / 4), first = take_plane(bytes, 2 * kBatchUpdatesMost),
             other = take_plane(bytes, std::size_t(kMaxCuts) * kBatchUpdatesMost);
  if (!sides || !first || !other || !bytes.empty()) return damaged("its planes");

  Applied applied;
  const char* wrong = nullptr;
  std::span<const std::uint8_t> firsts(*first), others(*other);
  Front::Cursor cursor(front);
  // Splits the diamond looked at if the batch says so. False if that is the end.
  const auto take = [&](FlagReader& of_diamond) {
    if (of_diamond.is_at_end()) {
      wrong = "it says too little of what it splits";
      return false;
    }
    if (!of_diamond.take()) return true;
    const std::size_t next = applied.updates;
    if (next >= 4 * sides->size()) {
      wrong = "it has fewer sides than updates";
      return false;
    }
    const DiamondContext& context = cursor.look_closer();
    Prediction prediction(context);
    const unsigned side_difference = pair_at(*sides, next);
    const Side side = Side((unsigned(prediction.side()) + side_difference) % 3);
    const auto count = context.count_cuts(side);
    const auto first_count = std::size_t(count.first), other_count = std::size_t(count.all - count.first);
    if (side_difference > 2 || first_count > firsts.size() || other_count > others.size()) {
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
  };
  for_each_class(
      keys->size(), [&](std::size_t g) { return (*keys)[g]; },
      [&](std::size_t g, int cls) {
        cursor.move_to((*keys)[g]);
        for (std::uint64_t left = kSlotsOfClass[cls] & ~cursor.split_slots(); left != 0; left &= left - 1) {
          if (!cursor.find(std::countr_zero(left))) continue;
          if (!take(flags[flag_plane(cls, cursor.context().is_mixed())])) return false;
        }
        return true;
      });
  if (wrong != nullptr) return damaged(wrong);
  if (applied.over_budget) return applied;
  for (const FlagReader& f : flags) {
    if (!f.is_used_up()) return damaged("it says more of what it splits than there is");
  }
  if (!firsts.empty() || !others.empty() || sides->size() != (applied.updates + 3) / 4) return damaged("it has more than its updates call for");
  return applied;
}

}  // namespace intervale

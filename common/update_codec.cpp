#include "common/update_codec.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/difference_coder.h"
#include "common/planes.h"
#include "common/split_names.h"
#include "common/update.h"

namespace intervale {
namespace {

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

// Whether a diamond that can be split is split: by its class, by whether its vertices lie on different sides (then it is surely relevant, and hardly
// ever left out), and by the last three such diamonds.
struct FlagModel {
  std::array<std::array<std::array<Chance, 8>, 2>, 3> chance;
  std::array<std::array<unsigned, 2>, 3> before{};

  template <class Coder>
  bool code(Coder& coder, int cls, bool mixed, bool is_plain, bool value = false) {
    unsigned& last = before[cls][mixed];
    const bool flag = is_plain ? coder.even_bits(1, unsigned(value)) != 0 : coder.bit(chance[cls][mixed][last], value);
    last = (2 * last + unsigned(flag)) & 7;
    return flag;
  }
};

// Whether the vertices of an update's diamond lie on different sides. If they do not, all of them or none are across a surface from the centre.
bool is_mixed(UpdateCode code, int vertices) {
  const int cuts = int(code.coefficients());
  return cuts != 0 && cuts != 2 * vertices && !(cuts == vertices && code.first_cuts() == 1);
}

}  // namespace

std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, const SplitSet& split, std::span<const SlotGroup> groups) {
  const SupercubeSet& set = volume.set();
  // Of each group: what can be split when its turn comes, and what of that has vertices on different sides.
  struct Candidates {
    std::uint64_t ready = 0, mixed = 0;
    std::array<UpdateIndex, 3> update{};        // of each class, the first one
    std::array<std::uint32_t, 3> difference{};  // and its first difference
  };
  std::vector<Candidates> candidates;
  candidates.reserve(groups.size());
  Readiness readiness(set, volume.domain(), split);
  for (const SlotGroup& g : groups) {
    readiness.move_to(g.key);
    Candidates& c = candidates.emplace_back();
    c.ready = readiness.ready() & (~split.slots(set.first(g.brick, g.supercube), set.occupancy()[g.supercube]) | g.slots);
    const bool interior = is_interior(volume.domain(), scale_of_key(g.key), position_of_key(g.key));
    UpdateIndex i = set.first(g.brick, g.supercube);
    std::uint32_t difference = volume.first_difference(g.brick, g.supercube);
    for (int cls = 0; cls < 3; ++cls) {
      c.update[cls] = i;
      c.difference[cls] = difference;
      for (std::uint64_t left = set.occupancy()[g.supercube] & kSlotsOfClass[cls]; left != 0; left &= left - 1, ++i) {
        const UpdateCode code = volume.codes()[i];
        difference += code.coefficients();
        const int slot = std::countr_zero(left);
        if (!(c.ready >> slot & 1)) continue;
        int vertices = diamond_type(kTypeOfSlot[slot]).vertices;
        if (!interior) {
          const Diamond d(centre_of(g.key, slot));
          vertices = std::popcount(Domain::vertices(*d.row, volume.domain().tets(d)));
        }
        c.mixed |= std::uint64_t(is_mixed(code, vertices)) << slot;
      }
    }
  }
  const auto coded = [&](bool is_plain, std::size_t& plain_bytes) {
    RangeEncoder coder;
    FlagModel flags;
    DifferenceCoder differences;
    differences.is_plain = is_plain;
    coder.even_bits(1, unsigned(is_plain));
    for_each_class(
        groups.size(), [&](std::size_t g) { return groups[g].key; },
        [&](std::size_t k, int cls) {
          const SlotGroup& g = groups[k];
          const Candidates& c = candidates[k];
          const std::uint64_t occupancy = set.occupancy()[g.supercube];
          UpdateIndex i = c.update[cls];
          std::uint32_t difference = c.difference[cls];
          for (std::uint64_t left = (c.ready | occupancy) & kSlotsOfClass[cls]; left != 0; left &= left - 1) {
            const std::uint64_t bit = left & (~left + 1);
            const bool is_named = (g.slots & bit) != 0;
            if ((c.ready & bit) != 0) flags.code(coder, cls, (c.mixed & bit) != 0, is_plain, is_named);
            if ((occupancy & bit) == 0) continue;
            if (is_named) {
              const UpdateView u = volume.update(i, difference);
              std::array<std::uint8_t, kMaxCuts> cuts;
              std::copy(u.differences.begin(), u.differences.end(), cuts.begin());
              differences.code_side(coder, u.side_difference);
              differences.code_cuts(coder, cls, u.side_difference, unsigned(u.differences.size()), u.first_cuts, cuts.data());
              plain_bytes += 1 + u.differences.size();
            }
            difference += volume.codes()[i++].coefficients();
          }
          return true;
        });
    return coder.finish();
  };
  std::size_t plain_bytes = sizeof(std::uint64_t);
  std::vector<std::uint8_t> diamonds = coded(false, plain_bytes);
  if (diamonds.size() > plain_bytes) diamonds = coded(true, plain_bytes);
  std::vector<std::uint8_t> out;
  append_supercubes(out, groups);
  append_varint(out, diamonds.size());
  out.insert(out.end(), diamonds.begin(), diamonds.end());
  return out;
}

Result<std::uint64_t> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets) {
  const auto keys = take_supercubes(bytes, kBatchUpdatesMost);
  if (!keys) return damaged(keys.error().message.c_str());
  const auto length = take_varint(bytes);
  if (!length || *length != bytes.size()) return damaged("its length");

  std::uint64_t updates = 0;
  const char* wrong = nullptr;
  RangeDecoder coder(bytes);
  FlagModel flags;
  DifferenceCoder differences;
  differences.is_plain = coder.even_bits(1) != 0;
  Front::Cursor cursor(front);
  // Splits the diamond looked at if the batch says so. False if that is the end.
  const auto take = [&](int cls) {
    const bool is_split = flags.code(coder, cls, cursor.context().is_mixed(), differences.is_plain);
    if (coder.is_overdrawn()) {
      wrong = "it says too little of what it splits";
      return false;
    }
    if (!is_split) return true;
    if (updates == kBatchUpdatesMost) {
      wrong = "it has too many updates";
      return false;
    }
    const DiamondContext& context = cursor.look_closer();
    Prediction prediction(context);
    const unsigned side_difference = differences.code_side(coder);
    const Side side = Side((unsigned(prediction.side()) + side_difference) % 3);
    const auto count = context.count_cuts(side);
    std::array<std::uint8_t, kMaxCuts> coded{}, cuts;
    differences.code_cuts(coder, cls, side_difference, unsigned(count.all), unsigned(count.first), coded.data());
    if (coder.is_overdrawn()) {
      wrong = "it has fewer bytes than its updates call for";
      return false;
    }
    prediction.decode(side, std::span(coded).first(std::size_t(count.all)), cuts.data());
    cursor.split(side, std::span(cuts).first(std::size_t(count.all)), max_tets);
    ++updates;
    return true;
  };
  for_each_class(
      keys->size(), [&](std::size_t g) { return (*keys)[g]; },
      [&](std::size_t g, int cls) {
        cursor.move_to((*keys)[g]);
        for (std::uint64_t left = kSlotsOfClass[cls] & ~cursor.split_slots(); left != 0; left &= left - 1) {
          if (!cursor.find(std::countr_zero(left))) continue;
          if (!take(cls)) return false;
        }
        return true;
      });
  if (wrong != nullptr) return damaged(wrong);
  if (!coder.is_spent()) return damaged("it has more than its updates call for");
  return updates;
}

}  // namespace intervale

#include "common/ivm/batch_encoder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/codec/residual_coder.h"
#include "common/codec/split_names.h"

namespace intervale {
namespace {

// Whether the vertices of an update's diamond lie on different sides. If they do not, all of them or none are across a
// surface from the centre.
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
    std::array<UpdateIndex, 3> update{};      // of each class, the first one
    std::array<std::uint32_t, 3> residual{};  // and its first residual
  };
  std::vector<Candidates> candidates;
  candidates.reserve(groups.size());
  SplittableSlots splittable(set, volume.domain(), split);
  for (const SlotGroup& g : groups) {
    splittable.move_to(g.key);
    Candidates& c = candidates.emplace_back();
    c.ready = splittable.slots() & (~split.slots(set.first(g.brick, g.supercube), set.occupancy()[g.supercube]) | g.slots);
    const bool interior = is_interior(volume.domain(), scale_of_key(g.key), position_of_key(g.key));
    UpdateIndex i = set.first(g.brick, g.supercube);
    std::uint32_t residual = volume.first_residual(g.brick, g.supercube);
    for (int cls = 0; cls < 3; ++cls) {
      c.update[cls] = i;
      c.residual[cls] = residual;
      for (std::uint64_t left = set.occupancy()[g.supercube] & kSlotsOfClass[cls]; left != 0; left &= left - 1, ++i) {
        const UpdateCode code = volume.codes()[i];
        residual += code.coefficients();
        const Slot slot(std::countr_zero(left));
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
    ResidualCoder residuals;
    residuals.is_plain = is_plain;
    coder.raw_bits(1, unsigned(is_plain));
    for_each_class(
        groups.size(), [&](std::size_t g) { return groups[g].key; },
        [&](std::size_t k, int cls) {
          const SlotGroup& g = groups[k];
          const Candidates& c = candidates[k];
          const std::uint64_t occupancy = set.occupancy()[g.supercube];
          UpdateIndex i = c.update[cls];
          std::uint32_t residual = c.residual[cls];
          for (std::uint64_t left = (c.ready | occupancy) & kSlotsOfClass[cls]; left != 0; left &= left - 1) {
            const std::uint64_t bit = left & (~left + 1);
            const bool is_named = (g.slots & bit) != 0;
            if ((c.ready & bit) != 0) flags.code(coder, cls, (c.mixed & bit) != 0, is_plain, is_named);
            if ((occupancy & bit) == 0) continue;
            if (is_named) {
              const UpdateView u = volume.update(i, residual);
              std::array<std::uint8_t, kMaxCuts> cuts;
              std::copy(u.residuals.begin(), u.residuals.end(), cuts.begin());
              residuals.code_side(coder, u.side_residual);
              residuals.code_cuts(coder, cls, u.side_residual, unsigned(u.residuals.size()), u.first_cuts, cuts.data());
              plain_bytes += 1 + u.residuals.size();
            }
            residual += volume.codes()[i++].coefficients();
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

}  // namespace intervale

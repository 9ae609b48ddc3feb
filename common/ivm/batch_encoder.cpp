#include "common/ivm/batch_encoder.h"

#include <array>
#include <bit>
#include <memory>

#include "common/codec/split_names.h"
#include "common/ivm/split_lattice.h"

namespace intervale {
namespace {

constexpr std::uint64_t kAllSlots = (std::uint64_t(1) << kSlots) - 1;

// A diamond that can be split when its turn comes.
struct Candidate {
  ValueKey key = 0;  // if it is split
  PredictedValue predicted;
  std::uint8_t near = 0;
};

class BatchEncoder {
 public:
  BatchEncoder(const IntervalVolume& volume, const ShownRanges& shown, const SplitSet& split, std::span<const SlotGroup> groups)
      : volume_(volume), ranges_(volume.description().format, shown), groups_(groups) {
    SplitLattice lattice(volume, split);
    ready_.reserve(groups.size());
    first_.reserve(groups.size());
    candidates_.reserve(16 * groups.size());  // about as many as there are
    for (const SlotGroup& g : groups) {
      lattice.move_to(g);
      ready_.push_back(lattice.splittable(kAllSlots & (~split.slots(g.brick, g.key) | g.slots)));
      first_.push_back(candidates_.size());
      add<0>(lattice, g);
      add<1>(lattice, g);
      add<2>(lattice, g);
    }
  }

  // The batch: without models if that is shorter.
  [[nodiscard]] std::vector<std::uint8_t> code() const {
    const std::size_t key_bits = std::size_t(std::bit_width(volume_.description().format.last));
    const std::size_t plain_bits = plain_supercube_bits(groups_) + candidates_.size() + updates_ * key_bits;
    std::vector<std::uint8_t> bytes = coded(false);
    return bytes.size() > sizeof(std::uint64_t) + plain_bits / 8 ? coded(true) : bytes;
  }

 private:
  // Adds the candidates of a class of the last group.
  template <int Class>
  void add(const SplitLattice& lattice, const SlotGroup& g) {
    const Description& d = volume_.description();
    const PredictorWeights& weights = d.weights.of[std::size_t(scale_of_key(g.key))][Class];
    const std::uint64_t occupancy = volume_.set().occupancy()[g.supercube];
    const UpdateIndex first = volume_.set().first(g.brick, g.supercube);
    VertexKeys around;
    for (const Slot slot : set_bits<Slot>(ready_.back() & kSlotsOfClass[Class])) {
      const KeySpan span = lattice.gather<Class>(slot, around);
      Candidate c;
      c.near = std::uint8_t(ranges_.nearness(span));
      if ((g.slots >> slot & 1) != 0) {
        ++updates_;
        c.key = volume_.key(first + count_below(occupancy, slot));
        c.predicted = predict_value<Class>(around, span, weights, d.format.last);
      }
      candidates_.push_back(c);
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> coded(bool is_plain) const {
    RangeEncoder coder;
    const auto models = std::make_unique<BatchModels>(is_plain);
    coder.raw_bits(1, unsigned(is_plain));
    encode_supercubes(coder, is_plain, groups_);
    const ValueKey last = volume_.description().format.last;
    for_each_class(
        groups_.size(), [&](std::size_t g) { return groups_[g].key; },
        [&](std::size_t g, int cls) {
          const int scale = scale_of_key(groups_[g].key);
          const std::uint64_t slots = ready_[g] & kSlotsOfClass[std::size_t(cls)];
          if (slots == 0) return true;
          const Candidate* candidate = &candidates_[first_[g] + std::size_t(count_below(ready_[g], std::countr_zero(slots)))];
          for (const Slot slot : set_bits<Slot>(slots)) {
            const bool is_named = (groups_[g].slots >> slot & 1) != 0;
            models->code_flag(coder, cls, candidate->near, is_named);
            if (is_named) models->code_key(coder, cls, scale, candidate->predicted, last, candidate->key);
            ++candidate;
          }
          return true;
        });
    return coder.finish();
  }

  const IntervalVolume& volume_;
  FlagRanges ranges_;
  std::span<const SlotGroup> groups_;
  std::vector<std::uint64_t> ready_;   // by group: the slots of its candidates
  std::vector<std::size_t> first_;     // by group: the number of its first candidate
  std::vector<Candidate> candidates_;  // by group and slot
  std::size_t updates_ = 0;
};

}  // namespace

std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, const ShownRanges& shown, const SplitSet& split,
                                       std::span<const SlotGroup> groups) {
  return BatchEncoder(volume, shown, split, groups).code();
}

}  // namespace intervale

#include "common/front/batch_decoder.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/batch.h"
#include "common/codec/split_names.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

tl::unexpected<Error> damaged(const char* what) { return fail(std::string("a batch is damaged: ") + what); }

// Reads the flags and values of a batch, after its names, and splits diamonds of fronts: finds them in the first one, and
// makes the same splits in the others.
class BatchDecoder {
 public:
  BatchDecoder(std::span<Front> fronts, const Description& description, const ShownRanges& shown, const RangeDecoder& coder, bool is_plain,
               std::uint64_t max_tets)
      : fronts_(fronts),
        description_(description),
        ranges_(description.format, shown),
        max_tets_(max_tets),
        coder_(coder),
        models_(is_plain),
        cursor_(fronts[0].state()) {
    others_.reserve(fronts.size() - 1);
    for (const Front& other : fronts.subspan(1)) others_.emplace_back(other.state());
  }

  // The diamonds of one class in a supercube. False if the batch is damaged.
  bool take(SupercubeKey key, int cls) { return cls == 0 ? take<0>(key) : cls == 1 ? take<1>(key) : take<2>(key); }
  [[nodiscard]] const char* wrong() const { return wrong_; }  // or null
  [[nodiscard]] bool is_spent() const { return coder_.is_spent(); }
  [[nodiscard]] std::uint64_t updates() const { return updates_; }

 private:
  // Reads the flags of the diamonds, and splits those whose flag is set.
  template <int Class>
  bool take(SupercubeKey key) {
    cursor_.move_to(key);
    bool others_are_here = false;
    const PredictorWeights& weights = description_.weights.of[std::size_t(cursor_.scale())][Class];
    const ValueKey last = description_.format.last;
    RangeDecoder coder = coder_;  // nothing has its address, so that it stays in registers
    for (const Slot slot : set_bits<Slot>(cursor_.may_be_splittable(kSlotsOfClass[Class] & ~cursor_.here().split))) {
      if (!(cursor_.is_interior() ? cursor_.gather_keys(slot) : cursor_.find(slot))) continue;
      const KeySpan span = cursor_.key_span();
      const bool is_split = models_.code_flag(coder, Class, ranges_.nearness(span));
      if (coder.is_overdrawn()) return stop("it has fewer flags than its supercubes call for");
      if (!is_split) continue;
      if (updates_ == kBatchUpdatesMost) return stop("it has too many updates");
      const ValueKey value = models_.code_key(coder, Class, cursor_.scale(), predict_value<Class>(keys_around<Class>(), span, weights, last), last);
      if (coder.is_overdrawn()) return stop("it has fewer bytes than its updates call for");
      if (value > last) return stop("a value is out of range");
      fronts_[0].split(cursor_, value, tets_left(fronts_, 0, max_tets_));
      if (!others_.empty()) split_others(key, std::exchange(others_are_here, true), slot, value);
      ++updates_;
    }
    coder_ = coder;
    return true;
  }
  // The keys at the vertices of the diamond that the cursor found, none missing. Those that fill_missing() sets lie
  // within the span of the others.
  template <int Class>
  const VertexKeys& keys_around() {
    const VertexKeys& keys = cursor_.vertex_keys();
    if (cursor_.is_interior()) return keys;
    around_ = keys;
    fill_missing(around_, int(kVerticesOfClass[Class]));
    return around_;
  }
  // are_here: whether their cursors are at this supercube.
  void split_others(SupercubeKey key, bool are_here, Slot slot, ValueKey value) {
    for (std::size_t i = 0; i < others_.size(); ++i) {
      if (!are_here) others_[i].move_to(key);
      others_[i].gather_keys(slot);
      fronts_[i + 1].split(others_[i], value, tets_left(fronts_, i + 1, max_tets_));
    }
  }
  bool stop(const char* why) {
    wrong_ = why;
    return false;
  }

  const std::span<Front> fronts_;
  const Description& description_;
  const FlagRanges ranges_;
  const std::uint64_t max_tets_;
  RangeDecoder coder_;
  BatchModels models_;
  FrontCursor cursor_;
  std::vector<FrontCursor> others_;  // of the other fronts
  VertexKeys around_{};              // at the border of the box
  std::uint64_t updates_ = 0;
  const char* wrong_ = nullptr;
};

}  // namespace

Result<std::uint64_t> apply_batch(std::span<Front> fronts, const Description& description, const ShownRanges& shown,
                                  std::span<const std::uint8_t> bytes, std::uint64_t max_tets) {
  RangeDecoder coder(bytes);
  const bool is_plain = coder.raw_bits(1) != 0;
  const auto keys = decode_supercubes(coder, is_plain, kBatchUpdatesMost);
  if (!keys) return damaged(keys.error().message.c_str());
  const auto decoder = std::make_unique<BatchDecoder>(fronts, description, shown, coder, is_plain, max_tets);
  for_each_class(
      keys->size(), [&](std::size_t g) { return (*keys)[g]; }, [&](std::size_t g, int cls) { return decoder->take((*keys)[g], cls); });
  if (decoder->wrong() != nullptr) return damaged(decoder->wrong());
  if (!decoder->is_spent()) return damaged("it has more than its updates call for");
  return decoder->updates();
}

}  // namespace intervale

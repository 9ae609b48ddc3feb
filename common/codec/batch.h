// The layout of a batch: updates on the wire. batch_encoder.h writes it and batch_decoder.h applies it.
//
// A batch names supercubes (split_names.h). For each diamond in them that can be split, a flag says whether it is; both
// sides know which diamonds those are. If the diamond is split, the residual of the value at its centre follows. Both
// sides know the values at its vertices, which give the prediction of the value and the context of the flag. Everything
// is range coded. Updates stand in the order in which they are applied: scale by scale from coarse to fine; within
// one scale all of class 0, then class 1, then class 2; then by supercube and slot. PROTOCOL.md has the layout.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/codec/range_coder.h"
#include "common/codec/value_coder.h"
#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "common/patch/key_sides.h"

namespace intervale {

inline constexpr std::size_t kBatchUpdatesMost = 1 << 17;  // in one batch

// Calls visit(group number, class) in the order in which updates are applied; stops when it returns false. key(g): of
// group g. Inlined, so that a coder that visit() refers to may stay in registers.
template <class Key, class Visit>
[[gnu::always_inline]] inline void for_each_class(std::size_t groups, const Key& key, Visit&& visit) {
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

// What the keys at a diamond's vertices tell of its chance to be relevant to a range: 0 if it is for sure; otherwise how
// far its values are from the range's bounds, in comparison with how much they differ, from 1 to kNearness - 1.
inline constexpr int kNearness = 8;
[[nodiscard]] int nearness(const KeySides& sides, Refine refine, const VertexKeys& around, int vertices);
// The same, from the span of those keys.
[[nodiscard]] inline int nearness(const KeySides& sides, Refine refine, const KeySpan& span) {
  const auto low = std::size_t(sides.side(span.least)), high = std::size_t(sides.side(span.greatest));
  constexpr std::int64_t kNone = std::int64_t(1) << 40;
  const std::array<std::int64_t, 4> bound{-kNone, std::int64_t(sides.first_inside()), std::int64_t(sides.first_above()), kNone};
  // How many keys further one of the values would lie on another side.
  const std::int64_t distance = std::min(std::int64_t(span.least) + 1 - bound[low], bound[low + 1] - std::int64_t(span.greatest));
  const std::int64_t spread = std::int64_t(span.greatest) - std::int64_t(span.least) + 1;
  // The octaves by which eight times the distance exceeds the spread.
  const int octaves = int(std::bit_width(std::uint64_t(8 * distance))) - int(std::bit_width(std::uint64_t(spread)));
  const bool is_less = 8 * distance < spread << std::clamp(octaves, 0, kNearness - 1);
  const int near = 1 + std::clamp(octaves - int(is_less), 0, kNearness - 2);
  // Without a branch: whether a diamond is relevant is what the flag is for.
  const bool is_relevant = low != high || (refine == Refine::uniform && low == std::size_t(Side::inside));
  return near & (int(is_relevant) - 1);
}

// The ranges that flags are coded for: those of the view that a batch answers. A diamond is as near to them as to the
// nearest, in whatever order they are and however often each is there.
class FlagRanges {
 public:
  FlagRanges(const ValueFormat& format, const ShownRanges& shown) {
    ranges_.reserve(shown.size());
    for (const ShownRange& one : shown) ranges_.push_back({KeySides(format, one.range), one.refine});
  }
  // span: of the keys at the diamond's vertices.
  [[nodiscard]] int nearness(const KeySpan& span) const {
    int nearest = kNearness;
    for (const One& one : ranges_) nearest = std::min(nearest, intervale::nearness(one.sides, one.refine, span));
    return nearest;
  }

 private:
  struct One {
    KeySides sides;
    Refine refine;
  };
  std::vector<One> ranges_;
};

// The flag whether a diamond that can be split is split. Its model depends on the diamond's class, on nearness(), and on
// the flags of the last three such diamonds.
struct FlagModel {
  std::array<std::array<std::array<BitModel, 8>, kNearness>, 3> model;
  std::array<std::array<unsigned, kNearness>, 3> before{};

  template <class Coder>
  bool code(Coder& coder, int cls, int near, bool value = false) {
    unsigned& last = before[std::size_t(cls)][std::size_t(near)];
    const bool flag = coder.bit(model[std::size_t(cls)][std::size_t(near)][last], value);
    last = (2 * last + unsigned(flag)) & 7;
    return flag;
  }
};

// The flags and values of a batch.
struct BatchModels {
  // Without models: a bit a flag, and as many bits a value as the greatest key has. This bounds what an update takes,
  // however unlike those before it is.
  bool is_plain = false;
  FlagModel flags;
  ValueModels values;
  explicit BatchModels(bool plain = false) : is_plain(plain) {}

  template <class Coder>
  bool code_flag(Coder& coder, int cls, int near, bool value = false) {
    return is_plain ? coder.raw_bits(1, unsigned(value)) != 0 : flags.code(coder, cls, near, value);
  }
  // Like ValueModels::code.
  template <class Coder>
  ValueKey code_key(Coder& coder, int cls, int scale, const PredictedValue& predicted, ValueKey last, ValueKey key = 0) {
    if (!is_plain) return values.code(coder, cls, scale, predicted, key);
    const int bits = std::bit_width(last), low = bits < 16 ? bits : 16;
    const ValueKey high = coder.raw_bits(bits - low, unsigned(std::uint64_t(key) >> low));
    return ValueKey(std::uint64_t(high) << low) | coder.raw_bits(low, key & ((1u << low) - 1));
  }
};

}  // namespace intervale

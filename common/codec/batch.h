// The layout of a batch: updates on the wire. batch_encoder.h writes it and batch_decoder.h applies it.
//
// A batch names supercubes. For each diamond in them that can be split, a flag says whether it is; both sides know
// which diamonds those are. If the diamond is split, the residuals of its side and its cuts follow. Everything is range
// coded, with contexts that both sides know. Updates stand in the order in which they are applied: scale by scale from
// coarse to fine; within one scale all of class 0, then class 1, then class 2; then by supercube and slot. PROTOCOL.md
// has the layout.
#pragma once

#include <array>
#include <cstddef>

#include "common/codec/range_coder.h"
#include "common/diamond/supercube.h"

namespace intervale {

inline constexpr std::size_t kBatchUpdatesMost = 1 << 17;  // in one batch

// Calls visit(group number, class) in the order in which updates are applied; stops when it returns false. key(g): of
// group g.
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

// The flag whether a diamond that can be split is split. Its model depends on the diamond's class, on whether its
// vertices lie on different sides (then it is relevant, and hardly ever left out), and on the flags of the last three
// such diamonds.
struct FlagModel {
  std::array<std::array<std::array<BitModel, 8>, 2>, 3> model;
  std::array<std::array<unsigned, 2>, 3> before{};

  template <class Coder>
  bool code(Coder& coder, int cls, bool mixed, bool is_plain, bool value = false) {
    unsigned& last = before[cls][mixed];
    const bool flag = is_plain ? coder.raw_bits(1, unsigned(value)) != 0 : coder.bit(model[cls][mixed][last], value);
    last = (2 * last + unsigned(flag)) & 7;
    return flag;
  }
};

}  // namespace intervale

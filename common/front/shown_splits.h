// Shows and hides the splits of a front, one at a time and with the ancestors that follow by the rule (front.h). Inside
// the front.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/front/front_cursor.h"
#include "common/front/front_state.h"
#include "common/patch/diamond_context.h"

namespace intervale {

// A slot's bit in the words of a supercube.
constexpr std::uint64_t bit(Slot slot) { return std::uint64_t(1) << slot; }

// Whether a diamond counts for a range. context: of the diamond, with its sides; centre: the side of its centre.
[[nodiscard]] bool counts(const DiamondContext& context, Side centre, Refine refine);
// The same, from the span of the keys at its vertices.
[[nodiscard]] bool counts(const KeySides& sides, const KeySpan& around, Side centre, Refine refine);

// Widens the bounds of a supercube's keys by those of one of its diamonds. around: of the keys at its vertices.
void widen_bounds(const KeySpan& around, ValueKey centre, FrontState::Block& block);

// Nothing may be split while one is in use.
class ShownSplits {
 public:
  explicit ShownSplits(FrontState& state) : state_(state) {}

  // Shows the hidden split of the diamond that the cursor found last, and those of all its ancestors. False, and
  // nothing done, if the mesh would have more than max_tets tetrahedra.
  bool show(FrontCursor& at, std::uint64_t max_tets);
  // Hides the shown split of the diamond that the cursor found last, which has no shown child; then ancestors that do
  // not count and have none.
  void hide(FrontCursor& at);

 private:
  struct Place {
    FrontState::Block* block;
    Slot slot;
  };
  void add_parents(FrontCursor& at, bool shown, std::vector<Place>& places);
  void move_to(const Place& place);
  std::int64_t place_points(FrontCursor& at, const Place& place);
  void hide_one(FrontCursor& at);

  FrontState& state_;
  std::optional<FrontCursor> cursor_;      // over ancestors, once there are some
  const FrontState::Block* at_ = nullptr;  // where it is
};

}  // namespace intervale

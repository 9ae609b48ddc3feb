// Which updates a level of detail wants for their own sake, and which of them matter most. Pure: a function of the data set and what is asked for.
//
// Without a camera an update matters by its field error; with one, by the pixels that the surfaces it moves are off on the screen. Pixels are figured
// once for a supercube, for the nearest of it that is seen.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "common/interval_volume.h"
#include "common/lod.h"
#include "common/view.h"

namespace intervale {

class Ranking {
 public:
  // volume must outlive it; lod: one that check_lod lets pass.
  Ranking(const IntervalVolume& volume, const Lod& lod);

  // 0: not wanted for its own sake. Else what matters more has a higher rank.
  using Rank = std::uint16_t;

  // No lower than that of any update in the brick. O(1).
  [[nodiscard]] Rank of_brick(std::uint32_t brick) const;

  // Of one supercube's updates, by number and slot.
  class Supercube {
   public:
    [[nodiscard]] Rank operator()(UpdateIndex i, int slot) const;

   private:
    friend class Ranking;
    const Ranking& ranking_;
    std::uint32_t supercube_;
    SupercubeKey key_;
    int scale_;
    float pixels_ = 0;  // of one world unit there
    bool central_ = true;
    Supercube(const Ranking& ranking, std::uint32_t supercube, SupercubeKey key) : ranking_(ranking), supercube_(supercube), key_(key) {}
  };
  [[nodiscard]] Supercube of_supercube(std::uint32_t supercube, SupercubeKey key) const;

  // What is left once all of a rank above this one is there: the field error, or the pixels on the screen, that updates of this rank have at most.
  [[nodiscard]] double bound(Rank rank) const;
  // The ranks from the result up to `top` are sent as one: their errors differ by a factor of at most the square root of 2.
  [[nodiscard]] Rank band_below(Rank top) const;

  [[nodiscard]] bool has_camera() const { return view_.has_value(); }

 private:
  // Pixels as ranks: sixteen an octave.
  static constexpr int kRankShift = 23 - 4, kRankFrom = (127 - 64) << 4, kBand = 8, kAside = 4;
  [[nodiscard]] static Rank rank_of(float pixels) {
    const int rank = int(std::bit_cast<std::uint32_t>(pixels) >> kRankShift) - kRankFrom;
    return Rank(rank < kAside + 1 ? kAside + 1 : rank > 0xffff ? 0xffff : rank);
  }
  [[nodiscard]] bool meets_roi(const Diamond& d) const;
  [[nodiscard]] View::Region region_of(SupercubeKey key, std::int32_t cells) const;

  const IntervalVolume& volume_;
  unsigned level_ = 0;  // the lowest level of field error that is wanted
  struct SampleBox {
    std::array<double, 3> min{}, max{};
  };
  std::optional<SampleBox> roi_;  // in samples
  std::optional<View> view_;
  float pixel_error_ = 0;
};

}  // namespace intervale

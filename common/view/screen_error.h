// The deviation of a surface on a camera's screen.
//
// Screen-space error as in Lindstrom et al. 1996 and 3D Tiles: an error in world units divided by the least depth of
// its region, in pixels. Outside the picture it decreases with the angle (as in Ponchio's Nexus), so that a camera that
// turns finds a coarse mesh instead of nothing.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/util/vec3.h"
#include "common/view/lod.h"

namespace intervale {

class ScreenError {
 public:
  // camera: one that check_lod lets pass.
  ScreenError(const Camera& camera, const Grid& grid);

  // An axis-aligned closed box in samples: its middle, and half its side on each axis.
  struct Region {
    Vec3 middle{}, reach{};
  };
  // The pixels of a deviation of one world unit within the region, at most; fewer the further the region is outside the
  // picture. Finite, above 0, and no less than for any region inside this one.
  [[nodiscard]] double pixels_per_unit(const Region& region) const;

  // Many regions, in an order for looking at a block of them at once.
  class Regions {
   public:
    static constexpr std::size_t kBlock = 16;
    // regions: as many as there may be; all within the samples of the grid.
    Regions(const Grid& grid, std::span<const Region> regions);
    [[nodiscard]] std::size_t memory_bytes() const { return blocks_.capacity() * sizeof(Block); }

   private:
    friend class ScreenError;
    // In units of the diagonal of the grid's box, from its middle, along the axes of TurnedAffine.
    struct Block {
      std::array<std::array<float, kBlock>, 3> middle{}, reach{};
    };
    std::vector<Block> blocks_;
    Vec3 middle_{};
    double unit_ = 1;
  };
  // Upper bounds on pixels_per_unit() and seen_share() of the regions of a block, little above them for regions that
  // are in the picture and far away. In floats: at most 2^100.
  struct Bounds {
    std::array<float, Regions::kBlock> pixels{}, share{};
  };
  class RegionBounds {
   public:
    // regions: must outlive it.
    RegionBounds(const ScreenError& screen, const Regions& regions);
    [[nodiscard]] Bounds operator()(std::size_t block) const;

   private:
    using Floats3 = std::array<float, 3>;
    // Of a plane through the eye.
    struct Normal {
      Floats3 of{}, size{};  // size: without signs
    };
    [[nodiscard, gnu::always_inline]] Bounds bounds_of(const Regions::Block& block) const;
    [[nodiscard]] Bounds bounds_of_avx2(const Regions::Block& block) const;
    const Regions& regions_;
    // In units and along axes of the regions.
    Floats3 eye_{};
    Normal ahead_;
    std::array<Normal, 4> inward_;  // of the picture's sides
    float rounding_ = 0;            // of distances, at most
    float least_depth_ = 0, cos_corner_ = 0, scale_ = 0;
  };

  // Whether the region is so near that the pixels a unit of its parts differ by more than a third.
  [[nodiscard]] bool is_near(const Region& region) const;

  // How much of the picture the region's surfaces take, and how large deviations show there, against surfaces that are
  // all seen and at its nearest point: the mean over 3 x 3 x 3 parts of (pixels of a part / pixels_per_unit())^4, where
  // those beside the picture count nothing. A deviation's square grows with the square of its pixels a unit, and so does
  // the area that shows it. At least 1e-6, at most 1.
  [[nodiscard]] double seen_share(const Region& region) const;

 private:
  // The visible part of a region is no nearer than this along the line of sight. at: its middle from the eye; reach: half
  // its sides.
  [[nodiscard]] double least_depth_of(const Vec3& at, const Vec3& reach) const;

  // Everything is seen along the axes that turned_ has, so that a rotation of the world changes nothing. Regions are
  // taken for boxes with sides along them, which they are unless the grid is sheared: then those are larger.
  TurnedAffine turned_;  // of the grid
  Vec3 eye_, ahead_;     // ahead_: of length 1
  struct Side {
    Vec3 inward, edge;  // of one side of the view frustum: its normal, and the direction of its middle line from the eye
  };
  std::array<Side, 4> sides_;
  double scale_ = 0;        // pixels of one unit across, one unit ahead
  double least_depth_ = 0;  // smaller depths count as this
  double cos_corner_ = 0;   // of the angle between the line of sight and the picture's corners
};

// The region of the diamonds of a cube of `cells` supercubes a side, of which this key's is the lowest; clipped to the
// samples.
[[nodiscard]] ScreenError::Region region_of(const Domain& domain, SupercubeKey key, std::int32_t cells);

}  // namespace intervale

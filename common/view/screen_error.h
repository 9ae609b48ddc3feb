// How far off a surface looks on a camera's screen.
//
// Screen-space error as in Lindstrom et al. 1996 and 3D Tiles: an error in world units, over the least depth of where it lies, in pixels. Beyond the
// edges of the picture it fades with the angle (Ponchio and Hormann's Nexus), so that a camera that turns finds a coarse mesh, not none.
#pragma once

#include <array>

#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/view/lod.h"

namespace intervale {

class View {
 public:
  // camera: one that check_lod lets pass.
  View(const Camera& camera, const Grid& grid);

  // An axis-aligned box in samples, closed: its middle, and how far it reaches from there on each axis.
  struct Region {
    std::array<double, 3> middle{}, reach{};
  };
  // Pixels that a deviation of one world unit within the region shows as, at most; less the further the region is outside the picture. Finite, above
  // 0, and no less than those of any region inside it.
  [[nodiscard]] double pixels_per_unit(const Region& region) const;

  // Whether it takes up so much of the view that its parts look of different sizes: by more than a third.
  [[nodiscard]] bool is_near(const Region& region) const;

  // Whether the middle of the region lies in the middle of the picture: within half its width and half its height.
  [[nodiscard]] bool is_central(const Region& region) const;

 private:
  using Vector = std::array<double, 3>;
  Vector origin_, spacing_;          // of the grid
  Vector eye_, right_, up_, ahead_;  // the camera's axes have length 1
  struct Side {
    Vector inward, edge;  // of a side of what it sees: the normal, and the line in its middle, away from the eye
  };
  std::array<Side, 4> sides_;
  double scale_ = 0;              // pixels of one unit across, one unit ahead
  double least_depth_ = 0;        // nothing is taken to be nearer
  double tan_x_ = 0, tan_y_ = 0;  // of half the angles of view
  double cos_corner_ = 0;         // of the angle between the line of sight and the picture's corners
};

// Where the diamonds of a cube of `cells` supercubes a side lie, from that with this key on, as far as there are samples.
[[nodiscard]] View::Region region_of(const Domain& domain, SupercubeKey key, std::int32_t cells);

}  // namespace intervale

// What hides what: a coarse picture of how far a camera sees, drawn by the client from the mesh that it has, and looked at
// by the server to send last what lies behind it.
//
// N. Greene, M. Kass, G. Miller, Hierarchical Z-Buffer Visibility, SIGGRAPH 1993.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/diamond/grid.h"
#include "common/util/result.h"
#include "common/util/vec3.h"
#include "common/view/lod.h"
#include "common/view/screen_error.h"

namespace intervale {

// Depths are distances along the line of sight, in world units. The picture is divided into cells of one size.
struct DepthMap {
  static constexpr int kMaxSide = 64;             // cells
  static constexpr std::uint8_t kLastCode = 254;  // of the farthest depth; 0: the nearest
  static constexpr std::uint8_t kOpenCode = 255;  // there is no surface in a part of the cell
  int width = 0, height = 0;                      // cells, 1 to kMaxSide
  double nearest = 1, farthest = 1;               // 0 < nearest <= farthest, finite
  // Of each cell, from the top left one on, row by row: the farthest surface that is seen in it, as the logarithm of its
  // depth between those two, rounded up.
  std::vector<std::uint8_t> codes;

  [[nodiscard]] double depth_of(std::uint8_t code) const;  // not of kOpenCode
  friend bool operator==(const DepthMap&, const DepthMap&) = default;
};

// Fails if a number is out of its bounds.
[[nodiscard]] Result<void> check_depth_map(const DepthMap& map);

// A client sends a map once it has this many updates, and again whenever it has twice as many as at the last.
inline constexpr std::uint64_t kDepthMapUpdates = 1000;

// Draws a depth map: triangles with a depth buffer, 2 x 2 samples a cell.
class DepthBuffer {
 public:
  explicit DepthBuffer(const Camera& camera);  // one that check_lod lets pass

  // World coordinates. Both sides hide what is behind. A triangle that reaches behind the eye is left out: it hides
  // nothing.
  void draw(const std::array<Vec3, 3>& triangle);
  // Nothing was drawn: every cell is open.
  [[nodiscard]] DepthMap map() const;

 private:
  static constexpr int kSamples = 2;  // a side of a cell
  Vec3 eye_, right_, up_, ahead_;
  int columns_ = 0, rows_ = 0;        // samples
  double scale_x_ = 0, scale_y_ = 0;  // samples of one unit across, one unit ahead
  std::vector<float> nearness_;       // by sample: 1 / depth of the nearest surface; 0: none
};

// Whether regions of samples are hidden behind the surfaces of a depth map.
class Occlusion {
 public:
  // map: one that check_depth_map lets pass, of this camera, which check_lod lets pass.
  Occlusion(const DepthMap& map, const Camera& camera, const Grid& grid);

  // Whether all of the region that is in the picture lies behind the surfaces, by half its own diagonal at least: the
  // mesh of the map is coarse. Then so does each region inside this one. False for one that reaches the eye.
  [[nodiscard]] bool hides(const ScreenError::Region& region) const;
  [[nodiscard]] std::size_t memory_bytes() const;  // besides this object

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<std::uint8_t> codes;  // by cell, the greatest
  };
  TurnedAffine turned_;  // of the grid, as in ScreenError
  Vec3 eye_, right_, up_, ahead_;
  double scale_x_ = 0, scale_y_ = 0;  // cells of one unit across, one unit ahead
  std::array<float, 256> depth_{};    // by code; infinite where it is open
  std::vector<Level> levels_;         // each has cells of twice the side of those before, and ends with a single one
};

}  // namespace intervale

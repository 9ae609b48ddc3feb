// Where a camera goes, from its last two views.
#pragma once

#include <chrono>
#include <optional>

#include "common/view/lod.h"

namespace intervale {

// A camera that moves, and where it will be if it goes on so.
struct CameraAhead {
  Camera camera;                                // like that of the view
  std::chrono::steady_clock::time_point until;  // then it has rested: it will not be there
  friend bool operator==(const CameraAhead&, const CameraAhead&) = default;
};

// Straight on, by the distance that the eye and the point that it looks at move in kTime: a round trip and what waits on
// the way to the client, some views of a drag. Less if that would turn the camera, or move it, so far that little of the
// picture would be the same.
class CameraMotion {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kTime{250};
  static constexpr double kMostTurn = 0.25;   // radians between the lines of sight
  static constexpr double kMostShift = 0.25;  // of the distance to the point that is looked at

  // Takes the camera of the next view. Nothing if it is the first, if the last one is longer ago than kTime, as the camera
  // has rested then, if it jumped, or if more than its place and direction changed.
  [[nodiscard]] std::optional<CameraAhead> next(const Camera& camera, Time now);

 private:
  struct Seen {
    Camera camera;
    Time at;
  };
  std::optional<Seen> last_;
};

}  // namespace intervale

// What a viewer draws while the camera moves, if a picture of the whole mesh takes too long: surfaces of coarser meshes.
// They are without cracks, as all meshes are.
#pragma once

#include <cstdint>
#include <deque>

#include "client/core/stream_client.h"
#include "client/view/drawn_range.h"
#include "common/front/front.h"

namespace intervale {

class StandIn {
 public:
  // Of a client's meshes as they are, which may change later. Leaves out about as few of the finest levels as it takes
  // for all surfaces together to have no more triangles than `most`, or all levels. full: the triangles of the surfaces
  // of the meshes themselves. O(the client's splits) for each guess of the number of levels, which is a few.
  StandIn(const StreamClient& client, std::uint64_t full, std::uint64_t most);
  StandIn(const StandIn&) = delete;
  StandIn& operator=(const StandIn&) = delete;

  [[nodiscard]] std::uint64_t triangles() const;
  // One for each range, updated without values.
  [[nodiscard]] std::deque<DrawnRange>& ranges() { return ranges_; }

 private:
  void make(const StreamClient& client, int levels);
  std::deque<Front> fronts_;  // which the ranges refer to
  std::deque<DrawnRange> ranges_;
};

}  // namespace intervale

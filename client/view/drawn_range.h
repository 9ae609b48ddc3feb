// What a viewer draws of one range: the boundary surface of its mesh, or of a coarser mesh that stands in for it while
// the range changes from moment to moment.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/core/stream_client.h"
#include "client/view/boundary_surface.h"
#include "common/patch/description.h"

namespace intervale {

class DrawnRange {
 public:
  explicit DrawnRange(const Front& front) : exact_(front) {}  // which must outlive it
  // The surfaces refer to fronts; nothing may move.
  DrawnRange(const DrawnRange&) = delete;
  DrawnRange& operator=(const DrawnRange&) = delete;

  // From the next update on: the front's mesh, or that of another range, made without this number of its finest levels
  // (coarse_front.h). client: whose front it is.
  void use_exact() { coarse_.reset(); }
  void use_coarse(const StreamClient& client, int levels, const ShownRange& shown);

  // Which values() an update makes: the field's, or those of a channel of the client, if it is not null.
  struct WantedValues {
    const ChannelValues* channel = nullptr;
  };
  // What changed since the last update, or everything.
  [[nodiscard]] BoundarySurface::Change update(bool all, const std::optional<WantedValues>& wanted);
  // As of the last update; see BoundarySurface.
  [[nodiscard]] SurfacePiece piece(std::uint32_t id, bool edges) { return changing().piece(id, edges); }
  [[nodiscard]] double volume_bound() { return changing().volume_bound(); }
  [[nodiscard]] const BoundarySurface& surface() const { return coarse_ ? coarse_->surface : exact_; }
  [[nodiscard]] const std::vector<float>& values() const { return values_; }  // by PointId; empty: not wanted

 private:
  [[nodiscard]] BoundarySurface& changing() { return coarse_ ? coarse_->surface : exact_; }

  struct Coarse {
    Coarse(const StreamClient& client, int levels);
    int left_out;  // levels
    Front front;
    BoundarySurface surface;
  };
  BoundarySurface exact_;
  std::optional<Coarse> coarse_;
  bool coarse_is_drawn_ = false;  // by the last update
  std::vector<float> values_;
};

}  // namespace intervale

// Meshes that grow with the batches of a stream, one for each range that is shown. No I/O; the client never has the field.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client/core/budget.h"
#include "common/front/channel_values.h"
#include "common/front/front.h"
#include "common/mesh/join.h"
#include "common/mesh/mesh.h"
#include "common/patch/description.h"
#include "common/util/result.h"

namespace intervale {

// The most that a client keeps.
struct Budget {
  std::uint64_t max_tets = ~std::uint64_t(0);  // in its mesh, or in all of them
  // In the mesh or hidden, some 15 bytes each for each range that is shown; the server learns it as View::room.
  std::uint64_t max_updates = ~std::uint64_t(0);
  friend bool operator==(const Budget&, const Budget&) = default;
};

class StreamClient {
 public:
  // Checks everything in a description from outside, and that the data set has what is to be shown (misuse). Each mesh
  // is then the patch of the root.
  static Result<StreamClient> start(Description description, const Budget& budget = {}, const RangeRequest& shown = {});

  // Applies one batch: the payload of a Batch, the epoch of its view, and what that view shows. The meshes are conforming
  // after each successful call. A payload that is damaged, or does not fit the batches before it, is an error; this
  // object must not be used again then. Updates that the meshes have no room for within max_tets are kept, but hidden:
  // those that came last or, once look() was called, the least important ones.
  // channels: of a batch with values, that part of it and the numbers of the channels that its view names.
  struct ChannelPart {
    std::span<const std::uint8_t> bytes;
    std::span<const std::size_t> numbers;
  };
  Result<void> apply(std::span<const std::uint8_t> payload, std::uint64_t epoch = 0, const RangeRequest& shown = {},
                     const ChannelPart& channels = {});

  // What the meshes show from now on, of the updates that are here: the i-th is that of the i-th range. Fails, and
  // changes nothing, if the data set has not all of it. Linear in the updates for each mesh that shows another range.
  Result<void> show(const RangeRequest& shown);

  // Where the mesh is seen from now on. camera: one that check_lod accepts. region: likewise; outside it the meshes are
  // only as fine as conformity requires, and what is here beyond that is kept, but hidden. Linear in the updates if there
  // is a region, or was one.
  void look(const Camera& camera, const std::optional<Box>& region = {});
  // Hides what has arrived from outside the region since look(), or since the last call. Not linear in the batch: for
  // when a view is complete.
  void settle() {
    if (region_) rebalance();
  }

  // Takes effect at once; but a lower max_updates only with the first answer to the view of this epoch, since the
  // server fills the old one until it has that view.
  void set_budget(const Budget& budget, std::uint64_t epoch);

  // The least important updates, of at most max_supercubes supercubes: what the View of this epoch is to forget so that
  // a quarter of max_updates is free for what it wants. Empty while so much is free, before the answer to an earlier
  // View that forgets, and before look(). The updates stay until arrived(epoch): batches on their way were encoded for
  // a client that has them.
  [[nodiscard]] std::vector<SlotGroup> give_up(std::uint64_t epoch, std::size_t max_supercubes);
  // A Done or a Batch of this epoch has arrived. apply() does the same.
  void arrived(std::uint64_t epoch);

  // Some updates have no room in a mesh, or the patches of the root alone exceed max_tets.
  [[nodiscard]] bool over_budget() const { return updates_left_out() > 0 || tet_count() > budget_.max_tets; }
  [[nodiscard]] std::uint64_t updates() const { return fronts_[0].split_count(); }  // in the meshes or hidden
  // Of those, the ones that a mesh is made with: those that count for its range, as far as there is room, and their
  // ancestors. Here and in the next two, the sum of all meshes.
  [[nodiscard]] std::uint64_t updates_in_mesh() const { return sum(&Front::shown_count); }
  [[nodiscard]] std::uint64_t updates_left_out() const { return sum(&Front::withheld_count); }  // for want of room, or outside the region
  [[nodiscard]] std::uint64_t tet_count() const { return sum(&Front::tet_count); }              // O(1)
  [[nodiscard]] const Description& description() const { return description_; }
  // The updates that another session resumes with; see Front::splits. None of them is given up any more.
  [[nodiscard]] std::vector<SlotGroup> resume() {
    forget_.clear();
    return fronts_[0].splits();
  }
  // One for each range that is shown, in its order. Each stays where it is as long as there are as many ranges.
  [[nodiscard]] const std::vector<Front>& fronts() const { return fronts_; }
  [[nodiscard]] const Front& front() const { return fronts_[0]; }
  // Likewise, with the channels that a view named last; linear in their size.
  [[nodiscard]] std::vector<Mesh> meshes() const;
  // Of the data set, with the values that are here.
  [[nodiscard]] const std::vector<ChannelValues>& channels() const { return channels_; }
  // The channels that meshes() brings along: numbers of the data set's.
  void show_channels(std::vector<std::size_t> numbers) { shown_channels_ = std::move(numbers); }
  [[nodiscard]] Mesh mesh() const { return joined(meshes()); }  // all of them as one

 private:
  StreamClient(Description description, std::vector<Front> fronts, const Budget& budget)
      : description_(std::move(description)), fronts_(std::move(fronts)), budget_(budget) {
    for (const Channel& channel : description_.channels) channels_.emplace_back(description_.grid, channel);
  }
  [[nodiscard]] std::uint64_t sum(std::uint64_t (Front::*count)() const) const;
  void rebalance();
  void show_all();
  bool forget(std::uint64_t epoch);
  void keep_to_budget(std::uint64_t epoch);
  Description description_;
  std::vector<Front> fronts_;  // with the same splits; room for kMaxRanges, so that none moves
  std::vector<ChannelValues> channels_;
  std::vector<std::size_t> shown_channels_;
  Budget budget_;
  struct LessRoom {
    std::uint64_t epoch = 0, max_updates = 0;
  };
  std::optional<LessRoom> less_room_;
  Importance importance_;           // empty before look()
  std::optional<SeenBox> region_;   // of look()
  std::vector<SlotGroup> forget_;   // to be forgotten with the first answer to
  std::uint64_t forget_epoch_ = 0;  // ... the view of this epoch
};

}  // namespace intervale

// Selects what a session sends next. What follows from the data set, the level of detail and the updates sent; the
// order, a little, from the views before, too (begin_band()). No I/O.
//
// Updates are sent in bands of falling rank (ranking.h): within a band, importances differ by a factor of 4, or by more
// where next to nothing was found. The last band takes all that is left once that is little. Within a band they are
// sent region by region, each after its missing ancestors: neighbours share names and code tables, which makes the
// batch smaller. Bounds of the unsent updates are kept for each brick and supercube that something was sent of (those
// of others are of all that is relevant), and a brick is visited only if its bound is in the band. Bricks are ranked
// only where their run may be in the band, too: a new view costs O(bricks / 64), and then the work for what it sends.
// What a brick needs may be found only then (relevant_updates.h). Bounds outlive ranges, too: where one end of a range
// moves, they are raised to those of its new surface, and only bricks that this one crosses are looked at again.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/budget_search.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/ranking.h"
#include "common/selection/supercube_bounds.h"
#include "common/util/bits.h"
#include "common/util/paged_array.h"
#include "common/util/sparse_array.h"
#include "common/view/lod.h"

namespace intervale {

// A batch of updates, parents before children.
struct Batch {
  std::vector<std::uint8_t> payload;  // see common/codec/batch.h; empty if there are no updates
  std::uint32_t updates = 0;
  std::vector<std::uint8_t> channels;  // their values (common/codec/channel_batch.h); empty if there are none
};

// Bound on the payload of a view's next batch, after `sent` bytes of payload. The first batch is small, so that there
// is a mesh to draw soon; each further one about doubles what was sent, since a batch takes about a third of its bound.
// So a client that has room for n bytes shows what fits into n / 2 at least.
inline constexpr std::size_t kFirstPayload = 4 << 10;
// The same of a view that shows other ranges of what the client has: there is a mesh already. What is missing lies in
// many places, so that names are a third of small batches; such a batch takes some 6 to 16 kB.
inline constexpr std::size_t kFirstPayloadOfRange = 128 << 10;
[[nodiscard]] constexpr std::size_t next_payload(std::size_t sent, std::size_t most, std::size_t first = kFirstPayload) {
  return std::clamp(3 * sent, std::min(first, most), most);
}

// The stream of one session over one data set. One thread at a time. Memory besides the data set: a byte for each two
// bricks; six bytes for each of 64 bricks of which one was ranked and has something that is wanted and not sent; twenty
// for each brick that something was sent of; two for each supercube that something was sent of (twelve with
// max_updates, two more for each channel); and for each supercube whose unsent updates matter less than all of it two
// bytes, or three if distances are known.
class StreamPlan {
 public:
  static constexpr std::uint32_t kMostVisits = 1 << 19;

  // At first everything that the range of the data set needs is relevant.
  explicit StreamPlan(std::shared_ptr<const IntervalVolume> volume);

  // Whether the data set has these updates.
  [[nodiscard]] bool has(const SlotGroup& updates) const;

  // Marks the updates that a resuming client has as sent: slots of a supercube. False if the data set has no such
  // updates. Before the first set_lod(). If ancestors are missing, the client cannot use the updates; the server is
  // not affected.
  bool resume(SupercubeKey key, std::uint64_t slots);
  // After some of that, and of the same for channels: what is kept of it takes less memory.
  void settle();
  // The same for all updates that another plan has sent: one of this data set, or of coarser scales of it.
  void resume(const StreamPlan& other);

  // Marks updates that the client forgets as not sent: those of the groups that Front::forget() removes, too. False,
  // without any change, if the data set has no such updates. groups: keys strictly ascending. Before the set_lod() of
  // the same view.
  bool forget(std::span<const SlotGroup> groups);

  // Drops what is known of the updates that were not sent, until the next set_lod(), which finds it again: for a client
  // that has all it wants, and may not ask for more. Until then there is nothing to send.
  void rest();
  [[nodiscard]] bool rests() const { return rests_; }

  // The most updates that the client holds.
  void set_room(std::uint64_t updates) { room_ = updates; }

  // Replaces the ranges that are looked at: updates that are not relevant to them are not sent, nor any twice.
  // relevant: of this volume. Before the set_lod() of the same view. O(bricks / 64), and O(bricks that something was
  // sent of).
  void set_relevant(const std::shared_ptr<const RelevantUpdates>& relevant) { set_relevant(relevant, relevant->shown()); }
  // The same for a client that shows other ranges: batches are coded for those.
  void set_relevant(std::shared_ptr<const RelevantUpdates> relevant, ShownRanges shown);

  // Replaces the channels that are wanted, by number, ascending: their values go with all updates from now on, and
  // before those to the updates that were sent already. O(1) if those have them.
  void set_channels(std::span<const std::size_t> numbers);
  // Like resume(): the client has the values of a channel at these updates, which it has, too. channel: a number of the
  // data set's.
  bool resume(std::size_t channel, SupercubeKey key, std::uint64_t slots);

  // Replaces the level of detail; check_lod(lod) must hold. hidden: a depth map of its camera; what lies behind is sent
  // last. ahead: where the camera will be soon; another order of the same updates. O(bricks / 64). The search of an
  // equal level of detail goes on.
  void set_lod(const Lod& lod, const DepthMap* hidden = nullptr, const Camera* ahead = nullptr);

  // The search for what is within max_updates, which is to be done before the next batch; nullptr: none. Another thread
  // may go on with it; otherwise next() does.
  [[nodiscard]] const std::shared_ptr<BudgetSearch>& search() const { return search_; }

  // The next batch. nullopt when everything is sent, or when the search has taken long enough for one call: done()
  // tells which. max_bytes, at least 256, bounds the payload with its channels before compression, which takes about
  // half of it. max_visits: of supercubes and updates, after which the batch ends, or three times as many that find
  // nothing to send; 2^13 take about a third of a millisecond. Few cut what a drag of a range needs, a few updates in
  // many places, into small batches that name the same supercubes again.
  std::optional<Batch> next(std::size_t max_bytes, std::uint32_t max_visits = kMostVisits);
  // A batch that says only how much is left.
  [[nodiscard]] Batch no_updates() const;
  [[nodiscard]] bool done() const { return !search_ && !lacks_values() && !has_more(); }
  // More is wanted than the client may hold.
  [[nodiscard]] bool is_full() const { return pending_bricks_ != 0 && sent_count_ >= room_; }

  [[nodiscard]] std::uint64_t sent() const { return sent_count_; }  // updates that the client holds
  [[nodiscard]] const SplitSet& held() const { return sent_; }      // which they are
  // Upper bounds over the updates that are wanted (not only as ancestors) and not sent; 0 when everything is sent.
  struct Remaining {
    std::uint64_t updates = 0;
    double error = 0;   // field units
    double pixels = 0;  // on the camera's screen; 0 without one
  };
  [[nodiscard]] Remaining remaining() const;
  [[nodiscard]] std::size_t memory_bytes() const;  // besides the data set and what is relevant

 private:
  // A channel, and the updates that the client has its values of.
  struct SentChannel {
    SplitSet held;
    std::uint64_t count = 0;
  };
  // When less than one in so many of the updates that the client has is left to send, their order changes little.
  static constexpr std::uint64_t kRest = 16;
  static constexpr std::size_t kBrickBytes = 18;     // most bytes that name a brick
  static constexpr std::size_t kSupercubeBytes = 7;  // flags, or a mask of slots
  static constexpr std::size_t kPlaneBytes = 64;     // lengths, and the ends of what is coded
  // Updates are wanted, and there is room for them.
  [[nodiscard]] bool has_more() const { return pending_bricks_ != 0 && !is_full(); }
  // Some updates were sent without a value that is wanted now.
  [[nodiscard]] bool lacks_values() const;
  std::optional<Batch> next_values(std::size_t max_bytes);
  [[nodiscard]] std::vector<std::uint8_t> send_values(std::span<const SlotGroup> groups, std::vector<std::uint8_t> names);
  using Rank = Ranking::Rank;
  struct BatchBuilder;
  // A non-negative float in 16 bits, rounded up by at most 1 %.
  struct Up16 {
    std::uint16_t bits = 0;
    Up16() = default;
    explicit Up16(float value) : bits(std::uint16_t((bits_as<std::uint32_t>(value) + 0xffff) >> 16)) {}
    explicit operator float() const { return bits_as<float>(std::uint32_t(bits) << 16); }
  };
  // What a view looks at of a brick.
  struct Viewed {
    std::uint16_t rank : 15 = 0;     // of the unsent updates that are wanted; 0: there are none
    std::uint16_t is_loose : 1 = 0;  // the rank may be much too high; see refine()
    Up16 pixels;                     // of those, on the camera's screen; 0 without one
    std::uint16_t wanted = 0;        // bound on their number
  };
  static_assert(sizeof(Viewed) == 6 && Ranking::kRankBits <= 15);
  // The unsent relevant updates of a brick, which has at most 64 * kSlots. The bounds are upper bounds.
  struct Pending {
    std::uint16_t unsent : 12 = 0;  // at most so many
    std::uint16_t slope : 4 = 0;
    std::uint8_t error_step = 0;
    std::uint8_t limit = 0;  // a code: `slope` is of those whose object errors are above its distance
    Up16 object_error;
    std::uint16_t slope_below = 0;
    void set_unsent(unsigned count) { unsent = count & 0xfffU; }
    void raise_to(const Highest& highest, float object_error);
    void lower_to(const Highest& highest, float object_error);
  };
  static_assert(sizeof(Pending) == 8);
  // What is not in pending_ is as it is known of all relevant updates, of which none was sent.
  [[nodiscard]] Pending pending(BrickIndex brick) const {
    const auto found = pending_.find(brick);
    return found ? bits_as<Pending>(*found) : first_pending(relevant_->bound(brick));
  }
  [[nodiscard]] static Pending first_pending(const RelevantUpdates::Bound& bound);
  void keep(BrickIndex brick, const Pending& pending);
  [[nodiscard]] Ranking::Left left(const Pending& pending) const {
    return {pending.error_step, float(pending.object_error), pending.slope, relevant_->distance(pending.limit), pending.slope_below};
  }
  // A supercube, and what its brick needs.
  struct InBrick {
    BrickNeeds needs;
    std::size_t number = 0;  // of the supercube in the brick
    int scale = 0;
    float limit = 0;  // of the brick
  };
  // What a view looks at of a run of bricks that were not ranked.
  struct ViewedRun {
    Rank rank = 0;  // of its updates that are wanted; 0: there are none, or its bricks were ranked
    Up16 pixels;
  };
  // Keeps what is pending, of which so many are wanted.
  void set_pending(BrickIndex brick, Pending pending, Rank rank, unsigned wanted);
  [[nodiscard]] InBrick in_brick(BrickIndex brick, SupercubeIndex s) const;
  [[nodiscard]] std::uint64_t relevant_slots(BrickIndex brick, SupercubeIndex s) const {
    return relevant_->brick(brick).slots(s - volume_->set().bricks()[brick].first_supercube, volume_->set().occupancy()[s]);
  }
  // of_supercube: what is known there.
  [[nodiscard]] Highest of_update(const InBrick& in, UpdateIndex i, const BrickNeeds::OfSupercube& of_supercube, Slot slot) const {
    const BrickNeeds::OfUpdate known = of_supercube(slot);
    Highest own{std::uint8_t(volume_->error_step(i)), known.distance, known.slope};
    if (object_error(in, own) <= in.limit) std::swap(own.slope, own.slope_below);
    return own;
  }
  [[nodiscard]] float object_error(const InBrick& in, const Highest& highest) const {
    if (relevant_->has_distances()) return relevant_->distance(highest.distance);
    return relevant_->object_error(in.needs.to_distance(in.number), in.scale, highest.error_step);
  }
  // Bounds of all supercubes of a brick. Those that are not kept are those of their relevant updates.
  struct Bounds : SupercubeBounds::OfBrick {
    bool has_changed = false;  // since it was read
    // number: of the supercube in the brick.
    void set(std::size_t number, const Highest& to);
    void drop(std::size_t number);  // nothing is relevant there any more
  };
  [[nodiscard]] Bounds bounds_of(BrickIndex brick, const BrickNeeds& needs) const;
  RelevantUpdates::PartMask find_new_parts(const RelevantUpdates* before);
  void drop_bounds();
  void keep(BrickIndex brick, const Bounds& bounds);
  void move_limit(const Ranking::Brick& ranking, Pending& pending, Bounds& bounds) const;
  void rank_runs();
  void rank_bricks(std::size_t run);
  void rank_block(std::size_t begin, const Ranking::BlockBounds& bounds);
  // Lowers a loose rank to that which Ranking::of_brick() tells.
  void refine(BrickIndex brick, const Ranking::Brick& ranking);
  void begin_band();
  // Upper bounds over updates that were visited and not sent.
  struct Unsent {
    Rank rank = 0;
    unsigned wanted = 0;
    Highest highest;
    void raise(const Unsent& other) {
      rank = std::max(rank, other.rank);
      wanted += other.wanted;
      highest.raise(other.highest);
    }
  };
  bool visit_brick(BrickIndex brick, BatchBuilder& builder);
  void lower(const InBrick& in, std::uint64_t occupancy, std::uint64_t unsent, Highest& highest) const;
  std::optional<Unsent> visit_supercube(const Ranking::Brick& brick, const InBrick& in, const Place& first, std::uint64_t unsent,
                                        const Highest& highest, BatchBuilder& builder);
  bool add_band(const Ranking::Supercube& ranking, const InBrick& in, const Place& place, std::uint64_t candidates, BatchBuilder& builder,
                Unsent& rest);
  bool add_with_ancestors(const Place& place, SetNeighbours& around, BatchBuilder& builder);
  bool add(const Place& place, BatchBuilder& builder);
  bool add_all(const SlotGroup& group, BatchBuilder& builder);
  void put(const SlotGroup& updates, BatchBuilder& builder);
  [[nodiscard]] bool has_room(const BatchBuilder& builder, std::size_t updates) const;

  std::shared_ptr<const IntervalVolume> volume_;
  std::shared_ptr<const RelevantUpdates> relevant_;  // not null
  ShownRanges shown_;                                // that batches are coded for
  SplitSet sent_;
  std::vector<ViewedRun> viewed_runs_;
  PagedArray<Viewed, RelevantUpdates::kRun> viewed_;  // by brick; those whose rank is 0 may be as at first
  SparseArray<std::uint64_t> pending_;                // by brick, the bits of Pending
  SupercubeBounds supercube_bounds_;                  // of unsent updates, where they are not those of the relevant ones
  // How often relevant_ was replaced since what is known of unsent updates was dropped; and by part of it, when it
  // came.
  std::uint8_t time_ = 0;
  std::array<std::uint8_t, BrickNeeds::kMostParts> part_since_{};
  std::vector<SentChannel> channels_;         // of the data set
  std::vector<std::size_t> wanted_channels_;  // ascending
  std::uint32_t next_lacking_ = 0;            // bricks before this one lack no value that is wanted
  std::optional<Ranking> ranking_;
  std::shared_ptr<BudgetSearch> search_;  // with max_updates, until its result is taken
  std::optional<SplitSet> budget_;        // then: the updates within the budget
  std::optional<Lod> searched_;           // that both are of
  std::uint64_t sent_count_ = 0, wanted_count_ = 0, room_ = ~std::uint64_t(0);
  std::uint32_t pending_bricks_ = 0;                  // bricks, and runs of them, whose rank is not 0
  Rank band_ = 0;                                     // the lowest rank of the current band
  int band_width_ = 1;                                // see Ranking::band_below()
  std::uint64_t band_visits_ = 0, band_updates_ = 0;  // what was looked at for it, and found
  std::uint32_t next_brick_ = 0;                      // bricks below this one are left of the band
  bool rests_ = false;                                // since the last view
};

}  // namespace intervale

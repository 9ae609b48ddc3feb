// What a session sends next: a pure function of the data set, what was asked for and what was sent. No I/O.
//
// Updates go out in bands of falling rank (ranking.h): errors within one differ by a factor of 2 on the screen, of 4 without a camera. Within a band
// they go region by region, each with the ancestors it still lacks: neighbours share names and code tables, and a batch is small for what it holds. A
// brick is looked into only when its turn comes, and what was found there is kept, so a new view costs a glance at each brick, and then what it
// sends.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/diamond/surroundings.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/ranking.h"
#include "common/view/lod.h"

namespace intervale {

// A batch of updates, parents before children, as the client's StreamClient::apply takes it.
struct Batch {
  std::vector<std::uint8_t> payload;  // update_codec.h
  std::uint32_t updates = 0;
};

// The first batch is small, so that there is something to draw soon; each is twice the last, up to where a larger one gains nothing.
inline constexpr std::size_t kFirstPayload = 8 << 10;

// The stream of one session over one data set. One thread at a time. Beside the data set it takes one bit for each update, a byte for each supercube
// and ten for each brick. Another bit for each update while there is a budget of updates.
class StreamPlan {
 public:
  explicit StreamPlan(std::shared_ptr<const IntervalVolume> volume);

  // Takes for sent what the client says it has: slots of a supercube. False if the data set has no such updates. Before the first set_lod. What has
  // not all its ancestors among them is the client's own trouble.
  bool resume(SupercubeKey key, std::uint64_t slots);

  // Takes for not sent what the client gives up: Front::forget says which of these that is. False, and nothing done, if the data set has no such
  // updates. groups: keys strictly ascending. Before the set_lod of the view that asks for it.
  bool forget(std::span<const SlotGroup> groups);

  // The client keeps no more updates than this.
  void set_room(std::uint64_t updates) { room_ = updates; }

  // Replaces what is wanted. lod: one that check_lod lets pass. What was sent stays sent, but for what forget() took back. O(bricks); with
  // max_updates O(updates).
  void set_lod(const Lod& lod);

  // The next batch. Nothing when all that is wanted has been sent, and when the search for more has taken long enough for one turn: done() tells.
  // max_bytes, at least 256, bounds the payload as it would be if nothing could be compressed; it is about half of that.
  std::optional<Batch> next(std::size_t max_bytes);
  [[nodiscard]] bool done() const { return pending_bricks_ == 0 || is_full(); }
  [[nodiscard]] bool is_full() const { return pending_bricks_ != 0 && sent_count_ >= room_; }  // there is no room for what is wanted

  [[nodiscard]] std::uint64_t sent() const { return sent_count_; }  // updates that the client has, in all
  // Of what is wanted for its own sake and not yet sent. All are bounds from above, and 0 when all has been sent.
  struct Remaining {
    std::uint64_t updates = 0;
    double error = 0;   // field units
    double pixels = 0;  // on the camera's screen; 0 without one
  };
  [[nodiscard]] Remaining remaining() const;

 private:
  using Rank = Ranking::Rank;
  struct BatchBuilder;
  // A number that is not negative, rounded up by at most a hundredth.
  struct Up16 {
    std::uint16_t bits = 0;
    Up16() = default;
    explicit Up16(float value) : bits(std::uint16_t((std::bit_cast<std::uint32_t>(value) + 0xffff) >> 16)) {}
    explicit operator float() const { return std::bit_cast<float>(std::uint32_t(bits) << 16); }
  };
  // Of a brick. No brick has more updates than 64 * kSlots.
  struct Pending {
    Rank rank = 0;             // no lower than that of any update wanted and not sent; 0: there is none
    std::uint16_t unsent = 0;  // updates
    std::uint16_t wanted = 0;  // of those, at most
    std::uint16_t level = 0;   // of error: no lower than that of any not sent
    Up16 object_error;         // no less than that of any not sent
  };
  void set_pending(std::uint32_t brick, Rank rank, unsigned wanted);
  void begin_band();
  bool visit_brick(std::uint32_t brick, BatchBuilder& builder);
  // Of a supercube, after a look.
  struct Left {
    bool full = false;  // the batch is: the rest is not known
    Rank most = 0;
    unsigned wanted = 0, level = 0;
  };
  Left visit_supercube(const Ranking::Supercube& ranking, Place place, std::uint64_t occupancy, std::uint64_t may_be_sent, BatchBuilder& builder);
  bool add_with_ancestors(const Place& place, Surroundings& around, BatchBuilder& builder);
  bool add(const Place& place, BatchBuilder& builder);

  std::shared_ptr<const IntervalVolume> volume_;
  SplitSet sent_;
  std::vector<Pending> pending_;           // by brick
  std::vector<std::uint8_t> half_levels_;  // by supercube: of what is not sent, IntervalVolume::half_of_level() or more
  std::optional<Ranking> ranking_;
  std::optional<SplitSet> budget_;  // with a budget of updates: those within it
  std::uint64_t sent_count_ = 0, wanted_count_ = 0, room_ = ~std::uint64_t(0);
  std::uint32_t pending_bricks_ = 0;  // whose rank is not 0
  Rank band_ = 0;                     // the lowest rank of the current band
  std::uint32_t next_brick_ = 0;      // the band goes from the last brick to the first; those below this one are still to come
};

}  // namespace intervale

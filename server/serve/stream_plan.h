// What a session sends next: a pure function of the data set, what was asked for and what was sent. No I/O.
//
// Updates go out in bands of falling error, each band about as large as all before it, so that the picture's error halves again and again. Within a
// band they go region by region, each with the ancestors it still lacks: neighbours share names and code tables, and a batch is small for what it
// holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/interval_volume.h"
#include "common/lod.h"
#include "common/refinement.h"
#include "common/update_codec.h"

namespace intervale {

// A batch of updates, parents before children, as the client's StreamClient::apply takes it.
struct Batch {
  std::vector<std::uint8_t> payload;  // update_codec.h
  std::uint32_t updates = 0;
  double remaining_error = 0;  // largest saturated error of what is wanted and not yet sent, field units; 0 when nothing is
};

// The first batch is small, so that there is something to draw soon; each is twice the last, up to where a larger one gains nothing.
inline constexpr std::size_t kFirstPayload = 8 << 10;

// The stream of one session over one data set. One thread at a time.
class StreamPlan {
 public:
  explicit StreamPlan(std::shared_ptr<const IntervalVolume> volume);

  // Replaces what is wanted. What was sent stays sent: nothing is ever sent twice. Linear in the number of updates.
  void set_lod(const Lod& lod);

  // The next batch, or nothing when all that is wanted has been sent. max_bytes, at least 256, bounds the payload as it would be if nothing could be
  // compressed; it is about half of that.
  std::optional<Batch> next(std::size_t max_bytes);

  [[nodiscard]] std::uint64_t wanted() const { return wanted_count_; }  // updates that the current level of detail needs, in all
  [[nodiscard]] std::uint64_t sent() const { return sent_count_; }      // updates sent so far, in all

 private:
  struct Chunk;
  bool begin_band();
  bool take(const Place& place, Chunk& chunk);

  std::shared_ptr<const IntervalVolume> volume_;
  SplitSet sent_, wanted_;
  std::array<std::uint32_t, kErrorLevels> waiting_{};  // wanted and not sent, by level of error
  std::uint64_t waiting_count_ = 0, wanted_count_ = 0, sent_count_ = 0;
  unsigned band_ = kErrorLevels;      // the lowest level of error that the current band takes
  std::uint32_t next_supercube_ = 0;  // the band goes from the last supercube to the first; those below this one are still to come
  std::uint32_t next_brick_ = 0;      // the one that supercube next_supercube_ - 1 is in
};

}  // namespace intervale

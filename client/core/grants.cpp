#include "client/core/grants.h"

namespace intervale {

void Grants::applied(std::uint64_t bytes, Clock::time_point now) {
  if (is_fixed_) return;
  if (!since_) {  // the first one's time is not known
    since_ = now;
    bytes_ = 0;
    return;
  }
  bytes_ += bytes;
  const Clock::duration time = now - *since_;
  if (time < std::max(round_trip_, kShortest)) return;
  const double seconds = std::chrono::duration<double>(time).count(), rate = double(bytes_) / seconds;
  rate_ = rate > rate_ ? rate : rate_ + (rate - rate_) / 4;
  const double window = 2 * rate_ * std::chrono::duration<double>(round_trip_ + kSlack).count();
  window_ = std::uint64_t(std::clamp(window, double(kLeastWindow), double(kMostWindow)));
  since_ = now;
  bytes_ = 0;
}

}  // namespace intervale

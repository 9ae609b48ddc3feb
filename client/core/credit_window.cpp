#include "client/core/credit_window.h"

namespace intervale {

void CreditWindow::note_batch(std::uint64_t cost, Clock::time_point now) {
  if (is_fixed_) return;
  if (!measured_since_) {  // it is not known how long the first batch took
    measured_since_ = now;
    bytes_ = 0;
    return;
  }
  bytes_ += cost;
  const Clock::duration time = now - *measured_since_;
  if (time < std::max(round_trip_, kMinMeasurement)) return;
  const double seconds = std::chrono::duration<double>(time).count(), rate = double(bytes_) / seconds;
  rate_ = rate > rate_ ? rate : rate_ + (rate - rate_) / 4;
  const double window = 2 * rate_ * std::chrono::duration<double>(round_trip_ + kSlack).count();
  window_ = std::uint64_t(std::clamp(window, double(kMinWindow), double(kMaxWindow)));
  measured_since_ = now;
  bytes_ = 0;
}

}  // namespace intervale

// How much the server may send, seen from the client.
#pragma once

#include <algorithm>
#include <cstdint>

#include "protocol/limits.h"

namespace intervale {

// A window that is opened again as batches are applied, and closes as the budget runs out.
class Grants {
 public:
  // budget: bytes in all; UINT64_MAX for no limit. window: most that is outstanding, 4 kMinCredit to kMaxWindow.
  explicit Grants(std::uint64_t budget, std::uint64_t window = protocol::kDefaultWindow) : left_(budget), window_(window) {}

  // What to grant now, 0 for nothing. Small grants are saved up, for each is a message.
  [[nodiscard]] std::uint64_t take() {
    const std::uint64_t wish = std::min(window_ - outstanding_, left_);
    if (wish < window_ / 4 && wish < left_) return 0;
    left_ -= wish;
    outstanding_ += wish;
    return wish;
  }
  [[nodiscard]] bool spend(std::uint64_t cost) {  // false: the server sent more than it was granted
    if (cost > outstanding_) return false;
    outstanding_ -= cost;
    return true;
  }
  // A session is over, and what was granted in it.
  void forget_outstanding() {
    left_ += outstanding_;
    outstanding_ = 0;
  }
  [[nodiscard]] bool exhausted() const { return left_ == 0 && outstanding_ < protocol::kMinCredit; }  // nothing more will come

 private:
  std::uint64_t left_;
  std::uint64_t window_;
  std::uint64_t outstanding_ = 0;
};

}  // namespace intervale

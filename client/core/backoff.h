// Pauses between attempts to reach a lost server.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>

namespace intervale {

// From 0.1 s, doubling up to 3 s, each shortened by up to a half at random: the many clients of a server that restarts
// must not connect all at once.
class Backoff {
 public:
  explicit Backoff(std::uint64_t seed) : random_(seed) {}
  [[nodiscard]] std::chrono::milliseconds next() {
    const double share = std::uniform_real_distribution<double>(0.5, 1.0)(random_);
    const auto wait = std::chrono::milliseconds(long(double(wait_.count()) * share));
    wait_ = std::min(2 * wait_, std::chrono::milliseconds(3000));
    return wait;
  }

 private:
  std::mt19937_64 random_;
  std::chrono::milliseconds wait_{100};
};

}  // namespace intervale

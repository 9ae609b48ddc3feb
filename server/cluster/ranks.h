// The programs that build one data set together, its ranks, and what they tell each other.
//
// All ranks call the same functions in the same order, with arrays of the same length where nothing else is said. One
// thread. A rank that is gone ends all others (server/mpi), so no function fails.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "common/util/result.h"

namespace intervale {

class Ranks {
 public:
  Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  virtual ~Ranks() = default;

  [[nodiscard]] virtual int rank() const = 0;  // of this program, from 0
  [[nodiscard]] virtual int size() const = 0;

  // Replace each element by what all ranks have there: the greatest, the sum, all bits.
  virtual void max(std::span<float> values) = 0;
  virtual void max(std::span<double> values) = 0;
  virtual void sum(std::span<std::uint64_t> values) = 0;
  virtual void unite(std::span<std::uint8_t> bits) = 0;

  // The bytes of each rank, by rank; of any length.
  [[nodiscard]] virtual std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) = 0;
};

// The elements of all ranks, in their order; of any number.
template <class T>
[[nodiscard]] std::vector<T> joined(Ranks& ranks, std::span<const T> values) {
  std::vector<T> all;
  for (const std::vector<std::byte>& bytes : ranks.gather(std::as_bytes(values))) {
    const std::size_t before = all.size();
    all.resize(before + bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(all.data() + before, bytes.data(), bytes.size());
  }
  return all;
}

// The same of numbers that ascend on each rank: all of them ascend.
[[nodiscard]] std::vector<double> joined_in_order(Ranks& ranks, std::span<const double> values);

// The failure of the first rank that has one, for all of them.
[[nodiscard]] Result<void> agree(Ranks& ranks, const Result<void>& result);

}  // namespace intervale

// The ranks of a job that mpirun or srun has started.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/cluster/ranks.h"

namespace intervale {

// One in a process, from the thread that runs main(). MPI ends the job if a call fails, or if a rank is gone.
class MpiRanks final : public Ranks {
 public:
  MpiRanks(int& argc, char**& argv);
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;
  ~MpiRanks() override;  // waits for the other ranks

  [[nodiscard]] int rank() const override { return rank_; }
  [[nodiscard]] int size() const override { return size_; }
  void max(std::span<float> values) override;
  void max(std::span<double> values) override;
  void sum(std::span<std::uint64_t> values) override;
  void unite(std::span<std::uint8_t> bits) override;
  [[nodiscard]] std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) override;

  // Ends all ranks with a status.
  [[noreturn]] static void abort(int status);

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace intervale

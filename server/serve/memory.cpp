// malloc_trim() is enough: it returns every free page of every arena. Another allocator (jemalloc, mimalloc) would do so
// too, by itself, at the price of one more library.
#include "server/serve/memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stop_token>

#include "server/scratch/scratch_memory.h"

namespace intervale {

std::uint64_t Memory::bytes(Holder holder) const {
  const std::uint64_t held = bytes_[std::size_t(holder)].load(std::memory_order_relaxed);
  return holder == Holder::datasets && data_memory_ != nullptr ? std::min(held, data_memory_->budget()) : held;
}

std::uint64_t Memory::bytes() const {
  std::uint64_t all = 0;
  for (const Holder holder : kHolders) all += bytes(holder);
  return all;
}

std::uint64_t Memory::room() const {
  if (!limit_ || data_memory_ != nullptr) return ~std::uint64_t(0);
  return *limit_ - std::min(*limit_, bytes());
}

std::uint64_t resident_bytes() {
  unsigned long pages = 0;
  if (std::FILE* const file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%*s %lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return std::uint64_t(pages) * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

std::uint64_t uncounted_bytes(const Memory& memory) {
  // Of data memory, what is resident comes and goes.
  const PageKeeper* const keeper = memory.data_memory() == nullptr ? nullptr : memory.data_memory()->keeper();
  const std::uint64_t counted = keeper == nullptr ? memory.bytes() : memory.bytes() - memory.bytes(Memory::Holder::datasets) + keeper->resident();
  const std::uint64_t resident = resident_bytes();
  return resident - std::min(resident, counted);
}

bool TrimRule::is_due(std::uint64_t uncounted) {
  least_ = std::min(least_, uncounted);
  return uncounted - least_ >= kWorthwhile;
}

std::jthread start_trimming(const Memory& memory) {
  return std::jthread([&memory](const std::stop_token& stop) {
    TrimRule rule;
    std::mutex mutex;
    std::condition_variable_any stopped;
    std::unique_lock lock(mutex);
    while (!stopped.wait_for(lock, stop, std::chrono::seconds(1), [&stop] { return stop.stop_requested(); })) {
      if (!rule.is_due(uncounted_bytes(memory))) continue;
      ::malloc_trim(0);
      rule.trimmed(uncounted_bytes(memory));
    }
  });
}

}  // namespace intervale

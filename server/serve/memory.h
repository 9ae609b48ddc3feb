// The memory that a server holds, as its holders count it; and how freed memory returns to the system.
//
// --max-memory limits what is counted, not what is resident: allocators keep freed memory, so after a crowd a limit on
// resident memory would turn everybody away for as long as the process lives.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

namespace intervale {

class ScratchMemory;

// Any thread.
class Memory {
 public:
  // datasets: also those that are replaced and still in use; in data memory, no more than its budget. sessions: connections,
  // before the upgrade too, what was sent, and work under way (Background). queues: unsent messages. ranges: what ranges
  // need (RangeCache).
  enum class Holder { datasets, sessions, queues, ranges };
  static constexpr std::array kHolders{Holder::datasets, Holder::sessions, Holder::queues, Holder::ranges};

  // limit: of all bytes; nullopt: none. data_memory: where data sets lie, which must outlive this; nullptr: with the rest.
  explicit Memory(std::optional<std::uint64_t> limit = {}, ScratchMemory* data_memory = nullptr) : limit_(limit), data_memory_(data_memory) {}
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  // Bytes of one holder, counted while it exists. The Memory must outlive it. One thread at a time.
  class Share {
   public:
    Share() = default;
    Share(Memory& memory, Holder holder, std::uint64_t bytes) : count_(&memory.bytes_[std::size_t(holder)]) { resize(bytes); }
    Share(Share&& other) noexcept : count_(std::exchange(other.count_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(count_, other.count_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Share() { resize(0); }
    void resize(std::uint64_t bytes) {
      if (count_ != nullptr && bytes != bytes_) count_->fetch_add(bytes - bytes_, std::memory_order_relaxed);
      bytes_ = bytes;
    }

   private:
    std::atomic<std::uint64_t>* count_ = nullptr;
    std::uint64_t bytes_ = 0;
  };

  [[nodiscard]] std::uint64_t bytes(Holder holder) const;
  [[nodiscard]] std::uint64_t bytes() const;  // of all holders
  // More is held than the limit allows: no new sessions.
  [[nodiscard]] bool is_full() const { return limit_ && bytes() > *limit_; }
  // For data sets, up to the limit; the largest number without one, and in data memory, where the disk limits them.
  [[nodiscard]] std::uint64_t room() const;
  [[nodiscard]] ScratchMemory* data_memory() const { return data_memory_; }

 private:
  std::array<std::atomic<std::uint64_t>, kHolders.size()> bytes_{};
  std::optional<std::uint64_t> limit_;
  ScratchMemory* data_memory_;
};

// The same object, whose memory_bytes() count as long as anybody has it.
template <class T>
[[nodiscard]] std::shared_ptr<const T> counted(Memory& memory, Memory::Holder holder, std::shared_ptr<const T> object) {
  using Pair = std::pair<Memory::Share, std::shared_ptr<const T>>;  // the share is released last
  const T* const address = object.get();
  Memory::Share share(memory, holder, object->memory_bytes());
  return {std::make_shared<const Pair>(std::move(share), std::move(object)), address};
}

// The resident memory of the process, from /proc; 0 if it cannot be read. Takes some microseconds.
[[nodiscard]] std::uint64_t resident_bytes();
// Resident memory that nobody counts: the program, work under way, and what the allocator keeps.
[[nodiscard]] std::uint64_t uncounted_bytes(const Memory& memory);

// When to return freed memory: once kWorthwhile bytes more are uncounted than there were at least.
class TrimRule {
 public:
  static constexpr std::uint64_t kWorthwhile = std::uint64_t(16) << 20;
  [[nodiscard]] bool is_due(std::uint64_t uncounted);
  void trimmed(std::uint64_t uncounted) { least_ = uncounted; }  // what is left is in use, or cannot be returned

 private:
  std::uint64_t least_ = ~std::uint64_t(0);
};

// Returns freed memory to the system by TrimRule, on a thread of its own that looks once a second, until it is destroyed.
// memory must outlive it.
[[nodiscard]] std::jthread start_trimming(const Memory& memory);

}  // namespace intervale

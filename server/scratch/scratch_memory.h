// Memory in a scratch file: how the build of a large volume stays within a budget of resident memory.
//
// Arrays lie in a mapping of the file. Every millisecond a timer interrupts each thread that computes; it looks how much of
// the process is resident, and before that exceeds the budget, it takes pages of the mapping out of memory (madvise(2),
// MADV_DONTNEED: of a shared mapping, contents stay in the file). So the threads that fill memory empty it, however busy
// the machine is. The system keeps the pages in its page cache as long as that has room, and reads them from the disk
// otherwise: whatever computes with arrays computes the same, only slower.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <unordered_map>

#include "common/util/result.h"

namespace intervale {

// Thrown where the scratch file cannot grow: what() is one line that names its folder, and says why.
class ScratchFull : public std::bad_alloc {
 public:
  explicit ScratchFull(std::string text) : text_(std::make_shared<const std::string>(std::move(text))) {}
  [[nodiscard]] const char* what() const noexcept override { return text_->c_str(); }

 private:
  std::shared_ptr<const std::string> text_;
};

// Any thread.
class ScratchMemory {
 public:
  static constexpr std::size_t kLeastBytes = 64 << 10;  // of an array that is worth a place in the file

  // A file without a name in `folder`, so that nothing is left of it however the process ends. budget: of the resident
  // bytes of the whole process, at most. threads: that compute, each of which has some memory of its own. Fails if the
  // budget is too small, and tells what it must be at least; or if the folder takes no such file.
  static Result<std::unique_ptr<ScratchMemory>> open(const std::filesystem::path& folder, std::uint64_t budget, unsigned threads);
  ScratchMemory(const ScratchMemory&) = delete;
  ScratchMemory& operator=(const ScratchMemory&) = delete;
  // Unmaps the file, unless arrays are left in it.
  ~ScratchMemory();

  // bytes > 0. Its contents are undefined. Throws ScratchFull.
  [[nodiscard]] void* allocate(std::size_t bytes);
  void free(void* array) noexcept;
  [[nodiscard]] bool owns(const void* address) const { return address >= base_ && address < base_ + kRegionBytes; }

  [[nodiscard]] std::uint64_t most_bytes() const { return end_.load(std::memory_order_relaxed); }  // that the file had

  // From now on the program's `operator new` takes large arrays from it (server/cli/scratch_new.cpp), and the budget is
  // kept, by SIGPROF to the calling thread and to those of oneTBB that work for it. Its destructor ends both. One in a
  // process.
  static void install(ScratchMemory& memory);
  // nullptr: none.
  [[nodiscard]] static ScratchMemory* installed();
  // False if the address is in no scratch file. One that is left over from a file that is no longer installed is ignored.
  static bool free_installed(void* array) noexcept;

 private:
  static constexpr std::size_t kRegionBytes = std::size_t(1) << 40;  // of addresses, and of the file, which is sparse
  ScratchMemory(std::filesystem::path folder, int file, int statm, std::byte* base, std::uint64_t budget);
  std::size_t take(std::size_t bytes);
  void give_back(std::size_t offset, std::size_t bytes) noexcept;
  class Timers;
  static void on_tick(int signal) noexcept;
  void keep_within_budget() noexcept;

  std::filesystem::path folder_;
  int file_, statm_;  // statm: /proc/self/statm
  std::byte* base_;
  std::uint64_t budget_;
  std::mutex mutex_;                                   // of what follows
  std::map<std::size_t, std::size_t> unused_;          // offsets and bytes, no two of which touch
  std::unordered_map<std::size_t, std::size_t> used_;  // the same, of arrays
  std::atomic<std::size_t> end_{0};                    // of all that was ever used
  std::unique_ptr<Timers> timers_;                     // once it is installed
  std::atomic<bool> is_sweeping_{false};
  std::size_t next_sweep_ = 0;  // offset; of the thread that sweeps
};

}  // namespace intervale

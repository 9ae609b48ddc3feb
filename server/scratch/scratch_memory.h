// Memory in a scratch file: how the build of a large volume, or a server of large data sets, stays within a budget of
// resident memory.
//
// Arrays lie in a mapping of the file. Pages of it are taken out of memory (madvise(2), MADV_DONTNEED: of a shared mapping,
// contents stay in the file) before what is resident exceeds the budget. The system keeps them in its page cache as long as
// that has room, and reads them from the disk otherwise: whatever computes with arrays computes the same, only slower.
//
// For a build, the budget is of the whole process, and all threads that compute have their large arrays in the file. Every
// millisecond a timer interrupts each of them to look. So the threads that fill memory empty it, however busy the machine
// is. For a server, the budget is of the arrays: those of data sets, small ones too, and what measuring a range takes. A
// thread that makes them says so by a Scope, and is interrupted likewise; one that reads them says so by a Reading.
// Besides, a thread of its own looks every millisecond, which alone comes too late on a busy machine.
#pragma once

#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>

#include "common/util/result.h"
#include "server/scratch/page_keeper.h"
#include "server/scratch/small_arrays.h"
#include "server/scratch/thread_timer.h"

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
  // The same for data sets that are served. budget: of the resident bytes of its arrays, which a thread of its own keeps from
  // now on; when they come fast, they exceed it for a moment, by some MB. Fails also if the folder lies in memory (tmpfs).
  static Result<std::unique_ptr<ScratchMemory>> open_for_data_sets(const std::filesystem::path& folder, std::uint64_t budget);
  ScratchMemory(const ScratchMemory&) = delete;
  ScratchMemory& operator=(const ScratchMemory&) = delete;
  // Unmaps the file, unless arrays are left in it.
  ~ScratchMemory();

  // bytes > 0; many small arrays lie side by side. Its contents are undefined. Throws ScratchFull.
  [[nodiscard]] void* allocate(std::size_t bytes);
  void free(void* array) noexcept;
  [[nodiscard]] bool owns(const void* address) const { return address >= base_ && address < base_ + kRegionBytes; }

  [[nodiscard]] std::uint64_t most_bytes() const { return end_.load(std::memory_order_relaxed); }           // that the file had
  [[nodiscard]] std::uint64_t array_bytes() const { return array_bytes_.load(std::memory_order_relaxed); }  // of arrays now
  [[nodiscard]] std::uint64_t budget() const { return budget_; }
  // Of one for data sets; of others nullptr. As long as this.
  [[nodiscard]] const PageKeeper* keeper() const { return keeper_ ? &*keeper_ : nullptr; }

  // From now on the program's `operator new` (server/cli/scratch_new.cpp) takes large arrays from it: of one for data sets,
  // those of threads with a Scope; else those of all threads, and the budget is kept, by SIGPROF to the calling thread and
  // to those of oneTBB that work for it. Its destructor ends both. If the disk fails when a page is read (SIGBUS), the
  // process ends with one line on stderr, and status 1. One in a process.
  static void install(ScratchMemory& memory);
  // Where an array of so many bytes of the calling thread belongs; nullptr: in the process' own memory. With a Scope,
  // from SmallArrays::kLeastBytes on: much of a data set is in small arrays, some for each of its bricks.
  [[nodiscard]] static ScratchMemory* place_of(std::size_t bytes);
  // False if the address is in no scratch file. One that is left over from a file that is no longer installed is ignored.
  static bool free_installed(void* array) noexcept;

  // While it exists, the calling thread's arrays lie in `memory`, and SIGPROF comes to the thread, to keep the budget
  // while it fills them. They may be freed by any thread, later. nullptr: nothing happens.
  class Scope {
   public:
    explicit Scope(ScratchMemory* memory);
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    ~Scope();

   private:
    ScratchMemory* before_;
    std::optional<ThreadTimer> timer_;
  };

  // While it exists, SIGPROF comes to the calling thread, to keep the budget of the installed one for data sets while the
  // thread reads them. Nothing happens if there is none when this is made. Not for a thread that waits: it would be woken.
  class Reading {
   public:
    Reading();

   private:
    std::optional<ThreadTimer> timer_;
  };

 private:
  static constexpr std::size_t kRegionBytes = std::size_t(1) << 40;  // of addresses, and of the file, which is sparse
  enum class Use { build, data_sets };
  static Result<std::unique_ptr<ScratchMemory>> map_file(const std::filesystem::path& folder, std::uint64_t budget, Use use);
  ScratchMemory(std::filesystem::path folder, int file, int statm, std::byte* base, std::uint64_t budget, Use use);
  std::size_t take(std::size_t bytes);
  std::byte* allocate_large(std::size_t bytes);
  bool free_large(std::byte* array) noexcept;
  void give_back(std::size_t offset, std::size_t bytes) noexcept;
  class Timers;
  static ScratchMemory* installed();
  static void on_tick(int signal) noexcept;
  static void on_failed_access(int signal, siginfo_t* access, void* context) noexcept;
  void keep_within_budget() noexcept;
  void keep(const std::stop_token& stop) noexcept;  // of one for data sets: what its thread does

  std::filesystem::path folder_;
  std::string last_words_;  // for a disk that fails
  int file_, statm_;        // statm: /proc/self/statm
  std::byte* base_;
  std::uint64_t budget_;
  std::mutex mutex_;                                   // of what follows
  std::map<std::size_t, std::size_t> unused_;          // offsets and bytes, no two of which touch
  std::unordered_map<std::size_t, std::size_t> used_;  // the same, of arrays
  std::size_t arrays_ = 0;                             // that are in use, small ones too
  SmallArrays small_;                                  // in arrays
  std::atomic<std::size_t> end_{0};                    // of all that was ever used
  std::unique_ptr<Timers> timers_;                     // once it is installed
  std::atomic<bool> is_sweeping_{false};
  std::size_t next_sweep_ = 0;  // offset; of the thread that sweeps
  std::atomic<std::uint64_t> array_bytes_{0};
  std::optional<PageKeeper> keeper_;  // for data sets
  std::jthread keeping_;
};

}  // namespace intervale

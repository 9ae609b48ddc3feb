// Which pages of a file's mapping the process has in memory: no more than a budget, and rather those that are in use.
//
// Pages are taken out of memory by madvise(2), MADV_DONTNEED of a shared mapping: contents stay in the file, and whoever
// reads them next gets them from the system's page cache, or from the disk. A hand goes round over stretches of the
// mapping, as in the clock algorithm (Corbató 1968). Whether a page was used since the hand came by is not to be had
// without privileges; but what a stretch has in memory came back since it was taken out last. So the hand takes those
// stretches that came back slowest, in pages a millisecond: about a quarter of those that it passes.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace intervale {

// Resident memory of the process, in bytes, from /proc/self/statm; 0 if that cannot be read.
struct ResidentBytes {
  std::uint64_t all = 0, of_files = 0;  // of_files: pages of mapped files, the program's own among them
};
// statm: /proc/self/statm, open for reading. Safe in handlers of signals.
[[nodiscard]] ResidentBytes read_resident(int statm) noexcept;

class PageKeeper {
 public:
  // mapping: page-aligned, of a file, shared, of so many bytes; it must outlive this. budget: of its resident bytes.
  // statm: /proc/self/statm, open for reading, which must stay so. Make it before the mapping is used: what is resident of
  // files then is the program's own.
  PageKeeper(std::byte* mapping, std::size_t bytes, std::uint64_t budget, int statm);
  PageKeeper(const PageKeeper&) = delete;
  PageKeeper& operator=(const PageKeeper&) = delete;
  ~PageKeeper();

  // Takes pages out of memory if more than the budget are in it. end: nothing beyond it was ever used. If another thread
  // does so, waits as long as far more than the budget are in it. Any thread; safe in handlers of signals, but not where
  // one may interrupt it that calls it, too.
  void keep_within_budget(std::size_t end) noexcept;
  // Counts the mapping's pages, and so what the program itself has of files, which grows in its first seconds. Reads 2 MB
  // of page tables for each GB; keeps within the budget meanwhile. One thread at a time.
  void recount(std::size_t end) noexcept;

  // Any thread. In bytes.
  [[nodiscard]] std::uint64_t budget() const { return budget_; }
  [[nodiscard]] std::uint64_t resident() const noexcept;                                                // of the mapping, give or take a MB
  [[nodiscard]] std::uint64_t taken_out() const { return taken_out_.load(std::memory_order_relaxed); }  // so far

 private:
  struct Freed {
    void operator()(void* memory) const;
  };
  [[nodiscard]] unsigned present(std::size_t stretch) const noexcept;
  void sweep(std::size_t end) noexcept;

  std::byte* mapping_;
  std::uint64_t budget_;
  int statm_, pagemap_;                 // pagemap_: /proc/self/pagemap; -1: not to be had
  std::atomic<std::uint64_t> program_;  // bytes of other files
  std::atomic<std::uint64_t> taken_out_{0};
  std::atomic<bool> is_sweeping_{false};
  // Of the thread that sweeps:
  std::unique_ptr<std::uint32_t[], Freed> taken_at_;  // by stretch: when it was taken out last, in milliseconds
  std::size_t hand_ = 0;                              // stretch
  float slow_ = 1;                                    // pages a millisecond: what is slower is taken out
};

}  // namespace intervale

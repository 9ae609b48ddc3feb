#include "server/scratch/page_keeper.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>

namespace intervale {
namespace {

constexpr std::size_t kStretch = 256 << 10;
constexpr std::size_t kMostPages = kStretch / 4096;
constexpr std::uint64_t kPresent = std::uint64_t(1) << 63;  // bit of an entry of pagemap
constexpr std::size_t kMostRounds = 8;                      // of the hand at a time
constexpr std::uint64_t kMostAhead = 16 << 20;              // bytes over the budget while another thread takes pages out
constexpr std::size_t kCounted = 4096;                      // stretches, before the budget is looked at again

// So that about a quarter of the stretches is slower than the bound: a step up for each that is not, and three down.
constexpr float kStepUp = 1.0625f, kStepDown = 1 / (kStepUp * kStepUp * kStepUp);
constexpr float kSlowest = 1e-7f, kFastest = 1e3f;

std::size_t page_bytes() { return std::size_t(::sysconf(_SC_PAGESIZE)); }

std::uint32_t milliseconds() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC_COARSE, &now);
  return std::uint32_t(std::uint64_t(now.tv_sec) * 1000 + std::uint64_t(now.tv_nsec) / 1'000'000);
}

}  // namespace

ResidentBytes read_resident(int statm) noexcept {
  std::array<char, 128> text{};
  const ssize_t n = ::pread(statm, text.data(), text.size(), 0);
  if (n <= 0) return {};
  const char* const end = text.data() + n;
  std::array<std::uint64_t, 3> pages{};  // of addresses, resident, resident of files
  const char* at = text.data();
  for (std::uint64_t& number : pages) {
    at = std::from_chars(at, end, number).ptr;
    if (at != end) ++at;
  }
  return {pages[1] * page_bytes(), pages[2] * page_bytes()};
}

void PageKeeper::Freed::operator()(void* memory) const { std::free(memory); }

// calloc() gives pages that are not resident before they are written to: the mapping may be far larger than what is used.
PageKeeper::PageKeeper(std::byte* mapping, std::size_t bytes, std::uint64_t budget, int statm)
    : mapping_(mapping),
      budget_(budget),
      statm_(statm),
      pagemap_(::open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC)),
      program_(read_resident(statm).of_files),
      taken_at_(static_cast<std::uint32_t*>(std::calloc(bytes / kStretch, sizeof(std::uint32_t)))) {
  if (!taken_at_) throw std::bad_alloc();
}

PageKeeper::~PageKeeper() {
  if (pagemap_ >= 0) ::close(pagemap_);
}

// How many of the stretch's pages are in memory; all, if nobody tells: then the hand takes one stretch after the other.
unsigned PageKeeper::present(std::size_t stretch) const noexcept {
  std::array<std::uint64_t, kMostPages> entries;
  const std::size_t pages = kStretch / page_bytes(), first = reinterpret_cast<std::uintptr_t>(mapping_) / page_bytes() + stretch * pages;
  const std::size_t bytes = pages * sizeof(std::uint64_t);
  if (::pread(pagemap_, entries.data(), bytes, off_t(first * sizeof(std::uint64_t))) != ssize_t(bytes)) return unsigned(pages);
  return unsigned(std::count_if(entries.data(), entries.data() + pages, [](std::uint64_t entry) { return (entry & kPresent) != 0; }));
}

std::uint64_t PageKeeper::resident() const noexcept {
  const std::uint64_t of_files = read_resident(statm_).of_files;
  return of_files - std::min(of_files, program_.load(std::memory_order_relaxed));
}

// Pages that come or go meanwhile make the result too small rather than too large: then fewer of the mapping stay.
void PageKeeper::recount(std::size_t end) noexcept {
  if (pagemap_ < 0) return;
  const std::uint64_t before = read_resident(statm_).of_files;
  std::uint64_t pages = 0;
  for (std::size_t stretch = 0; stretch * kStretch < end; ++stretch) {
    pages += present(stretch);
    if (stretch % kCounted == kCounted - 1) keep_within_budget(end);
  }
  const std::uint64_t of_files = std::min(before, read_resident(statm_).of_files);
  const std::uint64_t of_program = of_files - std::min(of_files, pages * page_bytes());
  program_.store(std::max(of_program, program_.load(std::memory_order_relaxed)), std::memory_order_relaxed);
}

void PageKeeper::keep_within_budget(std::size_t end) noexcept {
  if (resident() <= budget_) return;
  if (is_sweeping_.exchange(true, std::memory_order_acquire)) {
    while (is_sweeping_.load(std::memory_order_acquire) && resident() > budget_ + kMostAhead) ::sched_yield();
    return;
  }
  sweep(end);
  is_sweeping_.store(false, std::memory_order_release);
}

void PageKeeper::sweep(std::size_t end) noexcept {
  const std::uint64_t enough = budget_ - budget_ / 8;
  const std::size_t stretches = (end + kStretch - 1) / kStretch;
  const std::uint32_t now = milliseconds();
  std::size_t taken = 0, absent = 0;
  bool is_far_over = resident() > budget_ + kMostAhead;  // then there is no time to choose
  for (std::size_t looks = 0; looks < kMostRounds * stretches && absent < stretches; ++looks) {
    if (hand_ >= stretches) hand_ = 0;
    const std::size_t stretch = hand_++;
    const unsigned pages = present(stretch);
    absent = pages == 0 ? absent + 1 : 0;
    if (pages == 0) continue;
    if (!is_far_over && float(pages) > slow_ * float(now - taken_at_[stretch] + 1)) {
      slow_ = std::min(slow_ * kStepUp, kFastest);
      continue;
    }
    if (!is_far_over) slow_ = std::max(slow_ * kStepDown, kSlowest);
    ::madvise(mapping_ + stretch * kStretch, kStretch, MADV_DONTNEED);
    taken_at_[stretch] = now;
    taken_out_.fetch_add(pages * page_bytes(), std::memory_order_relaxed);
    if (++taken % 8 != 0) continue;
    const std::uint64_t left = resident();
    if (left <= enough) return;
    is_far_over = left > budget_ + kMostAhead;
  }
}

}  // namespace intervale

#include "server/scratch/scratch_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <iterator>
#include <utility>

namespace intervale {
namespace {

constexpr std::size_t kGranule = 64 << 10;        // arrays lie at multiples of it
constexpr std::size_t kSweep = 4 << 20;           // bytes that are taken out of memory at a time
constexpr std::size_t kReleased = 16 << 20;       // so many bytes that are no longer used go back to the disk; fewer are used again
constexpr std::uint64_t kProgram = 64 << 20;      // resident, of code and small objects
constexpr std::uint64_t kThread = 32 << 20;       // for each thread
constexpr std::uint64_t kMostMargin = 256 << 20;  // becomes resident before the keeper runs again
constexpr auto kPeriod = std::chrono::milliseconds(1);

// Resident bytes of the process. statm: /proc/self/statm.
std::uint64_t resident_bytes(int statm) {
  std::array<char, 128> text{};
  const ssize_t n = ::pread(statm, text.data(), text.size(), 0);
  if (n <= 0) return 0;
  const char* const end = text.data() + n;
  const char* at = std::find(text.data(), text.data() + n, ' ');
  std::uint64_t pages = 0;
  if (at != end) std::from_chars(at + 1, end, pages);
  return pages * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

std::string reason(int error) { return std::generic_category().message(error); }
std::string megabytes(std::uint64_t bytes) { return std::to_string((bytes + 999'999) / 1'000'000) + " MB"; }

// A file without a name, open for reading and writing; or -1.
int open_unnamed(const std::filesystem::path& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string name = (folder / ".intervale-scratch-XXXXXX").string();  // for a file system without O_TMPFILE
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

std::atomic<ScratchMemory*> ScratchMemory::installed_{nullptr};
std::atomic<const std::byte*> ScratchMemory::last_base_{nullptr};

Result<std::unique_ptr<ScratchMemory>> ScratchMemory::open(const std::filesystem::path& folder, std::uint64_t budget, unsigned threads) {
  const std::uint64_t least = kProgram + threads * kThread;
  if (budget < least)
    return fail("a budget of " + megabytes(budget) + " is too small: with " + std::to_string(threads) + " threads at least " + megabytes(least));
  const auto cannot = [&folder](int error) { return fail("cannot make a scratch file in '" + folder.string() + "': " + reason(error)); };
  const int statm = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (statm < 0) return fail("cannot tell how much memory is resident: /proc/self/statm: " + reason(errno));
  const int file = open_unnamed(folder);
  if (file < 0) {
    const int error = errno;
    ::close(statm);
    return cannot(error);
  }
  void* const base = ::ftruncate(file, off_t(kRegionBytes)) == 0
                         ? ::mmap(nullptr, kRegionBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file, 0)
                         : MAP_FAILED;
  if (base == MAP_FAILED) {
    const int error = errno;
    ::close(file);
    ::close(statm);
    return cannot(error);
  }
  return std::unique_ptr<ScratchMemory>(new ScratchMemory(folder, file, statm, static_cast<std::byte*>(base), budget));
}

ScratchMemory::ScratchMemory(std::filesystem::path folder, int file, int statm, std::byte* base, std::uint64_t budget)
    : folder_(std::move(folder)), file_(file), statm_(statm), base_(base), budget_(budget) {
  ::madvise(base_, kRegionBytes, MADV_RANDOM);  // or one access makes up to two megabytes resident
  unused_.emplace(0, kRegionBytes);
  keeper_ = std::jthread([this](const std::stop_token& stop) { keep_within_budget(stop); });
}

ScratchMemory::~ScratchMemory() {
  ScratchMemory* self = this;
  installed_.compare_exchange_strong(self, nullptr);
  keeper_ = {};
  const std::lock_guard lock(mutex_);
  if (used_.empty()) {
    ::munmap(base_, kRegionBytes);
    const std::byte* base = base_;
    last_base_.compare_exchange_strong(base, nullptr);
  }
  ::close(file_);
  ::close(statm_);
}

void ScratchMemory::install(ScratchMemory& memory) {
  last_base_.store(memory.base_, std::memory_order_release);
  installed_.store(&memory, std::memory_order_release);
}

bool ScratchMemory::free_installed(void* array) noexcept {
  const std::byte* const base = last_base_.load(std::memory_order_relaxed);
  if (base == nullptr || array < base || array >= base + kRegionBytes) return false;
  if (ScratchMemory* const memory = installed(); memory != nullptr && memory->owns(array)) memory->free(array);
  return true;
}

// The first place that is large enough.
std::size_t ScratchMemory::take(std::size_t bytes) {
  const auto place = std::find_if(unused_.begin(), unused_.end(), [bytes](const auto& extent) { return extent.second >= bytes; });
  if (place == unused_.end()) throw ScratchFull("the scratch file exceeds " + megabytes(kRegionBytes));
  const auto [offset, room] = *place;
  unused_.erase(place);
  if (room > bytes) unused_.emplace(offset + bytes, room - bytes);
  end_.store(std::max(most_bytes(), offset + bytes), std::memory_order_relaxed);
  return offset;
}

void ScratchMemory::give_back(std::size_t offset, std::size_t bytes) noexcept {
  auto next = unused_.lower_bound(offset);
  if (next != unused_.end() && offset + bytes == next->first) {
    bytes += next->second;
    next = unused_.erase(next);
  }
  if (next != unused_.begin() && std::prev(next)->first + std::prev(next)->second == offset) {
    std::prev(next)->second += bytes;
    return;
  }
  unused_.emplace_hint(next, offset, bytes);
}

void* ScratchMemory::allocate(std::size_t bytes) {
  bytes = (bytes + kGranule - 1) / kGranule * kGranule;
  const std::lock_guard lock(mutex_);
  const std::size_t offset = take(bytes);
  used_.emplace(offset, bytes);
  // A page that the disk has no room for would end the process once it is written to.
  if (const int error = ::posix_fallocate(file_, off_t(offset), off_t(bytes)); error != 0) {
    used_.erase(offset);
    give_back(offset, bytes);
    throw ScratchFull("the scratch folder '" + folder_.string() + "' has no room for " + megabytes(bytes) + " more: " + reason(error));
  }
  return base_ + offset;
}

void ScratchMemory::free(void* array) noexcept {
  const auto offset = std::size_t(static_cast<std::byte*>(array) - base_);
  const std::lock_guard lock(mutex_);
  const auto found = used_.find(offset);
  if (found == used_.end()) return;
  const std::size_t bytes = found->second;
  used_.erase(found);
  if (bytes >= kReleased) (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(offset), off_t(bytes));
  give_back(offset, bytes);
}

// Takes pages out of memory in the order of their addresses, round and round. Those in use come back at once.
void ScratchMemory::keep_within_budget(const std::stop_token& stop) const {
  const std::uint64_t most = budget_ - std::min(budget_ / 2, kMostMargin), enough = most - most / 4;
  std::size_t next = 0;
  while (!stop.stop_requested()) {
    std::uint64_t resident = resident_bytes(statm_);
    if (resident > most) {
      const std::size_t end = most_bytes();
      for (std::size_t swept = 0; swept < end && resident > enough; swept += kSweep) {
        if (next >= end) next = 0;
        ::madvise(base_ + next, std::min(kSweep, end - next), MADV_DONTNEED);
        next += kSweep;
        if (swept / kSweep % 4 == 3) resident = resident_bytes(statm_);
      }
    }
    std::this_thread::sleep_for(kPeriod);
  }
}

}  // namespace intervale

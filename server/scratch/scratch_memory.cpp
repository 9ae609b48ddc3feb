#include "server/scratch/scratch_memory.h"

#include <fcntl.h>
#include <oneapi/tbb/task_scheduler_observer.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <iterator>
#include <utility>

namespace intervale {
namespace {

constexpr std::size_t kGranule = 64 << 10;       // arrays lie at multiples of it
constexpr std::size_t kSweep = 4 << 20;          // bytes that are taken out of memory at a time
constexpr std::size_t kReleased = 16 << 20;      // so many bytes that are no longer used go back to the disk; fewer are used again
constexpr std::uint64_t kProgram = 64 << 20;     // resident, of code and small objects
constexpr std::uint64_t kThread = 32 << 20;      // for each thread
constexpr std::uint64_t kMostMargin = 64 << 20;  // may become resident from one tick to the next
constexpr long kPeriod = 1'000'000;              // nanoseconds between two looks of a thread

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

// Threads that are looking, or about to.
std::atomic<int> looking{0};

std::atomic<ScratchMemory*> installed_memory{nullptr};
std::atomic<const std::byte*> last_base{nullptr};  // of the last one installed

}  // namespace

// A timer for each thread that computes.
class ScratchMemory::Timers : public tbb::task_scheduler_observer {
 public:
  Timers() {
    add_this_thread();
    observe(true);
  }
  Timers(const Timers&) = delete;
  Timers& operator=(const Timers&) = delete;
  ~Timers() override {
    observe(false);
    for (const auto& [thread, timer] : timers_) ::timer_delete(timer);
  }
  void on_scheduler_entry(bool /*is_worker*/) override { add_this_thread(); }

 private:
  void add_this_thread() {
    const pid_t thread = ::gettid();
    const std::lock_guard lock(mutex_);
    if (timers_.contains(thread)) return;
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = SIGPROF;
    event._sigev_un._tid = thread;
    timer_t timer{};
    if (::timer_create(CLOCK_MONOTONIC, &event, &timer) != 0) return;
    const itimerspec period{{0, kPeriod}, {0, kPeriod}};
    ::timer_settime(timer, 0, &period, nullptr);
    timers_.emplace(thread, timer);
  }
  std::mutex mutex_;
  std::unordered_map<pid_t, timer_t> timers_;
};

ScratchMemory* ScratchMemory::installed() { return installed_memory.load(std::memory_order_acquire); }

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
}

ScratchMemory::~ScratchMemory() {
  timers_.reset();
  ScratchMemory* self = this;
  installed_memory.compare_exchange_strong(self, nullptr);
  while (looking.load() != 0) ::sched_yield();
  const std::lock_guard lock(mutex_);
  if (used_.empty()) {
    ::munmap(base_, kRegionBytes);
    const std::byte* base = base_;
    last_base.compare_exchange_strong(base, nullptr);
  }
  ::close(file_);
  ::close(statm_);
}

void ScratchMemory::install(ScratchMemory& memory) {
  last_base.store(memory.base_, std::memory_order_release);
  installed_memory.store(&memory, std::memory_order_release);
  struct sigaction action {};
  action.sa_handler = &ScratchMemory::on_tick;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGPROF, &action, nullptr);
  memory.timers_ = std::make_unique<Timers>();
}

bool ScratchMemory::free_installed(void* array) noexcept {
  const std::byte* const base = last_base.load(std::memory_order_relaxed);
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

void ScratchMemory::on_tick(int /*signal*/) noexcept {
  const int error = errno;
  ++looking;
  if (ScratchMemory* const memory = installed()) memory->keep_within_budget();
  --looking;
  errno = error;
}

// Calls only what a signal's handler may call. Takes pages out of memory in the order of their addresses, round and round;
// those in use come back at once. Other threads wait for that.
void ScratchMemory::keep_within_budget() noexcept {
  const std::uint64_t most = budget_ - std::min(budget_ / 4, kMostMargin);
  std::uint64_t resident = resident_bytes(statm_);
  if (resident <= most) return;
  if (is_sweeping_.exchange(true, std::memory_order_acquire)) {
    while (is_sweeping_.load(std::memory_order_acquire)) ::sched_yield();
    return;
  }
  const std::size_t end = most_bytes();
  for (std::size_t swept = 0; swept < end && resident > most - most / 4; swept += kSweep) {
    if (next_sweep_ >= end) next_sweep_ = 0;
    ::madvise(base_ + next_sweep_, std::min(kSweep, end - next_sweep_), MADV_DONTNEED);
    next_sweep_ += kSweep;
    if (swept / kSweep % 4 == 3) resident = resident_bytes(statm_);
  }
  is_sweeping_.store(false, std::memory_order_release);
}

}  // namespace intervale

#include "server/scratch/scratch_memory.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <oneapi/tbb/task_scheduler_observer.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
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
constexpr std::chrono::milliseconds kPeriod{1};  // between two looks of a thread
constexpr std::uint64_t kLeastData = 4'000'000;  // of a budget for data sets: some stretches of the keeper, and some pages for each thread

// The keeper's thread: how long it sleeps while little is resident, and when it counts again, at first and later.
constexpr std::chrono::milliseconds kIdle{8}, kFirstCount{125}, kLastCount{64'000};

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

// Whether the file lies in memory, and not on a disk.
bool is_in_memory(int file) {
  struct statfs system {};
  return ::fstatfs(file, &system) == 0 && (system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC);
}

// Threads that are looking, or about to.
std::atomic<int> looking{0};

std::atomic<ScratchMemory*> installed_memory{nullptr};
std::atomic<ScratchMemory*> of_all_threads{nullptr};  // the same, or nullptr
thread_local constinit ScratchMemory* of_scope = nullptr;
thread_local constinit bool is_own = false;

// While it exists, what the calling thread allocates lies in the process' own memory: the lists of what is in the file.
class Own {
 public:
  Own() : before_(std::exchange(is_own, true)) {}
  Own(const Own&) = delete;
  Own& operator=(const Own&) = delete;
  ~Own() { is_own = before_; }

 private:
  bool before_;
};
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
  ~Timers() override { observe(false); }
  void on_scheduler_entry(bool /*is_worker*/) override { add_this_thread(); }

 private:
  void add_this_thread() {
    const pid_t thread = ::gettid();
    const std::lock_guard lock(mutex_);
    timers_.try_emplace(thread, SIGPROF, kPeriod);
  }
  std::mutex mutex_;
  std::unordered_map<pid_t, ThreadTimer> timers_;
};

ScratchMemory* ScratchMemory::installed() { return installed_memory.load(std::memory_order_acquire); }

ScratchMemory* ScratchMemory::place_of(std::size_t bytes) {
  if (is_own) return nullptr;
  if (of_scope != nullptr) return bytes >= SmallArrays::kLeastBytes ? of_scope : nullptr;
  return bytes >= kLeastBytes ? of_all_threads.load(std::memory_order_acquire) : nullptr;
}

ScratchMemory::Scope::Scope(ScratchMemory* memory) : before_(of_scope) {
  if (memory == nullptr) return;
  of_scope = memory;
  if (memory == installed()) timer_.emplace(SIGPROF, kPeriod);
}

ScratchMemory::Scope::~Scope() { of_scope = before_; }

ScratchMemory::Reading::Reading() {
  const ScratchMemory* const memory = installed();
  if (memory != nullptr && memory->keeper_) timer_.emplace(SIGPROF, kPeriod);
}

Result<std::unique_ptr<ScratchMemory>> ScratchMemory::open(const std::filesystem::path& folder, std::uint64_t budget, unsigned threads) {
  const std::uint64_t least = kProgram + threads * kThread;
  if (budget < least)
    return misuse("a budget of " + megabytes(budget) + " is too small: with " + std::to_string(threads) + " threads at least " + megabytes(least));
  return map_file(folder, budget, Use::build);
}

Result<std::unique_ptr<ScratchMemory>> ScratchMemory::open_for_data_sets(const std::filesystem::path& folder, std::uint64_t budget) {
  if (budget < kLeastData) return misuse("a budget of " + megabytes(budget) + " is too small: at least " + megabytes(kLeastData));
  auto memory = map_file(folder, budget, Use::data_sets);
  if (memory) (*memory)->keeping_ = std::jthread([&scratch = **memory](const std::stop_token& stop) { scratch.keep(stop); });
  return memory;
}

Result<std::unique_ptr<ScratchMemory>> ScratchMemory::map_file(const std::filesystem::path& folder, std::uint64_t budget, Use use) {
  const auto cannot = [&folder](int error) { return fail("cannot make a scratch file in '" + folder.string() + "': " + reason(error)); };
  const int statm = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (statm < 0) return fail("cannot tell how much memory is resident: /proc/self/statm: " + reason(errno));
  const int file = open_unnamed(folder);
  if (file < 0) {
    const int error = errno;
    ::close(statm);
    return cannot(error);
  }
  if (use == Use::data_sets && is_in_memory(file)) {
    ::close(file);
    ::close(statm);
    return fail("the scratch folder '" + folder.string() + "' lies in memory (tmpfs): name one on a disk");
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
  return std::unique_ptr<ScratchMemory>(new ScratchMemory(folder, file, statm, static_cast<std::byte*>(base), budget, use));
}

ScratchMemory::ScratchMemory(std::filesystem::path folder, int file, int statm, std::byte* base, std::uint64_t budget, Use use)
    : folder_(std::move(folder)),
      last_words_("intervale: the disk of the scratch file in '" + folder_.string() + "' failed\n"),
      file_(file),
      statm_(statm),
      base_(base),
      budget_(budget) {
  ::madvise(base_, kRegionBytes, MADV_RANDOM);  // or one access makes up to two megabytes resident
  unused_.emplace(0, kRegionBytes);
  if (use == Use::data_sets) keeper_.emplace(base_, kRegionBytes, budget_, statm_);
}

ScratchMemory::~ScratchMemory() {
  keeping_ = {};
  timers_.reset();
  ScratchMemory *self = this, *same = this;
  of_all_threads.compare_exchange_strong(self, nullptr);
  installed_memory.compare_exchange_strong(same, nullptr);
  while (looking.load() != 0) ::sched_yield();
  const std::lock_guard lock(mutex_);
  if (arrays_ == 0) {
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
  action.sa_sigaction = &ScratchMemory::on_failed_access;
  action.sa_flags = SA_SIGINFO;
  ::sigaction(SIGBUS, &action, nullptr);
  if (memory.keeper_) return;
  of_all_threads.store(&memory, std::memory_order_release);
  memory.timers_ = std::make_unique<Timers>();
}

void ScratchMemory::on_failed_access(int signal, siginfo_t* access, void* /*context*/) noexcept {
  const ScratchMemory* const memory = installed();
  if (memory == nullptr || !memory->owns(access->si_addr)) {
    (void)::signal(signal, SIG_DFL);  // the access is tried again
    return;
  }
  (void)!::write(STDERR_FILENO, memory->last_words_.data(), memory->last_words_.size());
  ::_exit(1);
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
  const Own lists;
  const std::lock_guard lock(mutex_);
  std::byte* array = bytes <= SmallArrays::kMostBytes ? small_.take(bytes) : allocate_large(bytes);
  if (array == nullptr) {
    small_.add(bytes, allocate_large(SmallArrays::kChunkBytes));
    array = small_.take(bytes);
  }
  ++arrays_;
  return array;
}

void ScratchMemory::free(void* array) noexcept {
  const Own lists;
  const std::lock_guard lock(mutex_);
  const auto [is_small, unused_chunk] = small_.free(static_cast<std::byte*>(array));
  if (is_small || free_large(static_cast<std::byte*>(array))) --arrays_;
  if (unused_chunk != nullptr) free_large(unused_chunk);
}

// With the lock held.
std::byte* ScratchMemory::allocate_large(std::size_t bytes) {
  bytes = (bytes + kGranule - 1) / kGranule * kGranule;
  const std::size_t offset = take(bytes);
  used_.emplace(offset, bytes);
  const SignalBlock whole(SIGPROF);  // which would make some file systems give up
  // A page that the disk has no room for would end the process once it is written to.
  if (const int error = ::posix_fallocate(file_, off_t(offset), off_t(bytes)); error != 0) {
    (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(offset), off_t(bytes));  // what there was room for
    used_.erase(offset);
    give_back(offset, bytes);
    throw ScratchFull("the scratch folder '" + folder_.string() + "' has no room for " + megabytes(bytes) + " more: " + reason(error));
  }
  array_bytes_.fetch_add(bytes, std::memory_order_relaxed);
  return base_ + offset;
}

// With the lock held.
bool ScratchMemory::free_large(std::byte* array) noexcept {
  const auto offset = std::size_t(array - base_);
  const auto found = used_.find(offset);
  if (found == used_.end()) return false;
  const std::size_t bytes = found->second;
  used_.erase(found);
  array_bytes_.fetch_sub(bytes, std::memory_order_relaxed);
  if (bytes >= kReleased) (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(offset), off_t(bytes));
  give_back(offset, bytes);
  return true;
}

void ScratchMemory::on_tick(int /*signal*/) noexcept {
  const int error = errno;
  ++looking;
  if (ScratchMemory* const memory = installed()) {
    if (memory->keeper_)
      memory->keeper_->keep_within_budget(memory->most_bytes());
    else
      memory->keep_within_budget();
  }
  --looking;
  errno = error;
}

// Calls only what a signal's handler may call. Takes pages out of memory in the order of their addresses, round and round;
// those in use come back at once. Other threads wait for that.
void ScratchMemory::keep_within_budget() noexcept {
  const std::uint64_t most = budget_ - std::min(budget_ / 4, kMostMargin);
  std::uint64_t resident = read_resident(statm_).all;
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
    if (swept / kSweep % 4 == 3) resident = read_resident(statm_).all;
  }
  is_sweeping_.store(false, std::memory_order_release);
}

void ScratchMemory::keep(const std::stop_token& stop) noexcept {
  using Clock = std::chrono::steady_clock;
  auto pause = kFirstCount;
  for (auto next_count = Clock::now() + pause; !stop.stop_requested();) {
    keeper_->keep_within_budget(most_bytes());
    if (Clock::now() >= next_count) {
      keeper_->recount(most_bytes());
      pause = std::min(2 * pause, kLastCount);
      next_count = Clock::now() + pause;
    }
    std::this_thread::sleep_for(keeper_->resident() > budget_ / 2 ? kPeriod : kIdle);
  }
}

}  // namespace intervale

#include "server/resume/build_journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace intervale {
namespace {

constexpr std::array<char, 8> kMagic{'\x89', 'I', 'V', 'J', '\r', '\n', '\x1a', '\n'};
constexpr std::uint32_t kVersion = 1;    // of the file, and of all that records hold
constexpr std::size_t kPiece = 1 << 20;  // bytes that are read or written at a time: of a mapping, so much becomes resident
constexpr std::chrono::seconds kPatience{2};
constexpr int kOpenAttempts = 16;  // whoever finishes a build removes the file that others have just opened

struct FileHeader {
  std::array<char, 8> magic;
  std::uint32_t version, unused;
  std::uint64_t fingerprint, checksum;  // XXH3-64 of all before it
};
struct RecordHeader {
  std::uint32_t kind, first, second, unused;
  std::uint64_t bytes, checksum;  // of the contents
  std::uint64_t header_checksum;  // of all before it
};
static_assert(sizeof(FileHeader) == 32 && sizeof(RecordHeader) == 40, "no padding");

// The checksum of a header: of all but its last number.
template <class Header>
std::uint64_t checksum_of(const Header& header) {
  return XXH3_64bits(&header, sizeof header - sizeof(std::uint64_t));
}

std::string reason(int error) { return std::generic_category().message(error); }
std::string in_quotes(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

// Up to so many bytes; fewer at the end of the file, or where it cannot be read.
std::size_t read_at(int file, std::uint64_t offset, std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t n = ::pread(file, out.data() + done, std::min(out.size() - done, kPiece), off_t(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += std::size_t(n);
  }
  return done;
}

// In place of a header that was not written yet.
bool is_none(const RecordHeader& header) {
  constexpr RecordHeader kNone{};
  return std::memcmp(&header, &kNone, sizeof header) == 0;
}

RecordHeader header_of(const BuildJournal::Name& name, std::uint64_t bytes, std::uint64_t checksum) {
  RecordHeader header{name.kind, name.first, name.second, 0, bytes, checksum, 0};
  header.header_checksum = checksum_of(header);
  return header;
}

// 0, or the error. A process that was killed may take some time to end.
int lock(int file) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (::flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK || std::chrono::steady_clock::now() >= until) return errno;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return 0;
}

// Opens the file, makes it if need be, and locks it. The descriptor.
Result<int> open_locked(const std::filesystem::path& path) {
  const auto cannot = [&path](int error) {
    return fail("cannot open " + in_quotes(path) + ", where a build keeps what is finished: " + reason(error));
  };
  for (int attempt = 0; attempt < kOpenAttempts; ++attempt) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (file < 0) return cannot(errno);
    struct stat opened {
    }, named{};
    if (::fstat(file, &opened) != 0 || !S_ISREG(opened.st_mode)) {
      ::close(file);
      return fail(in_quotes(path) + ", where a build would keep what is finished, is no file");
    }
    if (const int error = lock(file); error != 0) {
      ::close(file);
      if (error == EWOULDBLOCK) return fail("another build has " + in_quotes(path) + " in use: wait for it, or choose another output");
      return cannot(error);
    }
    if (::stat(path.c_str(), &named) == 0 && named.st_ino == opened.st_ino && named.st_dev == opened.st_dev) return file;
    ::close(file);
  }
  return cannot(EBUSY);
}

}  // namespace

BuildJournal::BuildJournal(std::filesystem::path path, int file, Warn warn) : path_(std::move(path)), file_(file), warn_(std::move(warn)) {}

BuildJournal::~BuildJournal() {
  if (records_.empty()) remove();
  if (file_ >= 0) ::close(file_);
}

void BuildJournal::remove() noexcept {
  if (file_ < 0) return;
  ::unlink(path_.c_str());  // before the lock is given back
  ::close(std::exchange(file_, -1));
}

Result<std::unique_ptr<BuildJournal>> BuildJournal::open(const std::filesystem::path& path, std::uint64_t fingerprint, Warn warn) {
  const auto file = open_locked(path);
  if (!file) return tl::unexpected(file.error());
  std::unique_ptr<BuildJournal> journal(new BuildJournal(path, *file, std::move(warn)));
  if (auto ok = journal->start(fingerprint); !ok) return tl::unexpected(ok.error());
  return journal;
}

Result<void> BuildJournal::start(std::uint64_t fingerprint) {
  struct stat status {};
  if (::fstat(file_, &status) != 0) return fail("cannot read " + in_quotes(path_) + ": " + reason(errno));
  FileHeader header{};
  const std::size_t bytes = read_at(file_, 0, std::as_writable_bytes(std::span(&header, 1)));
  if (std::memcmp(&header, kMagic.data(), std::min(bytes, kMagic.size())) != 0) {
    ::close(std::exchange(file_, -1));  // it is not to be removed
    return fail(in_quotes(path_) + ", where a build would keep what is finished, is another file: remove it, or choose another output");
  }
  if (bytes < sizeof header) return empty(fingerprint);  // a build was killed as it began
  if (header.checksum != checksum_of(header)) {
    warn_of_damage();
    return empty(fingerprint);
  }
  if (header.version != kVersion || header.fingerprint != fingerprint) {
    warn_("is of another input, of other options or of another version: the build starts anew");
    return empty(fingerprint);
  }
  scan(std::uint64_t(status.st_size));
  return {};
}

Result<void> BuildJournal::empty(std::uint64_t fingerprint) {
  FileHeader header{kMagic, kVersion, 0, fingerprint, 0};
  header.checksum = checksum_of(header);
  end_ = sizeof header;
  try {
    if (::ftruncate(file_, 0) != 0) return fail("cannot write " + in_quotes(path_) + ": " + reason(errno));
    write(0, std::as_bytes(std::span(&header, 1)));
  } catch (const JournalFailed& failed) {
    return fail(failed.what());
  }
  return {};
}

// The records that are whole, and not yet whether their contents are intact.
void BuildJournal::scan(std::uint64_t file_bytes) {
  end_ = sizeof(FileHeader);
  while (file_bytes - end_ >= sizeof(RecordHeader)) {
    RecordHeader header{};
    if (read_at(file_, end_, std::as_writable_bytes(std::span(&header, 1))) < sizeof header || is_none(header)) break;
    const std::uint64_t offset = end_ + sizeof header;
    if (header.header_checksum != checksum_of(header)) {
      warn_of_damage();
      break;
    }
    if (header.bytes > file_bytes - offset) break;
    records_[{header.kind, header.first, header.second}] = {offset, header.bytes, header.checksum};
    end_ = offset + header.bytes;
  }
  (void)::ftruncate(file_, off_t(end_));  // if it fails, what is written next is written over it
}

void BuildJournal::warn_of_damage() {
  if (!std::exchange(is_warned_, true)) warn_("is damaged: what was finished there is built again");
}

void BuildJournal::drop(const Name& name) {
  const std::lock_guard lock(mutex_);
  warn_of_damage();
  records_.erase(name);
}

void BuildJournal::free(std::uint32_t kind) noexcept {
  const std::lock_guard lock(mutex_);
  const auto begin = records_.lower_bound({kind, 0, 0}), end = records_.lower_bound({kind + 1, 0, 0});
  for (auto record = begin; record != end; ++record) {
    const auto& [offset, bytes, checksum] = record->second;
    if (bytes != 0) (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(offset), off_t(bytes));
  }
  records_.erase(begin, end);
}

std::size_t BuildJournal::count(std::uint32_t kind) const {
  return std::size_t(std::distance(records_.lower_bound({kind, 0, 0}), records_.lower_bound({kind + 1, 0, 0})));
}

void BuildJournal::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(file_, bytes.data(), std::min(bytes.size(), kPiece), off_t(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int error = errno;
      (void)::ftruncate(file_, off_t(end_));
      throw JournalFailed("cannot write " + in_quotes(path_) + ": " + reason(error));
    }
    bytes = bytes.subspan(std::size_t(n));
    offset += std::uint64_t(n);
  }
}

void BuildJournal::append(const Name& name, std::span<const std::byte> contents) {
  const Record record{0, contents.size(), XXH3_64bits(contents.data(), contents.size())};
  const RecordHeader header = header_of(name, record.bytes, record.checksum);
  std::vector<std::byte> bytes(sizeof header + contents.size());
  std::memcpy(bytes.data(), &header, sizeof header);
  if (!contents.empty()) std::memcpy(bytes.data() + sizeof header, contents.data(), contents.size());
  const std::lock_guard lock(mutex_);
  write(end_, bytes);
  records_[name] = {end_ + sizeof header, record.bytes, record.checksum};
  end_ += bytes.size();
}

void BuildJournal::FreeHash::operator()(XXH3_state_s* hash) const noexcept { XXH3_freeState(hash); }

BuildJournal::Writer::Writer(BuildJournal& journal, const Name& name) : journal_(journal), name_(name), hash_(XXH3_createState()) {
  XXH3_64bits_reset(hash_.get());
}

void BuildJournal::Writer::write(std::span<const std::byte> bytes) {
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), kPiece))) {
    const auto piece = bytes.first(std::min(bytes.size(), kPiece));
    XXH3_64bits_update(hash_.get(), piece.data(), piece.size());
    journal_.write(journal_.end_ + sizeof(RecordHeader) + bytes_, piece);
    bytes_ += piece.size();
  }
}

void BuildJournal::Writer::end() {
  const RecordHeader header = header_of(name_, bytes_, XXH3_64bits_digest(hash_.get()));
  const std::lock_guard lock(journal_.mutex_);
  journal_.write(journal_.end_, std::as_bytes(std::span(&header, 1)));
  if (::fdatasync(journal_.file_) != 0 && errno != EINVAL) throw JournalFailed("cannot write " + in_quotes(journal_.path_) + ": " + reason(errno));
  journal_.records_[name_] = {journal_.end_ + sizeof header, header.bytes, header.checksum};
  journal_.end_ += sizeof header + header.bytes;
}

BuildJournal::Reader::Reader(BuildJournal& journal, const Name& name) : journal_(journal), name_(name), hash_(XXH3_createState()) {
  XXH3_64bits_reset(hash_.get());
  const std::lock_guard lock(journal.mutex_);
  const auto found = journal.records_.find(name);
  is_there_ = found != journal.records_.end();
  if (!is_there_) return;
  offset_ = found->second.offset;
  left_ = found->second.bytes;
  checksum_ = found->second.checksum;
}

bool BuildJournal::Reader::read(std::span<std::byte> out) {
  if (!is_good_ || out.size() > left_) return is_good_ = false;
  while (!out.empty()) {
    const auto piece = out.first(std::min(out.size(), kPiece));
    if (read_at(journal_.file_, offset_, piece) != piece.size()) return is_good_ = false;
    XXH3_64bits_update(hash_.get(), piece.data(), piece.size());
    offset_ += piece.size();
    left_ -= piece.size();
    out = out.subspan(piece.size());
  }
  return true;
}

bool BuildJournal::Reader::is_intact() {
  if (!is_there_) return false;
  if (is_good_ && left_ == 0 && XXH3_64bits_digest(hash_.get()) == checksum_) return true;
  journal_.drop(name_);
  return false;
}

}  // namespace intervale

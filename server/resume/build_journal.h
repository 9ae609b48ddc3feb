// The journal of a build: a file of what was finished, so that a later build goes on from there.
//
// A header, then records one after the other, each with its length and checksum. The header of a long record is written
// after its contents, and until then there are zeros in its place. So a process that is killed at any moment leaves whole
// records, and at the end perhaps one that is told to be none. What a machine that fails has not written to its disk,
// checksums find. Numbers are those of the machine; no other program reads the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>

#include "common/util/result.h"

struct XXH3_state_s;

namespace intervale {

// Thrown where a journal cannot be written: what() is one line that names it, and says why.
struct JournalFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Functions that say so are called from any thread, the others from one.
class BuildJournal {
  struct FreeHash {
    void operator()(XXH3_state_s* hash) const noexcept;
  };
  using Hash = std::unique_ptr<XXH3_state_s, FreeHash>;  // XXH3-64 of what comes in pieces

 public:
  // Of a record: what it is, and which one of its kind. kind > 0.
  struct Name {
    std::uint32_t kind = 0, first = 0, second = 0;
    friend bool operator<(const Name& a, const Name& b) { return std::tie(a.kind, a.first, a.second) < std::tie(b.kind, b.first, b.second); }
  };
  // Told one line about what is dropped: without the path, for a warning. From any thread, one call at a time.
  using Warn = std::function<void(const std::string&)>;

  // Opens the file or makes it, and locks it until the end of the process or the journal. fingerprint: of all that the
  // results of the build depend on. A journal of another fingerprint or version is emptied, and warned of. Damage is warned
  // of once, and what follows it dropped. Fails if another process still
  // has the lock after 2 s, or if the file is none of this kind.
  static Result<std::unique_ptr<BuildJournal>> open(const std::filesystem::path& path, std::uint64_t fingerprint, Warn warn);
  BuildJournal(const BuildJournal&) = delete;
  BuildJournal& operator=(const BuildJournal&) = delete;
  // Removes a file without records.
  ~BuildJournal();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::size_t count(std::uint32_t kind) const;  // of the records of a kind

  // Writes a record at once, and forgets an earlier one of this name. Any thread. Throws JournalFailed; what was finished
  // before remains.
  void append(const Name& name, std::span<const std::byte> contents);

  // Writes a long record in pieces, while nobody else writes. Throws as append() does. One that is not ended is dropped.
  class Writer {
   public:
    Writer(BuildJournal& journal, const Name& name);
    void write(std::span<const std::byte> bytes);
    void end();  // the record is on the disk, and counts

   private:
    BuildJournal& journal_;
    Name name_;
    std::uint64_t bytes_ = 0;
    Hash hash_;
  };

  // Reads a record from its beginning, as bytes from outside. Each reader on one thread, several at a time.
  class Reader {
   public:
    Reader(BuildJournal& journal, const Name& name);
    [[nodiscard]] bool is_there() const { return is_there_; }   // if there was such a record
    [[nodiscard]] std::uint64_t left() const { return left_; }  // bytes, at most those of the file
    // The next bytes. False if there are not as many, or if they cannot be read.
    [[nodiscard]] bool read(std::span<std::byte> out);
    // Whether all bytes were read, and are what was written. If not, the record is dropped, with a warning.
    [[nodiscard]] bool is_intact();

   private:
    BuildJournal& journal_;
    Name name_;
    std::uint64_t offset_ = 0, left_ = 0, checksum_ = 0;
    bool is_there_ = false, is_good_ = true;
    Hash hash_;
  };

  // Warns of damage, and forgets a record: also one whose contents make no sense. Any thread.
  void drop(const Name& name);

  // Gives the disk back what the records of a kind take, which are needed no more. They are not there any longer; to a later
  // build they are damaged.
  void free(std::uint32_t kind) noexcept;

  // Removes the file, and gives the lock back. Whatever fails is ignored: the file is of no use to anybody.
  void remove() noexcept;

 private:
  struct Record {
    std::uint64_t offset = 0, bytes = 0, checksum = 0;  // of the contents
  };
  BuildJournal(std::filesystem::path path, int file, Warn warn);
  [[nodiscard]] Result<void> start(std::uint64_t fingerprint);
  [[nodiscard]] Result<void> empty(std::uint64_t fingerprint);
  void scan(std::uint64_t file_bytes);
  void warn_of_damage();
  // Writes at an offset; throws JournalFailed, and cuts the file behind the last record.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);

  std::filesystem::path path_;
  int file_;
  Warn warn_;
  mutable std::mutex mutex_;  // of what follows
  bool is_warned_ = false;
  std::uint64_t end_ = 0;  // of the last record
  std::map<Name, Record> records_;
};

}  // namespace intervale

// What a build has finished, in a journal: the errors of diamonds, by scale; then the parts of its data set before their
// pages are compressed; then those pages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/value_keys.h"
#include "common/ivm/value_volume.h"
#include "common/patch/channel.h"
#include "common/util/result.h"
#include "server/builder/kept_errors.h"
#include "server/resume/build_journal.h"

namespace intervale {

// Functions that begin with take_ give what was kept, from bytes from outside: nothing if it is not there, or damaged, of
// which the journal warns. They allocate no more than the journal has bytes. Functions that begin with keep_ write, and
// throw JournalFailed. Arrays are read and written in pieces of a megabyte, without a copy. One thread; pages from any.
class BuildCheckpoint final : public KeptPages, public KeptErrors {
 public:
  // As BuildJournal::open().
  static Result<std::unique_ptr<BuildCheckpoint>> open(const std::filesystem::path& path, std::uint64_t fingerprint, BuildJournal::Warn warn);

  // Until the values are kept.
  [[nodiscard]] bool find_errors(int scale, std::span<float> errors) override;
  void keep_errors(int scale, std::span<const float> errors) override;
  [[nodiscard]] std::size_t error_scales() const;  // how many are there

  // Of every range, without channels. The name is empty.
  [[nodiscard]] std::optional<ValueVolume::Parts> take_every_range();
  void keep_every_range(const ValueVolume::Parts& parts);

  // Of one range, likewise.
  struct OneRange {
    IntervalVolume::Parts parts;
    std::string values;  // what the build tells of the volume's values at its end, at most 4096 bytes
  };
  [[nodiscard]] std::optional<OneRange> take_one_range();
  void keep_one_range(const IntervalVolume::Parts& parts, const std::string& values);

  // A channel, by its number.
  struct KeptChannel {
    Channel channel;
    ChannelKeys keys;
  };
  [[nodiscard]] std::optional<KeptChannel> take_channel(std::uint32_t number, const SupercubeSet& set);
  void keep_channel(std::uint32_t number, const Channel& channel, const ChannelKeys& keys);

  // Pages of the values above. None is checked before find().
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> find(const PageName& name) override;
  void keep(const PageName& name, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::size_t pages() const;  // how many there were when no build was going on

  [[nodiscard]] const std::filesystem::path& path() const { return journal_->path(); }
  void remove() noexcept { journal_->remove(); }  // once the file that was built is there

 private:
  explicit BuildCheckpoint(std::unique_ptr<BuildJournal> journal) : journal_(std::move(journal)) {}
  std::unique_ptr<BuildJournal> journal_;
};

}  // namespace intervale

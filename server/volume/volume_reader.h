// Reads the samples of a volume in slabs, some slices of z after the other, so that no more than a slab is in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// Has a buffer of 64 KiB, and what a decoder or the program of a library needs.
class VolumeReader {
 public:
  VolumeReader(const VolumeReader&) = delete;
  VolumeReader& operator=(const VolumeReader&) = delete;
  virtual ~VolumeReader() = default;

  [[nodiscard]] const VolumeHeader& header() const { return header_; }
  // Whether the file was found long enough for all samples. If not, memory for them should grow as they arrive.
  [[nodiscard]] bool is_long_enough() const { return is_long_enough_; }
  // The samples of the time point, header().data_bytes() in all, from first to last: fills `out` with the next ones, as
  // they are stored, but in the machine's byte order. out: whole numbers, at most those left. Once the last one is read,
  // the checksum of coded data has been compared.
  [[nodiscard]] Result<void> read(std::span<std::byte> out);
  // Passes over the next bytes; likewise.
  [[nodiscard]] Result<void> skip(std::uint64_t bytes);

 protected:
  VolumeReader(VolumeHeader header, bool is_long_enough) : header_(std::move(header)), is_long_enough_(is_long_enough), left_(header_.data_bytes()) {}
  [[nodiscard]] std::uint64_t left() const { return left_; }  // bytes after those of the present call

 private:
  virtual Result<void> read_next(std::span<std::byte> out) = 0;
  virtual Result<void> skip_next(std::uint64_t bytes);  // reads them

  VolumeHeader header_;
  bool is_long_enough_;
  std::uint64_t left_;
};

// The samples that the header of a file describes. The data may be in another file, in the header's own folder or below
// it. Fails if the file is too short: for raw by its length, for deflate by its greatest ratio (1032), for text by two
// characters a sample; bzip2 shows it as it is decoded. Bytes after the samples are ignored.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_samples(const InputFile& file, const VolumeHeader& header,
                                                                 std::optional<std::uint64_t> time_point = {});

struct RawLayout;

// Of a file of exactly skip_bytes + samples. An invalid layout is misuse; a file of another size fails with both sizes.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_raw(const std::filesystem::path& path, const RawLayout& layout);

// The grid of the samples in a box. To choose what is not there, or too little for a volume, is misuse.
[[nodiscard]] Result<Grid> cropped(const Grid& whole, const SampleBox& box);

// Reads boxes of a volume one after the other, with all components of a sample, or the chosen one.
class BoxReader {
 public:
  // reader: at its beginning; must outlive this.
  explicit BoxReader(VolumeReader& reader) : reader_(reader) {}
  // Appends the stored numbers of a box that lies in the volume, and on z behind all boxes before it.
  [[nodiscard]] Result<void> read(const SampleBox& box, std::vector<std::byte>& to);

 private:
  VolumeReader& reader_;
  std::int64_t next_z_ = 0;
};

// The samples of a reader at its beginning that lie in the box; none: all. Of vectors the component, if one is chosen,
// else all. Slope and intercept are applied. Fails as cropped().
[[nodiscard]] Result<Volume> read_samples(VolumeReader& reader, const std::optional<SampleBox>& box = {});

}  // namespace intervale

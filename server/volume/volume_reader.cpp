#include "server/volume/volume_reader.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace intervale {
namespace {

constexpr std::uint64_t kFirstBytes = 64ull << 20u;  // allocated before any sample has arrived
constexpr std::uint64_t kChunk = 1 << 16;

// Appends samples of a reader. needed: bytes of all that will be appended.
class Appender {
 public:
  Appender(VolumeReader& reader, std::vector<std::byte>& to, std::uint64_t needed) : reader_(reader), to_(to) {
    to.reserve(reader.is_long_enough() ? needed : std::min(needed, kFirstBytes));
  }
  Result<void> append(std::uint64_t bytes) {
    while (bytes > 0) {
      const std::uint64_t before = to_.size(),
                          step = reader_.is_long_enough() ? bytes : std::min(bytes, std::max<std::uint64_t>(before, kFirstBytes));
      to_.resize(before + step);
      if (auto done = reader_.read(std::span(to_).subspan(before)); !done) return done;
      bytes -= step;
    }
    return {};
  }

 private:
  VolumeReader& reader_;
  std::vector<std::byte>& to_;
};

Result<Grid> grid_of(const Grid& whole, const SampleBox& box) {
  std::array<std::int64_t, 3> dims{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t first = box.first[axis], last = box.last[axis], most = whole.dims[axis] - 1;
    const auto place = std::string(" on ") + "xyz"[axis];
    if (first < 0 || last > most)
      return misuse("the samples" + place + " go from 0 to " + std::to_string(most) + ", and " + std::to_string(first) + " to " +
                    std::to_string(last) + " were chosen");
    if (last <= first) return misuse("two samples" + place + " at least must be chosen, the first before the last");
    dims[axis] = last - first + 1;
  }
  Affine affine = whole.affine;
  const Vec3 origin = affine.point({double(box.first[0]), double(box.first[1]), double(box.first[2])});
  for (std::size_t row = 0; row < 3; ++row) affine.rows[4 * row + 3] = origin[row];
  return make_grid(dims, affine, "the chosen samples");
}

// A row along x, from which `component` is kept of each of its samples first to last.
class RowPicker {
 public:
  RowPicker(const VolumeHeader& header, std::int64_t first, std::int64_t last)
      : width_(size_of(header.type)), stride_(width_ * header.components), row_(std::size_t(header.grid.dims[0]) * stride_) {
    begin_ = std::size_t(first) * stride_ + header.component.value_or(0) * width_;
    kept_ = header.component ? width_ : stride_;
    count_ = std::size_t(last - first + 1);
  }
  Result<void> pick(VolumeReader& reader, std::vector<std::byte>& to) {
    if (auto done = reader.read(row_); !done) return done;
    const auto* from = row_.data() + begin_;
    if (kept_ == stride_) {
      to.insert(to.end(), from, from + count_ * stride_);
      return {};
    }
    for (std::size_t i = 0; i < count_; ++i, from += stride_) to.insert(to.end(), from, from + kept_);
    return {};
  }

 private:
  std::size_t width_, stride_;  // bytes of a number; of a sample
  std::vector<std::byte> row_;
  std::size_t begin_ = 0, kept_ = 0, count_ = 0;
};

}  // namespace

Result<void> VolumeReader::read(std::span<std::byte> out) {
  left_ -= out.size();
  return read_next(out);
}

Result<void> VolumeReader::skip(std::uint64_t bytes) {
  left_ -= bytes;
  return skip_next(bytes);
}

Result<void> VolumeReader::skip_next(std::uint64_t bytes) {
  std::vector<std::byte> chunk(std::min(bytes, kChunk));
  while (bytes > 0) {
    const std::uint64_t step = std::min(bytes, kChunk);
    if (auto done = read_next(std::span(chunk).first(step)); !done) return done;
    bytes -= step;
  }
  return {};
}

Result<Volume> read_samples(VolumeReader& reader, const std::optional<SampleBox>& box) {
  const VolumeHeader& header = reader.header();
  const Grid& whole = header.grid;
  Volume volume{{}, whole, header.type, {}, header.labels, header.component ? 1 : header.components};
  SampleBox kept;
  for (std::size_t axis = 0; axis < 3; ++axis) kept.last[axis] = whole.dims[axis] - 1;
  if (box) {
    const auto grid = grid_of(whole, *box);
    if (!grid) return tl::unexpected<Error>(grid.error());
    volume.grid = *grid;
    kept = *box;
  }
  const std::uint64_t row = std::uint64_t(whole.dims[0]) * header.components * size_of(header.type), slice = row * std::uint64_t(whole.dims[1]);
  const std::uint64_t needed = volume.grid.sample_count() * volume.components * size_of(header.type);
  const bool has_whole_rows = volume.grid.dims[0] == whole.dims[0] && volume.components == header.components;
  const std::uint64_t before = std::uint64_t(kept.first[1]) * row, after = std::uint64_t(whole.dims[1] - 1 - kept.last[1]) * row;
  Appender appender(reader, volume.bytes, needed);
  if (auto done = reader.skip(std::uint64_t(kept.first[2]) * slice); !done) return tl::unexpected<Error>(done.error());
  if (has_whole_rows && before + after == 0) {
    if (auto done = appender.append(needed); !done) return tl::unexpected<Error>(done.error());
  } else {
    RowPicker picker(header, kept.first[0], kept.last[0]);
    for (std::int64_t z = kept.first[2]; z <= kept.last[2]; ++z) {
      if (auto done = reader.skip(before); !done) return tl::unexpected<Error>(done.error());
      for (std::int64_t y = kept.first[1]; y <= kept.last[1]; ++y) {
        if (auto done = has_whole_rows ? appender.append(row) : picker.pick(reader, volume.bytes); !done) return tl::unexpected<Error>(done.error());
      }
      if (auto done = reader.skip(after); !done) return tl::unexpected<Error>(done.error());
    }
  }
  rescale(volume, header.slope, header.intercept);
  return volume;
}

}  // namespace intervale

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
    to.reserve(to.size() + (reader.is_long_enough() ? needed : std::min(needed, kFirstBytes)));
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
  left_ += bytes;  // each chunk is counted when it is read
  while (bytes > 0) {
    const std::uint64_t step = std::min(bytes, kChunk);
    if (auto done = read(std::span(chunk).first(step)); !done) return done;
    bytes -= step;
  }
  return {};
}

Result<Grid> cropped(const Grid& whole, const SampleBox& box) {
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

Result<void> BoxReader::read(const SampleBox& box, std::vector<std::byte>& to) {
  const VolumeHeader& header = reader_.header();
  const auto [nx, ny, nz] = header.grid.dims;
  const std::uint64_t row = std::uint64_t(nx) * header.components * size_of(header.type), slice = row * std::uint64_t(ny);
  const std::uint64_t before = std::uint64_t(box.first[1]) * row, after = std::uint64_t(ny - 1 - box.last[1]) * row;
  const bool has_whole_rows = box.first[0] == 0 && box.last[0] == nx - 1 && (header.components == 1 || !header.component);
  std::uint64_t needed = size_of(header.type) * (header.component ? 1 : header.components);
  for (std::size_t axis = 0; axis < 3; ++axis) needed *= std::uint64_t(box.last[axis] - box.first[axis] + 1);
  if (auto done = reader_.skip(std::uint64_t(box.first[2] - next_z_) * slice); !done) return done;
  next_z_ = box.last[2] + 1;
  Appender appender(reader_, to, needed);
  if (has_whole_rows && before + after == 0) return appender.append(needed);
  RowPicker picker(header, box.first[0], box.last[0]);
  for (std::int64_t z = box.first[2]; z <= box.last[2]; ++z) {
    if (auto done = reader_.skip(before); !done) return done;
    for (std::int64_t y = box.first[1]; y <= box.last[1]; ++y) {
      if (auto done = has_whole_rows ? appender.append(row) : picker.pick(reader_, to); !done) return done;
    }
    if (auto done = reader_.skip(after); !done) return done;
  }
  return {};
}

Result<Volume> read_samples(VolumeReader& reader, const std::optional<SampleBox>& box) {
  const VolumeHeader& header = reader.header();
  Volume volume{{}, header.grid, header.type, {}, header.labels, header.component ? 1 : header.components};
  SampleBox kept;
  for (std::size_t axis = 0; axis < 3; ++axis) kept.last[axis] = header.grid.dims[axis] - 1;
  if (box) {
    const auto grid = cropped(header.grid, *box);
    if (!grid) return tl::unexpected<Error>(grid.error());
    volume.grid = *grid;
    kept = *box;
  }
  if (auto done = BoxReader(reader).read(kept, volume.bytes); !done) return tl::unexpected<Error>(done.error());
  rescale(volume, header.slope, header.intercept);
  return volume;
}

}  // namespace intervale

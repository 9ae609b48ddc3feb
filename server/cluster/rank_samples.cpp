#include "server/cluster/rank_samples.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "server/cluster/shares.h"

namespace intervale {
namespace {

// A box has two samples on an axis at least.
void widen(SampleBox& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (box.first[axis] == box.last[axis] && box.first[axis] > 0) --box.first[axis];
  }
}

// What memory is given in: small pages, so that a sample that is written does not take those around it.
void use_small_pages(std::byte* bytes, std::size_t count) {
  const auto page = std::uintptr_t(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t begin = (std::uintptr_t(bytes) + page - 1) / page * page, end = (std::uintptr_t(bytes) + count) / page * page;
  if (begin < end) (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_NOHUGEPAGE);
}

}  // namespace

RankSamples::RankSamples(const Domain& domain, SampleType type)
    : last_(domain.last()),
      type_(type),
      count_(std::size_t(last_.x + 1) * std::size_t(last_.y + 1) * std::size_t(last_.z + 1)),
      bytes_(new std::byte[count_ * size_of(type)]) {
  use_small_pages(bytes_.get(), count_ * size_of(type));
}

Result<void> RankSamples::read(const std::vector<bool>& cells, const ReadBox& read_box, const std::function<void(const Volume&)>& seen) {
  const std::size_t size = size_of(type_);
  for (std::int32_t first_z = 0; first_z <= last_.z; first_z += Shares::kCellSide) {
    const std::int32_t last_z = std::min(first_z + Shares::kCellSide - 1, last_.z);
    SampleBox box{{last_.x, last_.y, first_z}, {-1, -1, last_z}};
    for_each_run(cells, last_, first_z, first_z, [&](std::int32_t y, std::int32_t, std::int32_t first, std::int32_t last) {
      box.first = {std::min<std::int64_t>(box.first[0], first), std::min<std::int64_t>(box.first[1], y), first_z};
      box.last = {std::max<std::int64_t>(box.last[0], last), std::max<std::int64_t>(box.last[1], y), last_z};
    });
    if (box.last[0] < 0) continue;
    widen(box);
    const auto volume = read_box(box);
    if (!volume) return tl::unexpected(volume.error());
    seen(*volume);
    const auto [nx, ny, nz] = volume->grid.dims;
    for_each_run(cells, last_, first_z, last_z, [&, nx = nx, ny = ny](std::int32_t y, std::int32_t z, std::int32_t first, std::int32_t last) {
      const auto from =
          ((std::size_t(z - box.first[2]) * std::size_t(ny) + std::size_t(y - box.first[1])) * std::size_t(nx)) + std::size_t(first - box.first[0]);
      std::memcpy(at(first, y, z), volume->bytes.data() + from * size, std::size_t(last - first + 1) * size);
    });
  }
  return {};
}

void RankSamples::for_each_layer(const std::vector<bool>& cells, bool changes, const std::function<void(Volume&)>& visit) {
  const std::size_t size = size_of(type_);
  Volume layer;
  layer.type = type_;
  for (std::int32_t first_z = 0; first_z <= last_.z; first_z += Shares::kCellSide) {
    const std::int32_t last_z = std::min(first_z + Shares::kCellSide - 1, last_.z);
    layer.bytes.clear();
    for_each_run(cells, last_, first_z, last_z, [&](std::int32_t y, std::int32_t z, std::int32_t first, std::int32_t last) {
      layer.bytes.insert(layer.bytes.end(), at(first, y, z), at(first, y, z) + std::size_t(last - first + 1) * size);
    });
    if (layer.bytes.empty()) continue;
    visit(layer);
    if (!changes) continue;
    std::size_t next = 0;
    for_each_run(cells, last_, first_z, last_z, [&](std::int32_t y, std::int32_t z, std::int32_t first, std::int32_t last) {
      const std::size_t count = std::size_t(last - first + 1) * size;
      std::memcpy(at(first, y, z), layer.bytes.data() + next, count);
      next += count;
    });
  }
}

}  // namespace intervale

#include "server/cluster/rank_samples.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <new>

#include "server/cluster/shares.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

// What memory is given in: small pages, so that a sample that is written does not take those around it.
void use_small_pages(std::byte* bytes, std::size_t count) {
  const auto page = std::uintptr_t(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t begin = (std::uintptr_t(bytes) + page - 1) / page * page, end = (std::uintptr_t(bytes) + count) / page * page;
  if (begin < end) (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_NOHUGEPAGE);
}

// The system refuses to promise more memory than it has, unless it is told that it need not.
std::unique_ptr<std::byte[], FreeSamples> allocate(std::size_t count) {
  if (auto* const bytes = new (std::nothrow) std::byte[count]) return {bytes, FreeSamples()};
  void* const mapped = ::mmap(nullptr, count, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (mapped == MAP_FAILED) throw std::bad_alloc();
  return {static_cast<std::byte*>(mapped), FreeSamples{count}};
}

}  // namespace

void FreeSamples::operator()(std::byte* bytes) const {
  if (mapped == 0)
    delete[] bytes;
  else
    ::munmap(bytes, mapped);
}

RankSamples::RankSamples(const Domain& domain, SampleType type)
    : last_(domain.last()),
      type_(type),
      count_(std::size_t(last_.x + 1) * std::size_t(last_.y + 1) * std::size_t(last_.z + 1)),
      bytes_(allocate(count_ * size_of(type))) {
  use_small_pages(bytes_.get(), count_ * size_of(type));
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

namespace {

// One rank's reading of some cells.
class RankReading {
 public:
  RankReading(Ranks& ranks, const RankInput& input, const Domain& domain, const std::vector<bool>& cells)
      : ranks_(ranks), input_(input), header_(input.header), domain_(domain), cells_(cells) {
    if (input.crop) origin_ = input.crop->first;
  }

  Result<std::vector<RankSamples>> run() {
    if (auto ok = agree(ranks_, check_same()); !ok) return tl::unexpected(ok.error());
    SampleType type = header_.type;
    if (header_.slope != 1 || header_.intercept != 0) {
      StoredRange stored;
      const auto add = [&stored](const Volume& layer, const SampleBox&) {
        stored.add(layer);
        return Result<void>();
      };
      if (auto ok = agree(ranks_, for_each_box(add)); !ok) return tl::unexpected(ok.error());
      std::array<double, 2> both{-stored.least, stored.greatest};
      ranks_.max(both);
      type = rescaled_type(header_.type, {-both[0], both[1]}, header_.slope, header_.intercept);
    }
    std::vector<RankSamples> samples;
    for (unsigned c = 0; c < components(); ++c) samples.emplace_back(domain_, type);
    const auto put = [&](Volume& layer, const SampleBox& box) -> Result<void> {
      rescale(layer, header_.slope, header_.intercept, type);
      if (auto finite = check_finite(layer, input_.nan, in_file(box).first); !finite) return finite;
      for (unsigned c = 0; c < components(); ++c) copy_cells(components() == 1 ? layer : component_of(layer, c), box, samples[c]);
      return {};
    };
    if (auto ok = agree(ranks_, for_each_box(put)); !ok) return tl::unexpected(ok.error());
    return samples;
  }

 private:
  using VisitBox = std::function<Result<void>(Volume& layer, const SampleBox& box)>;

  [[nodiscard]] Result<void> changed() const { return fail("'" + input_.name + "' was changed while it was read"); }
  // All ranks have seen the same file.
  Result<void> check_same() const {
    const auto [nx, ny, nz] = header_.grid.dims;
    const std::array<double, 9> own{double(nx),
                                    double(ny),
                                    double(nz),
                                    double(header_.type),
                                    double(components()),
                                    double(header_.components),
                                    double(header_.component.value_or(0)),
                                    header_.slope,
                                    header_.intercept};
    const std::vector<double> all = joined<double>(ranks_, own);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i] != own[i % own.size()]) return changed();
    }
    return {};
  }
  [[nodiscard]] unsigned components() const { return header_.component ? 1 : header_.components; }
  [[nodiscard]] SampleBox in_file(SampleBox box) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.first[axis] += origin_[axis];
      box.last[axis] += origin_[axis];
    }
    return box;
  }

  // Calls visit with the box around the cells of each layer, its numbers as they are stored.
  Result<void> for_each_box(const VisitBox& visit) const {
    const auto reader = input_.open();
    if (!reader) return tl::unexpected(reader.error());
    if (!(*reader)->header().is_alike(header_)) return changed();
    BoxReader boxes(**reader);
    const Vertex last = domain_.last();
    for (std::int32_t first_z = 0; first_z <= last.z; first_z += Shares::kCellSide) {
      SampleBox box{{last.x, last.y, first_z}, {-1, -1, std::min(first_z + Shares::kCellSide - 1, last.z)}};
      for_each_run(cells_, last, first_z, first_z, [&](std::int32_t y, std::int32_t, std::int32_t from, std::int32_t to) {
        box.first = {std::min<std::int64_t>(box.first[0], from), std::min<std::int64_t>(box.first[1], y), box.first[2]};
        box.last = {std::max<std::int64_t>(box.last[0], to), std::max<std::int64_t>(box.last[1], y), box.last[2]};
      });
      if (box.last[0] < 0) continue;
      Volume layer{input_.name, {}, header_.type, {}, {}, components()};
      for (std::size_t axis = 0; axis < 3; ++axis) layer.grid.dims[axis] = std::int32_t(box.last[axis] - box.first[axis] + 1);
      if (auto ok = boxes.read(in_file(box), layer.bytes); !ok) return ok;
      if (auto ok = visit(layer, box); !ok) return ok;
    }
    return {};
  }

  void copy_cells(const Volume& layer, const SampleBox& box, RankSamples& to) const {
    const std::size_t size = size_of(layer.type);
    const auto [nx, ny, nz] = layer.grid.dims;
    for_each_run(cells_, domain_.last(), std::int32_t(box.first[2]), std::int32_t(box.last[2]),
                 [&, nx = nx, ny = ny](std::int32_t y, std::int32_t z, std::int32_t first, std::int32_t last) {
                   const auto from = (std::size_t(z - box.first[2]) * std::size_t(ny) + std::size_t(y - box.first[1])) * std::size_t(nx) +
                                     std::size_t(first - box.first[0]);
                   std::memcpy(to.at(first, y, z), layer.bytes.data() + from * size, std::size_t(last - first + 1) * size);
                 });
  }

  Ranks& ranks_;
  const RankInput& input_;
  const VolumeHeader& header_;
  const Domain& domain_;
  const std::vector<bool>& cells_;
  std::array<std::int64_t, 3> origin_{};  // the first sample that is kept, in the file
};

}  // namespace

Result<std::vector<RankSamples>> read_on_ranks(Ranks& ranks, const RankInput& input, const Domain& domain, const std::vector<bool>& cells) {
  return RankReading(ranks, input, domain, cells).run();
}

}  // namespace intervale

#include "server/builder/make_volume_table.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "common/patch/visit_samples.h"
#include "server/builder/cell_tets.h"
#include "server/builder/sample_range.h"
#include "server/builder/volume_positions.h"

namespace intervale {
namespace {

constexpr double kUnit = 1 << 24;  // of a tetrahedron's volume: sums of whole numbers do not depend on their order

constexpr std::size_t kCells = 1 << 19;  // of a larger volume, about so many are summed

// The place of a value among the positions: 2j + 1 at position j, 2j between positions j - 1 and j.
using PlaceCode = std::uint16_t;  // few enough positions: a tolerance lies between every other two

class Places {
 public:
  explicit Places(std::span<const double> positions)
      : positions_(positions), first_(kBuckets + 2), from_(positions.front()), scale_(kBuckets / 2.0 / (positions.back() / 2 - from_ / 2)) {
    if (!std::isfinite(scale_)) scale_ = 0;  // one position, or hardly distant ones
    for (const double p : positions_) ++first_[bucket(p) + 1];
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  }

  // Of a value within the positions.
  [[nodiscard]] PlaceCode of(double value) const {
    const std::size_t b = bucket(value);
    const auto begin = positions_.begin() + first_[b], end = positions_.begin() + first_[b + 1];
    const auto found = end - begin < 8 ? std::find_if(begin, end, [value](double p) { return p >= value; }) : std::lower_bound(begin, end, value);
    const auto j = found - positions_.begin();
    return PlaceCode(2 * j + (found != positions_.end() && *found == value));
  }

 private:
  static constexpr std::size_t kBuckets = 1 << 12;
  [[nodiscard]] std::size_t bucket(double value) const { return std::min(kBuckets, std::size_t((value / 2 - from_ / 2) * scale_ * 2)); }
  std::span<const double> positions_;
  std::vector<std::uint32_t> first_;  // by bucket: the first position in it
  double from_, scale_;
};

// By position.
struct Sums {
  std::vector<std::uint64_t> whole;     // tetrahedra that lie below it (or at it) and not below the previous one
  std::vector<std::uint64_t> part;      // what lies below it of tetrahedra that it divides, in units
  std::vector<std::uint64_t> constant;  // tetrahedra that have its value at all corners
  explicit Sums(std::size_t positions) : whole(positions), part(positions + kPadding), constant(positions) {}
  static constexpr std::size_t kPadding = 4;  // TetShares adds to so many at once
};

// The shares of one tetrahedron that lie below positions.
//
// With values a <= b <= c <= d they are those of a divided difference of degree 3 (Carl de Boor, A Practical Guide to
// Splines, 1978, chapter IX): a mean of the shares that triangles with the values a, b, c and b, c, d have, which are
// means of the shares of edges. Everything stays within [0, 1], so nothing cancels, however close the values are.
class TetShares {
 public:
  static constexpr int kLanes = int(Sums::kPadding);  // positions at once

  explicit TetShares(std::array<double, 4> f) {
    const auto order = [&f](int i, int j) {
      const double low = std::min(f[i], f[j]), high = std::max(f[i], f[j]);
      f[i] = low, f[j] = high;
    };
    order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
    least_ = f[0];
    greatest_ = f[3];
    scale_ = 1 / (f[3] - f[0]);
    b_ = float((f[1] - f[0]) * scale_);
    c_ = float((f[2] - f[0]) * scale_);
    per_ab_ = 1 / b_;  // infinite where two values are equal: a share is then 0 or 1
    per_bc_ = 1 / (c_ - b_);
    per_cd_ = 1 / (1 - c_);
    per_ac_ = 1 / c_;
    per_bd_ = 1 / (1 - b_);
  }

  // Adds the shares at kLanes positions greater than the tetrahedron's least value; nothing at those not less than its
  // greatest one.
  void add(const double* positions, std::uint64_t* part) const {
    Lanes p{};
    for (int i = 0; i < kLanes; ++i) p[i] = positions[i] < greatest_ ? float((positions[i] - least_) * scale_) : kBeyond;
    const Lanes ab = share(p * per_ab_), bc = share((p - b_) * per_bc_), cd = share((p - c_) * per_cd_);
    const Lanes ac = share(p * per_ac_), bd = share((p - b_) * per_bd_);
    const Lanes abc = bc + ac * (ab - bc), bcd = cd + bd * (bc - cd);
    const Lanes abcd = bcd + p * (abc - bcd);
    const Lanes units = p < kBeyond ? abcd * float(kUnit) : Lanes{};
    for (int i = 0; i < kLanes; ++i) part[i] += std::uint32_t(std::int32_t(units[i]));
  }

 private:
  using Lanes [[gnu::vector_size(kLanes * sizeof(float))]] = float;
  // Into [0, 1]; 0 for what is no number, which is at the value of two equal corners, where the share has no weight.
  static Lanes share(Lanes ratio) {
    const Lanes positive = ratio > 0 ? ratio : Lanes{};
    return positive < 1 ? positive : Lanes{} + 1;
  }
  static constexpr float kBeyond = 2;  // for positions not less than the greatest value; others are in [0, 1]
  double least_, greatest_, scale_;
  float b_, c_, per_ab_, per_bc_, per_cd_, per_ac_, per_bd_;
};

// The sums over all cells of a volume; over about kCells of a larger one, which lie evenly in it.
template <class T>
class CellSums {
 public:
  // wanted: in which cells; empty: in all
  CellSums(std::span<const T> samples, const std::array<std::int32_t, 3>& dims, std::span<const double> positions, const CellFilter& wanted)
      : samples_(samples), row_(dims[0]), slice_(row_ * dims[1]), dims_(dims), positions_(positions), places_(positions), wanted_(wanted) {
    stride_ = std::max<std::uint64_t>(kOneCell, std::uint64_t(double(samples.size()) / double(kCells) * double(kOneCell)));
    for (const double p : positions) scaled_.push_back(p * kScale);
    scaled_.resize(positions.size() + TetShares::kLanes, std::numeric_limits<double>::infinity());
  }

  [[nodiscard]] Sums run() const {
    tbb::enumerable_thread_specific<Sums> all(positions_.size());
    tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, dims_[2] - 1, kSlices), [&](const auto& slices) {
      Sums& sums = all.local();
      if (wanted_) {
        for (std::int32_t z = slices.begin(); z < slices.end(); ++z) {
          for (std::int32_t y = 0; y + 1 < dims_[1]; ++y) add_wanted(y, z, sums);
        }
        return;
      }
      std::vector<PlaceCode> codes(std::size_t(2 * slice_));  // of two slices: of even z first
      encode(slices.begin(), codes);
      for (std::int32_t z = slices.begin(); z < slices.end(); ++z) {
        encode(z + 1, codes);
        for (std::int32_t y = 0; y + 1 < dims_[1]; ++y) add_row(y, z, codes, sums);
      }
    });
    Sums result(positions_.size());
    for (const Sums& sums : all) {
      for (std::size_t j = 0; j < positions_.size(); ++j) {
        result.whole[j] += sums.whole[j];
        result.part[j] += sums.part[j];
        result.constant[j] += sums.constant[j];
      }
    }
    return result;
  }

 private:
  // The place of the first of the cells summed in a row, below the stride. (y, z) times these constants spreads evenly
  // over the numbers of 32 bits: Martin Roberts, The Unreasonable Effectiveness of Quasirandom Sequences, 2018.
  [[nodiscard]] std::uint64_t first_cell(std::int32_t y, std::int32_t z) const {
    const std::uint32_t place = std::uint32_t(y) * 0xc13fa9a9u + std::uint32_t(z) * 0x91e10da5u;
    return std::uint64_t(double(place) / double(kOneCell) * double(stride_));
  }

  void encode(std::int32_t z, std::vector<PlaceCode>& codes) const {
    const T* const from = &samples_[std::size_t(z * slice_)];
    PlaceCode* const to = codes.data() + (z & 1) * slice_;
    for (std::ptrdiff_t i = 0; i < slice_; ++i) to[i] = i > 0 && from[i] == from[i - 1] ? to[i - 1] : places_.of(double(from[i]));
  }

  // The cells between rows y and y + 1 of slices z and z + 1.
  void add_row(std::int32_t y, std::int32_t z, const std::vector<PlaceCode>& codes, Sums& sums) const {
    // By the parity of x. Codes: slice z may be the second one of the two.
    const std::array<std::array<std::ptrdiff_t, 8>, 2> corners{cell_corners({0, y, z}, row_, slice_), cell_corners({1, y, z}, row_, slice_)};
    const std::ptrdiff_t up = (z & 1) != 0 ? -slice_ : slice_;
    const std::array<std::array<std::ptrdiff_t, 8>, 2> coded{cell_corners({0, y, z}, row_, up), cell_corners({1, y, z}, row_, up)};
    const T* const values = &samples_[std::size_t(z * slice_ + y * row_)];
    const PlaceCode* const code = codes.data() + (z & 1) * slice_ + y * row_;
    for (std::uint64_t place = first_cell(y, z); std::ptrdiff_t(place >> 32) + 1 < row_; place += stride_) {
      const auto x = std::ptrdiff_t(place >> 32);
      std::array<PlaceCode, 8> k{};
      for (int i = 0; i < 8; ++i) k[i] = code[x + coded[x & 1][i]];
      add_coded(k, values + x, corners[x & 1], sums);
    }
  }

  // The same, of wanted cells. The samples of the others may not be known.
  void add_wanted(std::int32_t y, std::int32_t z, Sums& sums) const {
    const std::array<std::array<std::ptrdiff_t, 8>, 2> corners{cell_corners({0, y, z}, row_, slice_), cell_corners({1, y, z}, row_, slice_)};
    const T* const values = &samples_[std::size_t(z * slice_ + y * row_)];
    for (std::uint64_t place = first_cell(y, z); std::ptrdiff_t(place >> 32) + 1 < row_; place += stride_) {
      const auto x = std::ptrdiff_t(place >> 32);
      if (!wanted_({std::int32_t(x), y, z})) continue;
      std::array<PlaceCode, 8> k{};
      for (int i = 0; i < 8; ++i) k[i] = places_.of(double(values[x + corners[x & 1][i]]));
      add_coded(k, values + x, corners[x & 1], sums);
    }
  }

  void add_coded(const std::array<PlaceCode, 8>& k, const T* values, const std::array<std::ptrdiff_t, 8>& corners, Sums& sums) const {
    const bool undivided = std::all_of(k.begin() + 1, k.end(), [&k](PlaceCode other) { return other == k[0]; });
    if (undivided) {
      sums.whole[k[0] >> 1] += kCellTets.size();
      if ((k[0] & 1) != 0) sums.constant[k[0] >> 1] += kCellTets.size();
    } else {
      add_cell(k, values, corners, sums);
    }
  }

  void add_cell(const std::array<PlaceCode, 8>& k, const T* values, const std::array<std::ptrdiff_t, 8>& corners, Sums& sums) const {
    for (const auto& tet : kCellTets) {
      const PlaceCode low = std::min(std::min(k[tet[0]], k[tet[1]]), std::min(k[tet[2]], k[tet[3]]));
      const PlaceCode high = std::max(std::max(k[tet[0]], k[tet[1]]), std::max(k[tet[2]], k[tet[3]]));
      // The positions that divide it: greater than its least value, less than its greatest one.
      const std::size_t begin = (low + 1u) >> 1, end = high >> 1;
      ++sums.whole[end];
      sums.constant[end] += low == high && (low & 1) != 0;
      if (begin >= end) continue;
      std::array<double, 4> f{};
      for (int i = 0; i < 4; ++i) f[i] = double(values[corners[tet[i]]]) * kScale;
      const TetShares shares(f);
      for (std::size_t j = begin; j < end; j += TetShares::kLanes) shares.add(&scaled_[j], &sums.part[j]);
    }
  }

  std::span<const T> samples_;
  std::ptrdiff_t row_, slice_;
  std::array<std::int32_t, 3> dims_;
  // Places of cells in a row are counted in parts of a cell.
  static constexpr std::uint64_t kOneCell = std::uint64_t(1) << 32;
  std::uint64_t stride_ = kOneCell;           // between the cells summed in a row
  static constexpr std::int32_t kSlices = 4;  // of cells, that a thread takes at once
  // Of values in computations: the difference of two doubles can overflow.
  static constexpr double kScale = sizeof(T) == sizeof(double) ? 0.25 : 1;
  std::span<const double> positions_;
  std::vector<double> scaled_;  // the positions, and infinities up to a multiple of TetShares's lanes
  Places places_;
  const CellFilter& wanted_;
};

VolumeTable table_at(const SampleShare& share, std::vector<double> positions) {
  Sums sums = visit_samples(share.view.type, share.view.bytes,
                            [&]<class T>(std::span<const T> samples) { return CellSums<T>(samples, share.view.dims, positions, share.cells).run(); });
  if (share.sum) {
    for (auto* part : {&sums.whole, &sums.part, &sums.constant}) share.sum(*part);
  }
  const auto tets = double(std::accumulate(sums.whole.begin(), sums.whole.end(), std::uint64_t(0)));
  VolumeTable table{std::move(positions), {}, {}};
  std::uint64_t whole = 0;
  for (std::size_t j = 0; j < table.position.size(); ++j) {
    whole += sums.whole[j];
    const double part = double(sums.part[j]) / kUnit;
    table.below.push_back((double(whole - sums.constant[j]) + part) / tets);
    table.not_above.push_back((double(whole) + part) / tets);
  }
  return table;
}

}  // namespace

VolumeTable make_volume_table(const Volume& volume) {
  const auto [least, greatest] = sample_range(volume);
  return make_volume_table({{volume.type, volume.grid.dims, volume.bytes}, least, greatest, {}, {}, {}});
}

VolumeTable make_volume_table(const SampleShare& share) {
  // A tolerance well below that of the result: it holds for the estimate.
  constexpr double kTolerance = 0.3 * kVolumeTolerance;
  constexpr std::size_t kPoints = 1 << 19, kMostPoints = kPoints << 4;
  for (std::size_t points = kPoints;; points *= 4) {
    std::vector<double> values = values_in_cells(share.view, points, share.cells);
    if (share.join) share.join(values);
    const std::vector<DistributionPoint> estimate = estimate_volumes(std::move(values), share.least, share.greatest, kTolerance);
    std::vector<double> positions;
    positions.reserve(estimate.size());
    for (const DistributionPoint& p : estimate) positions.push_back(p.value);
    VolumeTable table = table_at(share, std::move(positions));
    // Where the estimate differs in what lies between two positions, it may also differ in how that is distributed.
    bool is_close = true;
    for (std::size_t j = 1; j < estimate.size(); ++j) {
      const double estimated = estimate[j].below - estimate[j - 1].not_above, measured = table.below[j] - table.not_above[j - 1];
      is_close = is_close && std::fabs(measured - estimated) <= kVolumeTolerance / 2;
    }
    if (is_close || points == kMostPoints) return table;
  }
}

}  // namespace intervale

#include "server/builder/relevance.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>
#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::uint64_t kEven = 0x5555555555555555u, kOdd = ~kEven;

// A bit for each point of a grid, in rows along x that begin with a word of their own.
class BitGrid {
 public:
  BitGrid() = default;
  explicit BitGrid(const std::array<std::int32_t, 3>& size)
      : size_(size), words_((std::size_t(size[0]) + 63) / 64), bits_(words_ * std::size_t(size[1]) * std::size_t(size[2])) {}

  [[nodiscard]] std::size_t words() const { return words_; }  // of a row
  [[nodiscard]] std::int32_t size(int axis) const { return size_[axis]; }
  [[nodiscard]] std::uint64_t* row(std::int32_t y, std::int32_t z) { return &bits_[words_ * (std::size_t(z) * size_[1] + y)]; }
  [[nodiscard]] const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return &bits_[words_ * (std::size_t(z) * size_[1] + y)]; }

  // Bits of the neighbours at x + step in {-1, 0, 1}; 0 past a row's ends.
  [[nodiscard]] std::uint64_t shifted(const std::uint64_t* row, std::size_t w, int step) const {
    if (step == 0) return row[w];
    if (step < 0) return row[w] << 1 | (w > 0 ? row[w - 1] >> 63 : 0);
    return row[w] >> 1 | (w + 1 < words_ ? row[w + 1] << 63 : 0);
  }

 private:
  std::array<std::int32_t, 3> size_{};
  std::size_t words_ = 0;
  std::vector<std::uint64_t> bits_;
};

// Calls visit(y, z) for all rows, in parallel.
template <class Visit>
void for_each_row(std::int32_t ny, std::int32_t nz, Visit&& visit) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, std::size_t(ny) * std::size_t(nz), 16), [&](const auto& rows) {
    for (std::size_t r = rows.begin(); r != rows.end(); ++r) visit(std::int32_t(r % std::size_t(ny)), std::int32_t(r / std::size_t(ny)));
  });
}

// Bits 0, 2, 4, ... of a word side by side.
std::uint64_t every_other(std::uint64_t v) {
  v &= kEven;
  v = (v | v >> 1) & 0x3333333333333333u;
  v = (v | v >> 2) & 0x0f0f0f0f0f0f0f0fu;
  v = (v | v >> 4) & 0x00ff00ff00ff00ffu;
  v = (v | v >> 8) & 0x0000ffff0000ffffu;
  return (v | v >> 16) & 0xffffffffu;
}

// Bits begin to end - 1 of a row, as far as they lie in its word w.
std::uint64_t between(std::int32_t begin, std::int32_t end, std::size_t w) {
  const auto first = std::clamp<std::int64_t>(begin - std::int64_t(w) * 64, 0, 64),
             last = std::clamp<std::int64_t>(end - std::int64_t(w) * 64, 0, 64);
  if (first >= last) return 0;
  return (last == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << last) - 1) & ~((std::uint64_t(1) << first) - 1);
}

// Rows have one place more, so that each place's next neighbour is there.
std::array<std::int32_t, 3> with_next(const std::array<std::int32_t, 3>& places) { return {places[0] + 1, places[1], places[2]}; }

// Sides at the places of one scale. A place past the last sample has that sample's side.
struct Sides {
  BitGrid below, above;
  explicit Sides(const std::array<std::int32_t, 3>& places) : below(with_next(places)), above(with_next(places)) {}
};

std::array<std::int32_t, 3> places(const Outlines& outlines) { return {outlines.count(0), outlines.count(1), outlines.count(2)}; }

// Sets the bit `to` of a row as `from` is.
void copy_bit(std::uint64_t* row, std::int32_t from, std::int32_t to) { row[to / 64] |= (row[from / 64] >> (from % 64) & 1) << (to % 64); }

template <class T>
Sides sides_of(std::span<const T> samples, const Grid& grid, const Range& range) {
  Sides sides(grid.dims);
  const std::int32_t nx = grid.dims[0], ny = grid.dims[1];
  for_each_row(ny, grid.dims[2], [&](std::int32_t y, std::int32_t z) {
    const T* const from = &samples[(std::size_t(z) * ny + y) * nx];
    std::uint64_t *const below = sides.below.row(y, z), *const above = sides.above.row(y, z);
    for (std::int32_t x = 0; x < nx; x += 64) {
      // Bytes first, which the compiler does many at a time; then the lowest bits of eight of them are multiplied to stand side by side.
      std::array<std::uint8_t, 64> is_below{}, is_above{};
      const std::int32_t n = std::min(64, nx - x);
      for (std::int32_t i = 0; i < n; ++i) {
        is_below[i] = double(from[x + i]) < range.alpha;
        is_above[i] = double(from[x + i]) > range.beta;
      }
      const auto pack = [](const std::array<std::uint8_t, 64>& bytes) {
        const auto words = std::bit_cast<std::array<std::uint64_t, 8>>(bytes);
        std::uint64_t bits = 0;
        for (int i = 0; i < 8; ++i) bits |= words[i] * 0x0102040810204080u >> 56 << (8 * i);
        return bits;
      };
      below[x / 64] = pack(is_below);
      above[x / 64] = pack(is_above) & ~below[x / 64];
    }
    copy_bit(below, nx - 1, nx);
    copy_bit(above, nx - 1, nx);
  });
  return sides;
}

// The sides one scale further up, of every other place.
Sides coarser(const Sides& fine, const std::array<std::int32_t, 3>& size) {
  Sides coarse(size);
  for_each_row(size[1], size[2], [&](std::int32_t y, std::int32_t z) {
    const std::int32_t from_y = std::min(2 * y, fine.below.size(1) - 1), from_z = std::min(2 * z, fine.below.size(2) - 1);
    const auto halve = [&](const BitGrid& from, BitGrid& to) {
      const std::uint64_t* const in = from.row(from_y, from_z);
      std::uint64_t* const out = to.row(y, z);
      for (std::size_t w = 0; w < from.words(); ++w) {
        if (w / 2 < to.words()) out[w / 2] |= every_other(in[w]) << (w % 2 * 32);
      }
      const std::int32_t last = size[0] - 1;
      out[(last + 1) / 64] &= ~(std::uint64_t(1) << ((last + 1) % 64));
      copy_bit(out, last, last + 1);
    };
    halve(fine.below, coarse.below);
    halve(fine.above, coarse.above);
  });
  return coarse;
}

// Cuts on the edges of the mesh that is refined everywhere: along the axes, and from the even to the odd end of faces' and cells' diagonals.
std::uint64_t count_unit_cuts(const Sides& sides, Vertex last) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::int32_t>(0, last.z + 1), std::uint64_t(0),
      [&](const auto& slices, std::uint64_t n) {
        for (std::int32_t z = slices.begin(); z != slices.end(); ++z) {
          for (std::int32_t y = 0; y <= last.y; ++y) {
            for (int step = 0; step < 4; ++step) {
              const int dy = step & 1, dz = step >> 1;
              if (y + dy > last.y || z + dz > last.z) continue;
              const std::int32_t even_y = y + (dy & y), even_z = z + (dz & z), odd_y = y + (dy & ~y), odd_z = z + (dz & ~z);
              for (const BitGrid* grid : {&sides.below, &sides.above}) {
                const std::uint64_t *const even = grid->row(even_y, even_z), *const odd = grid->row(odd_y, odd_z);
                for (std::size_t w = 0; w < grid->words(); ++w) {
                  const std::uint64_t straight = (even[w] ^ odd[w]) & between(0, last.x + 1, w);
                  const std::uint64_t slant =
                      (((even[w] ^ grid->shifted(odd, w, 1)) & kEven) | ((grid->shifted(even, w, 1) ^ odd[w]) & kOdd)) & between(0, last.x, w);
                  if (straight != 0) n += std::uint64_t(std::popcount(straight));
                  if (slant != 0) n += std::uint64_t(std::popcount(slant));
                }
              }
            }
          }
        }
        return n;
      },
      std::plus<>());
}

// The relevant diamonds of one scale, by centre in units of h.
class Judge {
 public:
  Judge(const Outlines& outlines, const Sides& sides, Refine refine, const BitGrid* finer)
      : outlines_(outlines), sides_(sides), refine_(refine), finer_(finer), relevant_(with_next(places(outlines))) {}

  // Children first. Where b of y and z are odd, those of even x are of class 3 - b, those of odd x of class 2 - b; their children have either fewer
  // odd coordinates in y and z, or an even x beside them, or are of the finer scale. So rows of one b can be done side by side.
  BitGrid judge() && {
    for (int b = 0; b < 3; ++b) {
      for_each_row(relevant_.size(1), relevant_.size(2), [&](std::int32_t y, std::int32_t z) {
        if ((y & 1) + (z & 1) != b) return;
        if (b > 0) judge_row(y, z, 0);
        judge_row(y, z, 1);
      });
    }
    return std::move(relevant_);
  }

 private:
  void judge_row(std::int32_t y, std::int32_t z, int odd_x) {
    const std::int32_t n = relevant_.size(0) - 1;
    const int place_y = outlines_.place(1, y), place_z = outlines_.place(2, z);
    // First x between the ends: of two kinds, which are done together inside the box, where both have the same vertices. Then each end by itself.
    std::int32_t end = n;
    while (end > 1 && outlines_.place(0, end - 1) > 4) --end;
    const Outline &first = outlines_.of(1 + odd_x, place_y, place_z), &second = outlines_.of(3 + odd_x, place_y, place_z);
    const std::uint64_t every_fourth = 0x1111111111111111u << odd_x;
    if (first.interior && second.interior) {
      judge_some(first, y, z, 1, end, every_fourth | every_fourth << 2);
    } else {
      judge_some(first, y, z, 1, end, every_fourth);
      judge_some(second, y, z, 1, end, every_fourth << 2);
    }
    for (std::int32_t x : {0, end, end + 1}) {
      if (x < n && (x & 1) == odd_x) judge_some(outlines_.of(outlines_.place(0, x), place_y, place_z), y, z, x, x + 1, ~std::uint64_t(0));
    }
  }

  // Those of a row at x in [begin, end) and in the mask, which all have this outline.
  void judge_some(const Outline& outline, std::int32_t y, std::int32_t z, std::int32_t begin, std::int32_t end, std::uint64_t mask) {
    if (!outline.splits) return;
    const DiamondType& row = *outline.row;
    struct Neighbour {
      const std::uint64_t *below, *above;
      int step;
    };
    std::array<Neighbour, kMaxVertices + 1> around;
    int n = 0;
    const auto add = [&](Offset f) {
      const std::int32_t at_y = std::clamp(y + f.y, 0, relevant_.size(1) - 1), at_z = std::clamp(z + f.z, 0, relevant_.size(2) - 1);
      around[n++] = {sides_.below.row(at_y, at_z), sides_.above.row(at_y, at_z), f.x};
    };
    add({});
    for (int v = 0; v < row.vertices; ++v) {
      if (outline.vertices >> v & 1) add(row.vertex[v]);
    }
    std::uint64_t* const out = relevant_.row(y, z);
    for (std::size_t w = std::size_t(begin) / 64; w * 64 < std::size_t(end); ++w) {
      std::uint64_t some_below = 0, all_below = ~std::uint64_t(0), some_above = 0, all_above = ~std::uint64_t(0), some_inside = 0;
      for (int i = 0; i < n; ++i) {
        const std::uint64_t below = sides_.below.shifted(around[i].below, w, around[i].step);
        const std::uint64_t above = sides_.above.shifted(around[i].above, w, around[i].step);
        some_below |= below;
        all_below &= below;
        some_above |= above;
        all_above &= above;
        some_inside |= ~(below | above);
      }
      const std::uint64_t counts =
          refine_ == Refine::uniform ? some_inside | (some_below & some_above) : (some_below & ~all_below) | (some_above & ~all_above);
      out[w] |= (counts | relevant_children(row, y, z, w)) & mask & between(begin, end, w);
    }
  }

  // Those of 64 places that would have a relevant child there.
  [[nodiscard]] std::uint64_t relevant_children(const DiamondType& row, std::int32_t y, std::int32_t z, std::size_t w) const {
    std::uint64_t some = 0;
    if (row.cls == 2 && finer_ == nullptr) return some;
    const BitGrid& grid = row.cls == 2 ? *finer_ : relevant_;
    const int scale = row.cls == 2 ? 2 : 1;
    for (int k = 0; k < row.children; ++k) {
      const Offset f = row.child[k].child;
      const std::int32_t at_y = scale * y + f.y, at_z = scale * z + f.z;
      if (at_y < 0 || at_z < 0 || at_y >= grid.size(1) || at_z >= grid.size(2)) continue;
      const std::uint64_t* const from = grid.row(at_y, at_z);
      if (scale == 1) {
        some |= grid.shifted(from, w, f.x);
        continue;
      }
      for (std::size_t half = 0; half < 2; ++half) {
        if (2 * w + half < grid.words()) some |= every_other(grid.shifted(from, 2 * w + half, f.x)) << (32 * half);
      }
    }
    return some;
  }

  const Outlines& outlines_;
  const Sides& sides_;
  Refine refine_;
  const BitGrid* finer_;
  BitGrid relevant_;
};

using Supercubes = std::vector<std::pair<SupercubeKey, std::uint64_t>>;  // with their occupancy, ascending

Supercubes supercubes_of(const BitGrid& relevant, int scale) {
  const std::array<std::int32_t, 3> n{(relevant.size(0) + 3) / 4, (relevant.size(1) + 3) / 4, (relevant.size(2) + 3) / 4};
  std::vector<Supercubes> slices(n[2]);
  tbb::parallel_for(0, n[2], [&](std::int32_t z) {
    for (std::int32_t y = 0; y < n[1]; ++y) {
      for (std::int32_t x = 0; x < n[0]; ++x) {
        std::uint64_t types = 0;  // bit x + 4 y + 16 z, which is the type
        for (std::int32_t k = 4 * z; k < std::min(4 * z + 4, relevant.size(2)); ++k) {
          for (std::int32_t j = 4 * y; j < std::min(4 * y + 4, relevant.size(1)); ++j)
            types |= (relevant.row(j, k)[x / 16] >> (x % 16 * 4) & 15) << (16 * (k & 3) + 4 * (j & 3));
        }
        if (types == 0) continue;
        std::uint64_t slots = 0;
        for (const int type : set_bits(types)) slots |= std::uint64_t(1) << kSlotOfType[type];
        slices[z].emplace_back(supercube_key(scale, {x, y, z}), slots);
      }
    }
  });
  Supercubes all;
  for (const Supercubes& slice : slices) all.insert(all.end(), slice.begin(), slice.end());
  tbb::parallel_sort(all);
  return all;
}

}  // namespace

Relevance find_relevant(const Volume& volume, const Range& range, Refine refine, const std::vector<Outlines>& outlines) {
  Relevance result;
  std::vector<Supercubes> levels;
  Sides sides = visit_samples(volume, [&]<class T>(std::span<const T> samples) { return sides_of(samples, volume.grid, range); });
  result.unit_cuts = count_unit_cuts(sides, {volume.grid.dims[0] - 1, volume.grid.dims[1] - 1, volume.grid.dims[2] - 1});
  BitGrid finer;
  for (std::size_t scale = 0; scale < outlines.size(); ++scale) {
    if (scale > 0) sides = coarser(sides, places(outlines[scale]));
    finer = Judge(outlines[scale], sides, refine, scale > 0 ? &finer : nullptr).judge();
    levels.push_back(supercubes_of(finer, int(scale)));
  }
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    for (const auto& [key, slots] : *level) {
      keys.push_back(key);
      occupancy.push_back(slots);
    }
    *level = Supercubes();
  }
  result.set = SupercubeSet(keys, std::move(occupancy));
  return result;
}

}  // namespace intervale

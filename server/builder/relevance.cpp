#include "server/builder/relevance.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>
#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "common/patch/visit_samples.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::uint64_t kEven = 0x5555555555555555u, kOdd = ~kEven, kEveryFourth = 0x1111111111111111u;

// A bit for each point of a grid, in rows along x. Each row begins with a new word.
class BitGrid {
 public:
  BitGrid() = default;
  explicit BitGrid(const std::array<std::int32_t, 3>& size)
      : size_(size), words_((std::size_t(size[0]) + 63) / 64), bits_(words_ * std::size_t(size[1]) * std::size_t(size[2])) {}

  [[nodiscard]] std::size_t words() const { return words_; }  // of a row
  [[nodiscard]] std::int32_t size(int axis) const { return size_[axis]; }
  [[nodiscard]] std::uint64_t* row(std::int32_t y, std::int32_t z) { return &bits_[words_ * (std::size_t(z) * size_[1] + y)]; }
  [[nodiscard]] const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return &bits_[words_ * (std::size_t(z) * size_[1] + y)]; }

  // Word w of a row shifted so that each bit is that of the neighbour at x + step, step in {-1, 0, 1}; 0 past the ends
  // of the row.
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

// Bits 0, 2, 4, ... of a word, packed into its lower half.
std::uint64_t every_other(std::uint64_t v) {
  v &= kEven;
  v = (v | v >> 1) & 0x3333333333333333u;
  v = (v | v >> 2) & 0x0f0f0f0f0f0f0f0fu;
  v = (v | v >> 4) & 0x00ff00ff00ff00ffu;
  v = (v | v >> 8) & 0x0000ffff0000ffffu;
  return (v | v >> 16) & 0xffffffffu;
}

// A mask of bits [begin, end) of a row, in its word w.
std::uint64_t between(std::int32_t begin, std::int32_t end, std::size_t w) {
  const auto first = std::clamp<std::int64_t>(begin - std::int64_t(w) * 64, 0, 64),
             last = std::clamp<std::int64_t>(end - std::int64_t(w) * 64, 0, 64);
  if (first >= last) return 0;
  return (last == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << last) - 1) & ~((std::uint64_t(1) << first) - 1);
}

// Rows have one bit more, so that the next neighbour of each exists.
std::array<std::int32_t, 3> with_next(const std::array<std::int32_t, 3>& places) { return {places[0] + 1, places[1], places[2]}; }

// Sides at the vertices of one scale. A vertex past the last sample has that sample's side.
struct Sides {
  BitGrid below, above;
  explicit Sides(const std::array<std::int32_t, 3>& places) : below(with_next(places)), above(with_next(places)) {}
};

std::array<std::int32_t, 3> places(const BorderShapes& shapes) { return {shapes.count(0), shapes.count(1), shapes.count(2)}; }

// Copies bit `from` of a row to bit `to`, which is 0.
void copy_bit(std::uint64_t* row, std::int32_t from, std::int32_t to) { row[to / 64] |= (row[from / 64] >> (from % 64) & 1) << (to % 64); }

template <class T>
Sides sides_of(std::span<const T> samples, const Grid& grid, const Range& range) {
  Sides sides(grid.dims);
  const std::int32_t nx = grid.dims[0], ny = grid.dims[1];
  for_each_row(ny, grid.dims[2], [&](std::int32_t y, std::int32_t z) {
    const T* const from = &samples[(std::size_t(z) * ny + y) * nx];
    std::uint64_t *const below = sides.below.row(y, z), *const above = sides.above.row(y, z);
    for (std::int32_t x = 0; x < nx; x += 64) {
      // Bytes first, which the compiler vectorises; then a multiplication packs the lowest bits of eight of them.
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

// The sides of the next coarser scale: of every other vertex.
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

// Cuts on the edges of the finest mesh: those along the axes, and the diagonals of faces and cells from the even to the
// odd end.
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
  Judge(const BorderShapes& shapes, const Sides& sides, Refine refine, const BitGrid* finer)
      : shapes_(shapes), sides_(sides), refine_(refine), finer_(finer), relevant_(with_next(places(shapes))) {}

  // Children first. Where b of y and z are odd, diamonds at even x are of class 3 - b, those at odd x of class 2 - b.
  // Their children have fewer odd coordinates in y and z, or are their neighbours at even x, or are of the finer scale.
  // So rows with equal b can be judged in parallel.
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
  // Diamonds between the ends of a row are of two kinds of position, which alternate. Inside the box both have the same
  // vertices and are judged together. Each end is judged by itself.
  void judge_row(std::int32_t y, std::int32_t z, int odd_x) {
    const int position_y = shapes_.position(1, y), position_z = shapes_.position(2, z);
    const auto shape_at = [&](int position_x) -> const BorderShape& { return shapes_.of(position_x, position_y, position_z); };
    const std::int32_t end = shapes_.between_end(0), count = shapes_.count(0);
    const BorderShape &first = shape_at(shapes_.between(odd_x)), &second = shape_at(shapes_.between(odd_x + 2));
    const std::uint64_t every_fourth = kEveryFourth << odd_x;
    if (first.interior && second.interior) {
      judge_some(first, y, z, 1, end, every_fourth | every_fourth << 2);
    } else {
      judge_some(first, y, z, 1, end, every_fourth);
      judge_some(second, y, z, 1, end, every_fourth << 2);
    }
    for (const std::int32_t x : {0, end, end + 1}) {
      if (x < count && (x & 1) == odd_x) judge_some(shape_at(shapes_.position(0, x)), y, z, x, x + 1, ~std::uint64_t(0));
    }
  }

  // Judges the diamonds of a row at x in [begin, end) and in the mask, which all have this shape.
  void judge_some(const BorderShape& shape, std::int32_t y, std::int32_t z, std::int32_t begin, std::int32_t end, std::uint64_t mask) {
    if (!shape.splits) return;
    const DiamondType& row = *shape.row;
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
      if (shape.vertices >> v & 1) add(row.vertex[v]);
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

  // Which of 64 centres, of a diamond of this type, have a relevant child.
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

  const BorderShapes& shapes_;
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

Relevance find_relevant(const Volume& volume, const Range& range, Refine refine, const std::vector<BorderShapes>& shapes) {
  Relevance result;
  std::vector<Supercubes> by_scale;
  Sides sides = visit_samples(volume, [&]<class T>(std::span<const T> samples) { return sides_of(samples, volume.grid, range); });
  result.unit_cuts = count_unit_cuts(sides, {volume.grid.dims[0] - 1, volume.grid.dims[1] - 1, volume.grid.dims[2] - 1});
  BitGrid finer;
  for (std::size_t scale = 0; scale < shapes.size(); ++scale) {
    if (scale > 0) sides = coarser(sides, places(shapes[scale]));
    finer = Judge(shapes[scale], sides, refine, scale > 0 ? &finer : nullptr).judge();
    by_scale.push_back(supercubes_of(finer, int(scale)));
  }
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  for (auto supercubes = by_scale.rbegin(); supercubes != by_scale.rend(); ++supercubes) {
    for (const auto& [key, slots] : *supercubes) {
      keys.push_back(key);
      occupancy.push_back(slots);
    }
    *supercubes = Supercubes();
  }
  if (keys.size() > kMostSupercubes) throw std::length_error("the range needs too many updates: choose a smaller one");  // known only now
  result.set = SupercubeSet(keys, std::move(occupancy));
  return result;
}

}  // namespace intervale

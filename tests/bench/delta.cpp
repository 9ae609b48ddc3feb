#include "tests/bench/delta.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/border_shape.h"
#include "common/ranges/interpolation_error.h"
#include "common/util/bits.h"
#include "common/util/round_up.h"
#include "server/builder/find_keys.h"
#include "tests/bench/cases.h"

namespace intervale::bench {
namespace {

constexpr const char* kTooSoon = "Delta wants a diamond split before its parents";

// A diamond's name: its centre in 63 bits.
std::uint64_t id_of(Vertex c) { return std::uint64_t(c.x) | std::uint64_t(c.y) << 21 | std::uint64_t(c.z) << 42; }

// Offsets of a type's children in an array of samples; times h, or of class 2 times h / 2.
using Steps = std::array<std::ptrdiff_t, kMaxChildren>;

template <class T>
class TypedDelta final : public Delta {
 public:
  TypedDelta(const Volume& volume, std::span<const T> samples, const ValueFormat& format)
      : grid_(volume.grid), domain_(grid_.dims), field_{samples, domain_.last()}, format_(format), corners_(corner_keys(volume, format_)) {
    const std::ptrdiff_t row = domain_.last().x + 1, slice = row * (domain_.last().y + 1);
    for (unsigned type = 0; type < steps_.size(); ++type) {
      const DiamondType& t = diamond_type(type);
      const auto step = [&](Offset f) { return f.x + f.y * row + f.z * slice; };
      for (int k = 0; k < t.children; ++k) steps_[type][k] = step(t.child[k].child);
    }
    nodes_.resize(samples.size());
    find_outside();
    const Extremes<T> extremes(field_, on_all_cores);
    for (int scale = 0; scale < domain_.levels(); ++scale) {
      const DiamondErrors<T> error_of(field_, extremes, domain_, scale);
      for (int cls = 2; cls >= 0; --cls) measure(scale, cls, error_of);
    }
  }

  [[nodiscard]] Front refine(const Range& range, Refine mode, double error, Walk walk) const override {
    return mode == Refine::boundary ? refine_as<Refine::boundary>(range, error, walk) : refine_as<Refine::uniform>(range, error, walk);
  }

  [[nodiscard]] std::size_t memory_bytes() const override { return nodes_.size() * sizeof(Node) + outside_.size() * 16; }

 private:
  // Of one diamond. Together, so that a query finds all it tests in one place.
  struct Node {
    float error = -1;  // saturated: no smaller than any child's; -1: there is no diamond, or its split is a no-op
    T min{}, max{};    // over the diamond's vertices and centre, and over those of all that descend from it
  };
  using Index = std::uint32_t;  // of a node: the centre's sample; centres beyond the box come after all samples
  static constexpr Index kNowhere = std::numeric_limits<Index>::max();

  [[nodiscard]] Index index_of(Vertex v) const {
    if (domain_.contains(v)) return Index(field_.index(v));
    if ((v.x | v.y | v.z) < 0) return kNowhere;
    const auto found = outside_.find(id_of(v));
    return found == outside_.end() ? kNowhere : found->second;
  }

  // Centres of a scale lie at multiples of h, none further out than the first one beyond the box.
  [[nodiscard]] Vertex places(int scale) const {
    const auto count = [scale](std::int32_t last) { return std::int32_t(((std::int64_t(last) + (1 << scale) - 1) >> scale) + 1); };
    return {count(field_.last.x), count(field_.last.y), count(field_.last.z)};
  }
  template <class Visit>
  void for_each_in_slice(int scale, std::int32_t z, Visit&& visit) const {
    const Vertex n = places(scale);
    for (std::int32_t y = 0; y < n.y; ++y) {
      for (std::int32_t x = 0; x < n.x; ++x) {
        if (((x | y | z) & 1) != 0) visit(Diamond({x << scale, y << scale, z << scale}));
      }
    }
  }

  void find_outside() {
    for (int scale = 0; scale < domain_.levels(); ++scale) {
      for (std::int32_t z = 0; z < places(scale).z; ++z) {
        for_each_in_slice(scale, z, [&](const Diamond& d) {
          if (domain_.contains(d.centre) || domain_.tets(d) == 0) return;
          outside_.emplace(id_of(d.centre), Index(nodes_.size()));
          nodes_.emplace_back();
        });
      }
    }
  }

  // Diamonds of one scale and class are children of none of their own: slices in any order.
  void measure(int scale, int cls, const DiamondErrors<T>& error_of) {
    tbb::parallel_for(std::int32_t(0), places(scale).z, [&](std::int32_t z) {
      for_each_in_slice(scale, z, [&](const Diamond& d) {
        if (d.row->cls != cls) return;
        const Index index = index_of(d.centre);
        if (index == kNowhere) return;
        const unsigned tets = domain_.tets(d);
        if (tets == 0 || domain_.is_noop(d)) return;
        Node& node = nodes_[index];
        node.error = round_up(error_of(d, BorderShapes::shape_of(domain_, d)));
        node.min = node.max = sample(d.centre);
        const auto take = [&node](T low, T high) {
          node.min = std::min(node.min, low);
          node.max = std::max(node.max, high);
        };
        const unsigned vertices = Domain::vertices(*d.row, tets);
        for (int v = 0; v < d.row->vertices; ++v) {
          if (vertices >> v & 1) take(sample(d.vertex(v)), sample(d.vertex(v)));
        }
        for (int k = 0; k < d.row->children && d.has_children(); ++k) {
          const Index child = index_of(d.child(k));
          if (child == kNowhere || nodes_[child].error < 0) continue;
          node.error = std::max(node.error, nodes_[child].error);
          take(nodes_[child].min, nodes_[child].max);
        }
      });
    });
  }

  [[nodiscard]] T sample(Vertex v) const { return field_.samples[field_.index(domain_.clamp(v))]; }

  // Sides ascend with values; and where they differ among the vertices in a diamond, they do so across an edge of a
  // diamond there, which is then relevant by itself. So this asks neither too much nor too little: at error 0 it splits
  // what Sigma holds.
  template <Refine mode>
  [[nodiscard]] static bool is_wanted(const Node& node, const Range& range, double threshold) {
    if (!(double(node.error) > threshold)) return false;
    const Side low = side_of(double(node.min), range), high = side_of(double(node.max), range);
    return mode == Refine::boundary ? low != high : low != Side::above && high != Side::below;
  }

  template <Refine mode>
  [[nodiscard]] Front refine_as(const Range& range, double error, Walk walk) const {
    const double threshold = error > 0 ? error : -0.5;  // at 0 every relevant diamond, also those without an error
    Front front(grid_, format_, corners_, range, mode);
    const auto wanted = [&](Index i) { return is_wanted<mode>(nodes_[i], range, threshold); };
    if (walk == Walk::diamonds) {
      refine_diamonds(front, wanted);
    } else {
      refine_supercubes(front, wanted);
    }
    return front;
  }

  // From the sample at a diamond's centre.
  [[nodiscard]] ValueKey key(Vertex centre) const {
    if constexpr (std::is_integral_v<T>) {
      return ValueKey(sample(centre)) - ValueKey(format_.first);  // modulo 2^32
    } else {
      return format_.key(double(sample(centre)));
    }
  }

  // Top down, generation by generation: all parents of a diamond are of the generation before its own. Errors and
  // values are saturated, so whatever is wanted has all its parents split by the time its turn comes, and none has to
  // be forced.
  template <class Wanted>
  void refine_diamonds(Front& front, const Wanted& wanted) const {
    struct Reached {
      Vertex centre;
      Index index;
    };
    std::vector<std::uint64_t> seen((nodes_.size() + 63) / 64);
    std::vector<Reached> now, next;
    const auto reach = [&](Vertex centre, Index index) {
      std::uint64_t& word = seen[index / 64];
      const std::uint64_t bit = std::uint64_t(1) << (index % 64);
      if ((word & bit) != 0) return;
      word |= bit;
      if (wanted(index)) next.push_back({centre, index});
    };
    reach(domain_.root(), index_of(domain_.root()));
    FrontCursor cursor(front.state());
    while (!next.empty()) {
      now.swap(next);
      next.clear();
      for (const Reached& r : now) {
        const Diamond d(r.centre);
        cursor.move_to(d);
        if (!cursor.gather_keys(kSlotOfType[d.type])) throw std::logic_error(kTooSoon);
        front.split(cursor, key(d.centre));
        for_each_child(d, reach);
      }
    }
  }

  // The diamonds of one scale in a query, by supercubes in a dense grid.
  struct Level {
    struct Word {
      std::uint64_t seen = 0, wanted = 0;  // slots
    };
    Vertex dims;  // in supercubes
    std::vector<Word> words;
    std::vector<std::uint32_t> touched;  // those with a wanted slot, in order of the first

    explicit Level(Vertex places) : dims{((places.x - 1) >> 2) + 1, ((places.y - 1) >> 2) + 1, ((places.z - 1) >> 2) + 1} {
      words.resize(std::size_t(dims.x) * std::size_t(dims.y) * std::size_t(dims.z));
    }
    [[nodiscard]] std::uint32_t at(Vertex p) const { return std::uint32_t((p.z * dims.y + p.y) * dims.x + p.x); }
    [[nodiscard]] Vertex position(std::uint32_t i) const {
      const auto nx = std::uint32_t(dims.x), ny = std::uint32_t(dims.y);
      return {std::int32_t(i % nx), std::int32_t(i / nx % ny), std::int32_t(i / (nx * ny))};
    }
  };

  // The same scale by scale and class by class, which are the generations, in supercubes: of those the front splits all
  // diamonds at once.
  template <class Wanted>
  void refine_supercubes(Front& front, const Wanted& wanted) const {
    std::vector<Level> levels;
    levels.reserve(std::size_t(domain_.levels()));
    for (int scale = 0; scale < domain_.levels(); ++scale) levels.emplace_back(places(scale));
    const auto reach = [&](Vertex centre, Index index) {
      const int scale = scale_of(centre), up = scale + 2;
      Level& level = levels[std::size_t(scale)];
      const std::uint32_t i = level.at({centre.x >> up, centre.y >> up, centre.z >> up});
      typename Level::Word& word = level.words[i];
      const std::uint64_t bit = std::uint64_t(1) << kSlotOfType[type_of(centre, scale)];
      if ((word.seen & bit) != 0) return;
      word.seen |= bit;
      if (!wanted(index)) return;
      if (word.wanted == 0) level.touched.push_back(i);
      word.wanted |= bit;
    };
    reach(domain_.root(), index_of(domain_.root()));
    std::vector<SlotGroup> groups;
    for (int scale = domain_.levels() - 1; scale >= 0; --scale) {
      Level& level = levels[std::size_t(scale)];
      for (const std::uint64_t cls : kSlotsOfClass) {
        for (std::size_t k = 0; k < level.touched.size(); ++k) {  // grows
          const Vertex p = level.position(level.touched[k]);
          for (const Slot slot : set_bits<Slot>(level.words[level.touched[k]].wanted & cls)) {
            for_each_child(Diamond(centre_of(scale, p, slot), scale, kTypeOfSlot[slot]), reach);
          }
        }
      }
      for (const std::uint32_t i : level.touched) groups.push_back({{}, {}, supercube_key(scale, level.position(i)), level.words[i].wanted});
    }
    std::sort(groups.begin(), groups.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
    const auto keys_of = [this](const SlotGroup& group, std::span<ValueKey, kSlots> keys) {
      for (const Slot slot : set_bits<Slot>(group.slots)) keys[slot] = key(centre_of(group.key, slot));
    };
    if (front.split_all(groups, keys_of)) throw std::logic_error(kTooSoon);
  }

  // Calls reach(centre, index) for the children of a diamond that there may be.
  template <class Reach>
  void for_each_child(const Diamond& d, const Reach& reach) const {
    if (!d.has_children()) return;
    if (!domain_.is_interior(d)) {
      for (int k = 0; k < d.row->children; ++k) {
        const Index index = index_of(d.child(k));
        if (index != kNowhere) reach(d.child(k), index);
      }
      return;
    }
    const auto here = std::ptrdiff_t(field_.index(d.centre));
    const std::ptrdiff_t step = d.row->cls == 2 ? d.h / 2 : d.h;
    for (int k = 0; k < d.row->children; ++k) reach(d.child(k), Index(here + steps_[d.type][k] * step));
  }

  Grid grid_;
  Domain domain_;
  Field<T> field_;
  ValueFormat format_;
  std::array<ValueKey, kRootVertices> corners_;
  std::array<Steps, 64> steps_;
  std::vector<Node> nodes_;
  boost::unordered_flat_map<std::uint64_t, Index> outside_;  // id_of the straddling diamonds whose centre is no sample
};

}  // namespace

std::unique_ptr<Delta> make_delta(const Volume& volume, const ValueFormat& format) {
  return visit_samples(volume, [&]<class T>(std::span<const T> samples) -> std::unique_ptr<Delta> {
    return std::make_unique<TypedDelta<T>>(volume, samples, format);
  });
}

}  // namespace intervale::bench

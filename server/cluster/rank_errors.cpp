// Weiss and De Floriani 2008, sections 4 and 6, as in field_hierarchy.cpp.
#include "server/cluster/rank_errors.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "common/ivm/saturate.h"
#include "common/ivm/value_volume.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/interpolation_error.h"
#include "common/util/bits.h"
#include "common/util/round_up.h"
#include "server/builder/shared_error.h"
#include "server/builder/supercube_family.h"

namespace intervale {
namespace {

constexpr int kWholeMost = 3;  // the coarsest scale whose diamonds reach no further than Shares::kHalo

void raise(float& error, float to) {
  std::atomic_ref<float> at(error);
  for (float now = at.load(std::memory_order_relaxed); now < to && !at.compare_exchange_weak(now, to, std::memory_order_relaxed);) {
  }
}

// The errors of scale 0 around one block, at the points of the lattice of samples.
//
// They are kept nowhere: what counts is what they raise, which is errors of class 2 and scale 1.
class FinestErrors {
 public:
  FinestErrors() : errors_(std::size_t(kSide) * kSide * kSide) {}

  // Of the diamonds of a block; all others that exist around it get 0. Returns the greatest.
  template <class T>
  float measure(const RankField& field, const DiamondErrors<T>& error_of, const std::vector<BorderShapes>& shapes, Vertex block) {
    std::fill(errors_.begin(), errors_.end(), kAbsent);
    first_ = {block.x << 6, block.y << 6, block.z << 6};
    float greatest = 0;
    const Vertex last = last_supercube(field.domain, 0);
    const auto begin = [](std::int32_t c) { return std::max(16 * c - 1, 0); };
    const auto end = [](std::int32_t c, std::int32_t most) { return std::min(16 * c + 16, most); };
    for (std::int32_t z = begin(block.z); z <= end(block.z, last.z); ++z) {
      for (std::int32_t y = begin(block.y); y <= end(block.y, last.y); ++y) {
        for (std::int32_t x = begin(block.x); x <= end(block.x, last.x); ++x) {
          const Vertex p{x, y, z};
          const bool is_own = x >> 4 == block.x && y >> 4 == block.y && z >> 4 == block.z;
          const SupercubeDiamonds diamonds(shapes, supercube_key(0, p));
          for (const Slot slot : set_bits<Slot>(updated_slots(field.domain, 0, p))) {
            const Diamond d = diamonds.diamond(slot);
            const float error = is_own ? round_up(error_of(d, diamonds.shape(slot))) : 0.0F;
            errors_[point(d.centre)] = error;
            greatest = std::max(greatest, error);
          }
        }
      }
    }
    return greatest;
  }

  // Raises those of scale 1 and class 2.
  void raise_parents(const SupercubeSet& coarse, std::vector<float>& errors) {
    raise_class(1, 1);
    raise_class(0, 2);
    // A block has 8 supercubes of scale 1 on an axis.
    for (std::int32_t z = std::max(first_.z / 8 - 1, 0); z <= first_.z / 8 + 8; ++z) {
      for (std::int32_t y = std::max(first_.y / 8 - 1, 0); y <= first_.y / 8 + 8; ++y) {
        for (std::int32_t x = std::max(first_.x / 8 - 1, 0); x <= first_.x / 8 + 8; ++x) {
          const auto found = coarse.find_supercube(1, {x, y, z});
          if (!found) continue;
          const std::uint64_t occupancy = coarse.occupancy()[found->supercube];
          for (const Slot slot : set_bits<Slot>(occupancy & kSlotsOfClass[2])) {
            const Vertex c = centre_of(found->key, slot);
            if (!has_children_near(c)) continue;
            const float least = greatest_of_children(Diamond(c));
            if (least > 0) raise(errors[coarse.first(found->brick, found->supercube) + count_below(occupancy, slot)], least);
          }
        }
      }
    }
  }

 private:
  static constexpr std::int32_t kAround = 4, kSide = 64 + 2 * kAround;  // points around the block, and on an axis
  static constexpr float kAbsent = -1;
  [[nodiscard]] std::size_t point(Vertex v) const {
    return (std::size_t(v.z - first_.z + kAround) * kSide + std::size_t(v.y - first_.y + kAround)) * kSide + std::size_t(v.x - first_.x + kAround);
  }
  [[nodiscard]] bool has_children_near(Vertex c) const {
    const auto is_near = [](std::int32_t at, std::int32_t first) { return at >= first - kAround + 1 && at < first + 64 + kAround - 1; };
    return is_near(c.x, first_.x) && is_near(c.y, first_.y) && is_near(c.z, first_.z);
  }
  [[nodiscard]] float greatest_of_children(const Diamond& d) const {
    float greatest = 0;
    for (int i = 0; i < d.row->children; ++i) greatest = std::max(greatest, errors_[point(d.child(i))]);
    return greatest;
  }
  // Of the diamonds of scale 0 and a class, no further than some points from the block: those beyond are no ancestors of
  // what is in it.
  void raise_class(int cls, std::int32_t around) {
    for (std::int32_t z = first_.z - around; z < first_.z + 64 + around; ++z) {
      for (std::int32_t y = first_.y - around; y < first_.y + 64 + around; ++y) {
        for (std::int32_t x = first_.x - around; x < first_.x + 64 + around; ++x) {
          if (3 - (x & 1) - (y & 1) - (z & 1) != cls) continue;
          float& error = errors_[point({x, y, z})];
          if (error != kAbsent) error = std::max(error, greatest_of_children(Diamond({x, y, z}, 0, type_of({x, y, z}, 0))));
        }
      }
    }
  }

  Vertex first_;
  std::vector<float> errors_;
};

// Measures what is this rank's.
template <class T>
class Measure {
 public:
  Measure(const RankField& field, int rank, RankErrors& errors)
      : field_(field),
        rank_(rank),
        errors_(errors),
        samples_{{reinterpret_cast<const T*>(field.samples.data()), field.samples.size() / sizeof(T)}, field.domain.last()},
        known_(samples_, on_all_cores, field.shares.known_cells(rank)),
        own_(samples_, on_all_cores, field.shares.own_cells(rank)) {
    for (int scale = 0; scale < field.domain.levels(); ++scale) shapes_.emplace_back(field.domain, scale);
  }

  void run(const std::function<void(double)>& progress) {
    for (int scale = 0; scale < field_.domain.levels(); ++scale) {
      if (scale == 0) {
        finest();
      } else if (scale <= kWholeMost) {
        whole(scale);
      } else {
        part(scale);
      }
      if (progress) progress(double(scale + 1) / field_.domain.levels());
    }
  }

 private:
  void finest() {
    const DiamondErrors<T> error_of(samples_, known_, field_.domain, 0);
    std::vector<Vertex> blocks = field_.shares.blocks();
    std::erase_if(blocks, [this](Vertex block) { return field_.shares.rank_of_samples_in(block) != rank_; });
    on_all_cores(blocks.size(), [&](std::size_t i) {
      FinestErrors around;
      raise(errors_.greatest, around.measure(field_, error_of, shapes_, blocks[i]));
      around.raise_parents(field_.coarse, errors_.coarse);
    });
  }

  // Calls visit(number, diamond, shape) for the diamonds of a brick.
  template <class Visit>
  void for_each_in_brick(BrickIndex brick, const Visit& visit) {
    const SupercubeSet& set = field_.coarse;
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      const SupercubeDiamonds diamonds(shapes_, key);
      UpdateIndex next = set.first(brick, s);
      for (const Slot slot : set_bits<Slot>(set.occupancy()[s])) visit(next++, diamonds.diamond(slot), diamonds.shape(slot));
    });
  }

  void whole(int scale) {
    const DiamondErrors<T> error_of(samples_, known_, field_.domain, scale);
    const auto [begin, end] = field_.coarse.of_scale(scale);
    tbb::parallel_for<std::uint32_t>(begin, end, [&](std::uint32_t brick) {
      for_each_in_brick(BrickIndex(brick), [&](UpdateIndex i, const Diamond& d, const BorderShape& shape) {
        if (field_.shares.rank_of_sample(field_.domain.clamp(d.centre)) == rank_) raise(errors_.coarse[i], round_up(error_of(d, shape)));
      });
    });
  }

  void part(int scale) {
    const DiamondErrors<T> error_of(samples_, own_, field_.domain, scale);
    const auto [begin, end] = field_.coarse.of_scale(scale);
    const auto is_met = [&](const Diamond& d) {
      return field_.shares.has_any(rank_, field_.domain.clamp({d.centre.x - d.h, d.centre.y - d.h, d.centre.z - d.h}),
                                   field_.domain.clamp({d.centre.x + d.h, d.centre.y + d.h, d.centre.z + d.h}));
    };
    tbb::parallel_for<std::uint32_t>(begin, end, [&](std::uint32_t brick) {
      for_each_in_brick(BrickIndex(brick), [&](UpdateIndex i, const Diamond& d, const BorderShape& shape) {
        if (!is_met(d)) return;
        raise(errors_.coarse[i], round_up(shared_error(error_of, d, shape)));
      });
    });
  }

  const RankField& field_;
  int rank_;
  RankErrors& errors_;
  Field<T> samples_;
  Extremes<T> known_, own_;
  std::vector<BorderShapes> shapes_;  // by scale
};

// Those that all ranks have kept, the greatest behind the others. False, and zeros: they must be measured.
bool take_kept(Ranks& ranks, RankErrors& errors, KeptErrors* kept) {
  errors.coarse.push_back(0);
  std::array<std::uint64_t, 1> have{kept != nullptr && kept->find_errors(0, errors.coarse) ? 1U : 0U};
  ranks.sum(have);
  const bool are_there = have[0] == std::uint64_t(ranks.size());
  if (are_there) errors.greatest = errors.coarse.back();
  errors.coarse.pop_back();
  if (!are_there) std::fill(errors.coarse.begin(), errors.coarse.end(), 0.0F);
  return are_there;
}

}  // namespace

RankErrors measure_errors(Ranks& ranks, const RankField& field, const std::function<void(double)>& progress, KeptErrors* kept) {
  RankErrors errors;
  errors.coarse.reserve(field.coarse.size() + 1);
  errors.coarse.resize(field.coarse.size());
  if (!take_kept(ranks, errors, kept)) {
    visit_samples(field.type, field.samples, [&]<class T>(std::span<const T>) { Measure<T>(field, ranks.rank(), errors).run(progress); });
    for (const float error : errors.coarse) errors.greatest = std::max(errors.greatest, error);
    ranks.max(std::span(errors.coarse));
    ranks.max(std::span(&errors.greatest, 1));
    if (kept != nullptr) {
      errors.coarse.push_back(errors.greatest);
      kept->keep_errors(0, errors.coarse);
      errors.coarse.pop_back();
    }
  }
  saturate(field.coarse, errors.coarse, field.domain.levels(), on_all_cores);
  return errors;
}

}  // namespace intervale

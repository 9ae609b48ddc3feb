// Fields of exact values, and the fronts that are split by them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/diamond/domain.h"
#include "common/front/front.h"
#include "common/patch/value_format.h"
#include "common/patch/visit_samples.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/special_values.h"

namespace intervale::testing {

// A volume each of whose samples is the value of a key.
struct ValueField {
  Volume volume;
  ValueFormat format;
  Domain domain{volume.grid.dims};

  // Of any vertex: of the sample that it clamps to.
  [[nodiscard]] double value(Vertex v) const {
    const Vertex c = domain.clamp(v);
    return sample(volume, c.x, c.y, c.z);
  }
  [[nodiscard]] ValueKey key(Vertex v) const { return format.key(value(v)); }
  [[nodiscard]] Front front(const Range& range, Refine refine) const {
    const Diamond root(domain.root());
    std::array<ValueKey, kRootVertices> corners{};
    for (int v = 0; v < kRootVertices; ++v) corners[std::size_t(v)] = key(root.vertex(v));
    return {volume.grid, format, corners, range, refine};
  }
};

// step: of the samples' values; 0 for floats as they are.
inline ValueField value_field(Volume volume, double step) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  visit_samples(volume, [&](auto samples) {
    for (const auto s : samples) least = std::min(least, double(s)), greatest = std::max(greatest, double(s));
  });
  ValueFormat format{volume.type, step, 0, 0};
  const auto number = [&](double v) {
    if (step != 0) return std::int64_t(std::floor(v / step + 0.5));
    const auto size = std::int64_t(std::bit_cast<std::uint32_t>(std::fabs(float(v))));
    return v < 0 ? -size : size;
  };
  format.first = number(least);
  format.last = ValueKey(number(greatest) - number(least));
  return {std::move(volume), format};
}

// Digits, in part or nearly all of them on plateaus; a gyroid of floats; a bump in steps of 1/4; large whole numbers.
inline ValueField random_value_field(const std::array<std::int32_t, 3>& dims, unsigned seed) {
  std::mt19937 random(seed);
  const std::size_t count = std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]);
  switch (seed % 5) {
    case 0:
      return value_field(digits(dims, seed), 1);
    case 1:
      return value_field(gyroid(dims), 0);
    case 2: {
      std::vector<double> f(count);
      const double middle = double(count) / 2;
      for (std::size_t i = 0; i < count; ++i) f[i] = std::floor(40 - 60 * std::abs(double(i) - middle) / middle + double(random() % 8)) / 4;
      return value_field(volume_of_type(SampleType::f64, dims, f), 0.25);
    }
    case 3: {
      std::vector<std::uint32_t> f(count);
      for (auto& v : f) v = std::uint32_t(4294967295u - random() % 1000 * 3);
      return value_field(volume_of_type(SampleType::u32, dims, f), 1);
    }
    default: {  // two plateaus, and a few samples that stand out
      std::vector<std::int16_t> f(count);
      for (std::size_t i = 0; i < count; ++i) f[i] = std::int16_t(random() % 20 == 0 ? int(random() % 9) - 4 : i < count / 3 ? -2 : 3);
      return value_field(volume_of_type(SampleType::i16, dims, f), 1);
    }
  }
}

// Of any kind: finite, on samples or between them, equal bounds, infinite ones, and one that misses the field.
inline Range random_range(const ValueField& field, std::mt19937& random) {
  const double least = field.format.least(), greatest = field.format.greatest();
  const auto bound = [&] {
    const std::array<std::int32_t, 3>& dims = field.volume.grid.dims;
    const auto any = [&](int axis) { return std::int32_t(random() % std::uint32_t(dims[std::size_t(axis)])); };
    if (random() % 2 == 0) return field.value({any(0), any(1), any(2)});
    return least - 1 + (greatest - least + 2) * double(random() % 1000) / 1000;
  };
  Range range{bound(), bound()};
  if (range.alpha > range.beta) std::swap(range.alpha, range.beta);
  switch (random() % 9) {
    case 0:
      range.alpha = -kInf;
      break;
    case 1:
      range.beta = kInf;
      break;
    case 2:
      range = {-kInf, kInf};
      break;
    case 3:
      range.beta = range.alpha;
      break;
    case 4:
      range = {greatest + 1, greatest + 2};
      break;
    default:
      break;
  }
  return range;
}

inline std::string text_of(const Range& range, Refine refine) {
  return "[" + std::to_string(range.alpha) + ", " + std::to_string(range.beta) + "] " + (refine == Refine::uniform ? "uniform" : "boundary");
}

// The centres of all diamonds of a field that can ever be split, coarse to fine; so that parents come before children.
inline std::vector<Vertex> all_centres(const ValueField& field) {
  std::vector<Vertex> centres;
  const std::int32_t n = 1 << field.domain.levels();
  for (std::int32_t z = 0; z <= n; ++z) {
    for (std::int32_t y = 0; y <= n; ++y) {
      for (std::int32_t x = 0; x <= n; ++x) {
        if ((x | y | z) == 0 || scale_of({x, y, z}) >= field.domain.levels()) continue;
        const Diamond d({x, y, z});
        if (field.domain.tets(d) != 0 && !field.domain.is_noop(d)) centres.push_back(d.centre);
      }
    }
  }
  std::stable_sort(centres.begin(), centres.end(), [](Vertex a, Vertex b) {
    const Diamond da(a), db(b);
    return std::pair(-da.scale, da.row->cls) < std::pair(-db.scale, db.row->cls);
  });
  return centres;
}

// The same diamonds by supercube, keys ascending.
inline std::vector<SlotGroup> groups_of(const std::vector<Vertex>& centres) {
  std::map<SupercubeKey, std::uint64_t> slots;
  for (const Vertex c : centres) {
    const Diamond d(c);
    const int up = d.scale + 2;
    slots[supercube_key(d.scale, {c.x >> up, c.y >> up, c.z >> up})] |= std::uint64_t(1) << kSlotOfType[d.type];
  }
  std::vector<SlotGroup> groups;
  groups.reserve(slots.size());
  for (const auto& [key, some] : slots) groups.push_back({{}, {}, key, some});
  return groups;
}

inline Front::GroupKeys keys_of(const ValueField& field) {
  return [&field](const SlotGroup& group, std::span<ValueKey, kSlots> keys) {
    for (const Slot slot : set_bits<Slot>(group.slots)) keys[std::size_t(slot)] = field.key(centre_of(group.key, slot));
  };
}

}  // namespace intervale::testing

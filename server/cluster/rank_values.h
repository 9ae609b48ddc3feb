// The values of a field of which each rank has some: of the data set's field, or of a component of a channel.
//
// All ranks call these functions together, and get the same where nothing else is said.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/paged_values.h"
#include "common/ivm/value_page.h"
#include "common/ivm/value_streams.h"
#include "common/patch/value_format.h"
#include "common/util/result.h"
#include "server/builder/sample_range.h"
#include "server/builder/sample_view.h"
#include "server/cluster/rank_samples.h"
#include "server/cluster/ranks.h"
#include "server/cluster/shares.h"

namespace intervale {

// What a rank has of a box.
struct RankPart {
  RankPart(Ranks& all, const Grid& grid)
      : ranks(all), domain(grid.dims), shares(domain, all.size()), known(shares.known_cells(all.rank())), own(shares.own_cells(all.rank())) {}
  [[nodiscard]] SampleView view_of(const RankSamples& samples) const {
    const Vertex last = domain.last();
    return {samples.type(), {last.x + 1, last.y + 1, last.z + 1}, samples.bytes()};
  }
  Ranks& ranks;
  Domain domain;
  Shares shares;
  std::vector<bool> known, own;  // cells
};

// All coarse diamonds, and of the finest those of the rank's own blocks and of thin ones.
[[nodiscard]] SupercubeSet known_diamonds(const RankPart& part);

// The least and the greatest sample of all ranks.
[[nodiscard]] SampleRange sample_range(const RankPart& part, RankSamples& samples);

// As choose_value_format() does of a volume. Where a table is needed, each rank has the different values of all ranks,
// 8 bytes each, and while they are put together some times as much.
[[nodiscard]] Result<ValueFormat> choose_value_format(const RankPart& part, RankSamples& samples, const SampleRange& range,
                                                      std::optional<double> step);
// Whether every sample of all ranks is the value of its key.
[[nodiscard]] bool has_exact_values(const RankPart& part, RankSamples& samples, const ValueFormat& format);

// The keys of known_diamonds(), by number, of this rank; and those at the root's vertices.
struct RankKeys {
  ValueKeys keys;
  std::array<ValueKey, kRootVertices> corners{};
};
[[nodiscard]] RankKeys find_keys(const RankPart& part, const RankSamples& samples, const ValueFormat& format, const SupercubeSet& known);

// The pages that a rank compresses, in the order of their numbers.
struct OwnPages {
  OwnPages(const RankPart& part, const SupercubeSet& known);
  std::vector<std::uint32_t> numbers;
  std::vector<ValuePage> pages;
};
// As fit_weights() finds them from all values.
[[nodiscard]] ValueWeights fit_weights(const RankPart& part, const OwnPages& own, const PagedValues& values);

// Compressed pages of some values.
struct RankPages {
  std::vector<std::vector<std::uint8_t>> own;  // of OwnPages
  std::vector<PageRecord> all;                 // by number, of all ranks
  [[nodiscard]] std::uint64_t bytes() const;   // of all
};
[[nodiscard]] RankPages encode_pages(const RankPart& part, const OwnPages& own, const PagedValues& values, const PageKeeping& kept);

}  // namespace intervale

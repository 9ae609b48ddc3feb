#include "server/cluster/rank_values.h"

#include <algorithm>
#include <limits>
#include <map>

#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/field.h"
#include "server/builder/find_keys.h"
#include "server/builder/value_steps.h"

namespace intervale {
namespace {

// Distinct numbers; none once they are more than `most`.
class Distinct {
 public:
  explicit Distinct(std::size_t most) : most_(most) {}
  // values: distinct; of none there are too many.
  void add(const std::vector<double>& values) {
    if (values.empty()) too_many_ = true;
    if (too_many_) return;
    all_.insert(all_.end(), values.begin(), values.end());
    if (all_.size() > 2 * distinct_) drop_repeated();
  }
  // Ascending.
  [[nodiscard]] std::vector<double> joined_with(Ranks& ranks) {
    drop_repeated();
    std::array<std::uint64_t, 1> too_many{too_many_ ? 1U : 0U};
    ranks.sum(too_many);
    if (too_many[0] != 0) return {};
    std::vector<double> values = joined_in_order(ranks, all_);
    values.erase(std::unique(values.begin(), values.end()), values.end());
    if (values.size() > most_) values.clear();
    return values;
  }

 private:
  void drop_repeated() {
    std::sort(all_.begin(), all_.end());
    all_.erase(std::unique(all_.begin(), all_.end()), all_.end());
    distinct_ = all_.size();
    if (distinct_ > most_) too_many_ = true;
  }
  std::size_t most_, distinct_ = 0;  // distinct_: when they were counted
  std::vector<double> all_;
  bool too_many_ = false;
};

// The block of a supercube of scale 0.
Vertex block_at(Vertex supercube) { return {supercube.x >> 4, supercube.y >> 4, supercube.z >> 4}; }

// The diamonds whose samples are in the own boxes; of scale 0, all of the own blocks.
std::uint64_t own_slots(const RankPart& part, SupercubeKey key) {
  constexpr std::uint64_t kAll = ~std::uint64_t(0);
  const Shares& shares = part.shares;
  const int scale = scale_of_key(key), rank = part.ranks.rank();
  if (scale == 0) {
    const Vertex block = block_at(position_of_key(key));
    return !shares.is_thin(block) || shares.rank_of_samples_in(block) == rank ? kAll : 0;
  }
  const auto is_own = [&](Slot slot) { return shares.rank_of_sample(part.domain.clamp(centre_of(key, slot))) == rank; };
  if (scale + 2 <= Shares::kBoxBits) return is_own(Slot{0}) ? kAll : 0;  // a supercube lies in one box
  std::uint64_t own = 0;
  for (Slot slot{0}; slot < kSlots; ++slot) own |= std::uint64_t(is_own(slot)) << std::uint32_t(slot);
  return own;
}

// All ranks get the keys of thin blocks.
void unite_thin_blocks(const RankPart& part, const SupercubeSet& known, ValueKeys& keys) {
  std::vector<std::uint8_t> bytes;
  const auto for_each_run = [&](const auto& visit) {
    const auto [begin, end] = known.of_scale(0);
    for (BrickIndex brick = begin; brick < end; ++brick) {
      if (!part.shares.is_thin(block_at(position_of_key(known.bricks()[brick].key)))) continue;
      visit(keys.bytes().subspan(std::size_t(known.bricks()[brick].first) * keys.width(), known.updates(brick) * keys.width()));
    }
  };
  for_each_run([&](std::span<std::uint8_t> run) { bytes.insert(bytes.end(), run.begin(), run.end()); });
  part.ranks.unite(bytes);
  auto next = bytes.begin();
  for_each_run([&](std::span<std::uint8_t> run) {
    std::copy_n(next, run.size(), run.begin());
    next += std::ptrdiff_t(run.size());
  });
}

}  // namespace

SupercubeSet known_diamonds(const RankPart& part) {
  return some_diamonds(part.domain, [&](int scale, Vertex p) {
    const Vertex block = block_at(p);
    const Shares& shares = part.shares;
    return scale > 0 || shares.rank_of_block(block) == part.ranks.rank() || (shares.rank_of_block(block) >= 0 && shares.is_thin(block));
  });
}

SampleRange sample_range(const RankPart& part, RankSamples& samples) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> range{-kInfinity, -kInfinity};  // of -sample and sample
  samples.for_each_layer(part.own, false, [&](const Volume& layer) {
    const SampleRange of_layer = sample_range(layer);
    range = {std::max(range[0], -of_layer.least), std::max(range[1], of_layer.greatest)};
  });
  part.ranks.max(range);
  return {-range[0] + 0.0, range[1] + 0.0};
}

Result<ValueFormat> choose_value_format(const RankPart& part, RankSamples& samples, const SampleRange& range, std::optional<double> step) {
  const auto distinct = [&](std::size_t most, const auto& of_layer) {
    Distinct values(most);
    samples.for_each_layer(part.own, false, [&](const Volume& layer) { values.add(of_layer(layer)); });
    return values.joined_with(part.ranks);
  };
  const auto few = [&] { return distinct(kMostExact, few_distinct_samples); };
  const auto all = [&] { return distinct(std::numeric_limits<std::size_t>::max(), all_distinct_samples); };
  return choose_value_format(samples.type(), {range, few, all}, step);
}

bool has_exact_values(const RankPart& part, RankSamples& samples, const ValueFormat& format) {
  if (!is_float(samples.type())) return true;
  std::array<std::uint64_t, 1> inexact{};
  samples.for_each_layer(part.own, false, [&](const Volume& layer) { inexact[0] += has_exact_values(layer, format) ? 0 : 1; });
  part.ranks.sum(inexact);
  return inexact[0] == 0;
}

RankKeys find_keys(const RankPart& part, const RankSamples& samples, const ValueFormat& format, const SupercubeSet& known) {
  const Domain& domain = part.domain;
  const int rank = part.ranks.rank();
  RankKeys found{ValueKeys(known.size(), format.last), {}};
  find_keys(part.view_of(samples), format, known, found.keys, [&part](SupercubeKey key) { return own_slots(part, key); });
  const Diamond root(domain.root());
  visit_samples(samples.type(), samples.bytes(), [&]<class T>(std::span<const T> of_box) {
    const Field<T> field{of_box, domain.last()};
    for (int v = 0; v < kRootVertices; ++v) {
      const Vertex corner = domain.clamp(root.vertex(v));
      if (part.shares.rank_of_sample(corner) == rank) found.corners[std::size_t(v)] = key_of_sample(format, of_box[field.index(corner)]);
    }
  });
  part.ranks.unite(found.keys.bytes().first(coarse_diamonds(known) * found.keys.width()));
  unite_thin_blocks(part, known, found.keys);
  const auto corners = std::as_writable_bytes(std::span(found.corners));
  part.ranks.unite({reinterpret_cast<std::uint8_t*>(corners.data()), corners.size()});
  return found;
}

OwnPages::OwnPages(const RankPart& part, const SupercubeSet& known) {
  std::map<BlockKey, BrickRun> runs;
  for (const BrickRun& run : blocks_of(known)) runs[block_of(known.bricks()[run.first].key)] = run;
  const std::vector<Shares::Page>& all = part.shares.pages();
  for (std::size_t page = 0; page < all.size(); ++page) {
    if (all[page].rank != part.ranks.rank()) continue;
    numbers.push_back(std::uint32_t(page));
    ValuePage& own = pages.emplace_back();
    for (const BlockKey block : all[page].blocks) own.push_back(runs.at(block));
  }
}

ValueWeights fit_weights(const RankPart& part, const OwnPages& own, const PagedValues& values) {
  std::vector<BrickRun> blocks;
  for (const ValuePage& page : own.pages) blocks.insert(blocks.end(), page.begin(), page.end());
  WeightSums sums;
  sums.add(values, blocks, part.shares.diamonds(), on_all_cores);
  WeightSums all;
  for (const WeightSums& of_rank : joined<WeightSums>(part.ranks, std::span<const WeightSums>(&sums, 1))) all.add(of_rank);
  return all.solve();
}

std::uint64_t RankPages::bytes() const {
  std::uint64_t bytes = 0;
  for (const PageRecord& page : all) bytes += page.bytes;
  return bytes;
}

RankPages encode_pages(const RankPart& part, const OwnPages& own, const PagedValues& values, const PageKeeping& kept) {
  RankPages coded;
  coded.own.resize(own.pages.size());
  on_all_cores(own.pages.size(), [&](std::size_t i) { coded.own[i] = encode_page(values, own.pages[i], {kept.values, own.numbers[i]}, kept.by); });
  struct Written {
    std::uint64_t page = 0;
    PageRecord record;
  };
  std::vector<Written> written;
  for (std::size_t i = 0; i < coded.own.size(); ++i) written.push_back({own.numbers[i], record_of(coded.own[i])});
  coded.all.resize(part.shares.pages().size());
  for (const Written& page : joined<Written>(part.ranks, written)) coded.all[page.page] = page.record;
  return coded;
}

}  // namespace intervale

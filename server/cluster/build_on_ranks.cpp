#include "server/cluster/build_on_ranks.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "common/ivm/page_bounds.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_page.h"
#include "common/ivm/value_streams.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/field.h"
#include "common/util/bits.h"
#include "server/builder/find_keys.h"
#include "server/builder/make_volume_table.h"
#include "server/builder/value_histogram.h"
#include "server/builder/value_steps.h"
#include "server/cluster/rank_errors.h"
#include "server/cluster/shared_file.h"
#include "server/cluster/shares.h"

namespace intervale {
namespace {

// Distinct numbers, ascending; none once they are more than kMostExact.
class FewDistinct {
 public:
  void add(std::vector<double> values) {
    if (values.empty()) too_many_ = true;
    if (too_many_) return;
    std::vector<double> both;
    std::set_union(all_.begin(), all_.end(), values.begin(), values.end(), std::back_inserter(both));
    all_ = std::move(both);
    if (all_.size() > kMostExact) too_many_ = true;
  }
  [[nodiscard]] std::vector<double> joined_with(Ranks& ranks) const {
    std::array<std::uint64_t, 1> too_many{too_many_ ? 1U : 0U};
    ranks.sum(too_many);
    std::vector<double> values = too_many[0] != 0 ? std::vector<double>() : joined<double>(ranks, all_);
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    if (values.size() > kMostExact) values.clear();
    return values;
  }

 private:
  std::vector<double> all_;
  bool too_many_ = false;
};

// The values of all ranks, ascending.
std::vector<double> joined_in_order(Ranks& ranks, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::uint64_t own = values.size();
  const std::vector<std::uint64_t> sizes = joined<std::uint64_t>(ranks, std::span(&own, 1));
  values = joined<double>(ranks, values);
  auto middle = values.begin();
  for (const std::uint64_t size : sizes) {
    std::inplace_merge(values.begin(), middle, middle + std::ptrdiff_t(size));
    middle += std::ptrdiff_t(size);
  }
  return values;
}

// One rank's part of a build, step by step.
class Part {
 public:
  Part(Ranks& ranks, const RankBuild& build)
      : ranks_(ranks),
        build_(build),
        domain_(build.field.grid.dims),
        shares_(domain_, ranks.size()),
        known_(shares_.known_cells(ranks.rank())),
        own_(shares_.own_cells(ranks.rank())),
        samples_(domain_, build.type) {
    parts_.description = build.field;
  }

  Result<BuiltByRanks> run() {
    if (auto ok = read(); !ok) return tl::unexpected(ok.error());
    FieldDescription& d = parts_.description;
    round();
    count();
    const SampleView view{build_.type, d.grid.dims, std::as_const(samples_).bytes()};
    const auto is_own = [this](Vertex first) { return shares_.rank_of_sample(first) == ranks_.rank(); };
    d.statistics.volumes = make_volume_table({view, range_.least, range_.greatest, is_own,
                                              [this](std::vector<double>& values) { values = joined_in_order(ranks_, std::move(values)); },
                                              [this](std::span<std::uint64_t> sums) { ranks_.sum(sums); }});
    find_all_keys();
    find_errors();
    samples_ = RankSamples(domain_, SampleType::u8);  // the compression takes memory of its own
    find_weights();
    return write();
  }

 private:
  // The samples, and what their format depends on.
  Result<void> read() {
    FewDistinct few;
    std::array<double, 2> range{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};  // of -sample and sample
    const auto seen = [&](const Volume& volume) {
      const SampleRange of_layer = sample_range(volume);
      range = {std::max(range[0], -of_layer.least), std::max(range[1], of_layer.greatest)};
      if (is_float(build_.type)) few.add(few_distinct_samples(volume));
    };
    if (auto ok = agree(ranks_, samples_.read(known_, build_.read_box, seen)); !ok) return ok;
    ranks_.max(range);
    range_ = {-range[0] + 0.0, range[1] + 0.0};
    const auto all = []() -> Result<std::vector<double>> {
      return misuse("a table of values is not supported with several ranks yet: build with one process, or give --step");
    };
    const auto format = choose_value_format(build_.type, {range_, [&] { return few.joined_with(ranks_); }, all}, build_.step);
    if (!format) return tl::unexpected(format.error());
    parts_.description.format = *format;
    return {};
  }

  // The samples become the values of their keys.
  void round() {
    FieldDescription& d = parts_.description;
    std::array<std::uint64_t, 1> inexact{};
    if (is_float(build_.type)) {
      samples_.for_each_layer(known_, true, [&](Volume& layer) {
        inexact[0] += has_exact_values(layer, d.format) ? 0 : 1;
        round_samples(layer, d.format);
      });
    }
    ranks_.sum(inexact);
    d.is_exact = inexact[0] == 0;
    if (!is_float(build_.type)) return;
    std::array<double, 2> range{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    samples_.for_each_layer(own_, false, [&](Volume& layer) {
      const SampleRange of_layer = sample_range(layer);
      range = {std::max(range[0], -of_layer.least), std::max(range[1], of_layer.greatest)};
    });
    ranks_.max(range);
    range_ = {-range[0] + 0.0, range[1] + 0.0};
  }

  void count() {
    ValueHistogram& histogram = parts_.description.statistics.histogram;
    // Of no samples: bins of the right number and width.
    Volume none;
    none.type = build_.type;
    histogram = make_value_histogram(none, parts_.description.format);
    samples_.for_each_layer(own_, false, [&](Volume& layer) {
      const ValueHistogram more = make_value_histogram(layer, parts_.description.format);
      for (std::size_t bin = 0; bin < more.count.size(); ++bin) histogram.count[bin] += more.count[bin];
    });
    ranks_.sum(histogram.count);
  }

  // The block of a supercube of scale 0.
  static Vertex block_at(Vertex supercube) { return {supercube.x >> 4, supercube.y >> 4, supercube.z >> 4}; }

  // Of the coarse diamonds all keys, of the finest those of the own blocks and of the thin ones.
  void find_all_keys() {
    FieldDescription& d = parts_.description;
    const int rank = ranks_.rank();
    parts_.set = some_diamonds(domain_, [&](int scale, Vertex p) {
      const Vertex block = block_at(p);
      return scale > 0 || shares_.rank_of_block(block) == rank || (shares_.rank_of_block(block) >= 0 && shares_.is_thin(block));
    });
    const std::size_t coarse = coarse_diamonds(parts_.set);
    parts_.keys = ValueKeys(parts_.set.size(), d.format.last);
    const Diamond root(domain_.root());
    find_keys({build_.type, d.grid.dims, std::as_const(samples_).bytes()}, d.format, parts_.set, parts_.keys,
              [this](SupercubeKey key) { return own_slots(key); });
    visit_samples(build_.type, std::as_const(samples_).bytes(), [&]<class T>(std::span<const T> samples) {
      const Field<T> field{samples, domain_.last()};
      const auto key_at = [&](Vertex v) { return key_of_sample(d.format, samples[field.index(v)]); };
      for (int v = 0; v < kRootVertices; ++v) {
        const Vertex corner = domain_.clamp(root.vertex(v));
        d.corners[std::size_t(v)] = shares_.rank_of_sample(corner) == rank ? key_at(corner) : 0;
      }
    });
    ranks_.unite(parts_.keys.bytes().first(coarse * parts_.keys.width()));
    unite_thin_blocks();
    const auto corners = std::as_writable_bytes(std::span(d.corners));
    ranks_.unite({reinterpret_cast<std::uint8_t*>(corners.data()), corners.size()});
  }

  // All ranks get the keys of thin blocks.
  void unite_thin_blocks() {
    const SupercubeSet& set = parts_.set;
    std::vector<std::uint8_t> bytes;
    const auto for_each_run = [&](const auto& visit) {
      const auto [begin, end] = set.of_scale(0);
      for (BrickIndex brick = begin; brick < end; ++brick) {
        if (!shares_.is_thin(block_at(position_of_key(set.bricks()[brick].key)))) continue;
        visit(parts_.keys.bytes().subspan(std::size_t(set.bricks()[brick].first) * parts_.keys.width(), set.updates(brick) * parts_.keys.width()));
      }
    };
    for_each_run([&](std::span<std::uint8_t> run) { bytes.insert(bytes.end(), run.begin(), run.end()); });
    ranks_.unite(bytes);
    auto next = bytes.begin();
    for_each_run([&](std::span<std::uint8_t> run) {
      std::copy_n(next, run.size(), run.begin());
      next += std::ptrdiff_t(run.size());
    });
  }

  // The diamonds whose samples are in the own boxes; of scale 0, all of the own blocks.
  [[nodiscard]] std::uint64_t own_slots(SupercubeKey key) const {
    constexpr std::uint64_t kAll = ~std::uint64_t(0);
    const int scale = scale_of_key(key);
    if (scale == 0) {
      const Vertex block = block_at(position_of_key(key));
      return !shares_.is_thin(block) || shares_.rank_of_samples_in(block) == ranks_.rank() ? kAll : 0;
    }
    const auto is_own = [&](Slot slot) { return shares_.rank_of_sample(domain_.clamp(centre_of(key, slot))) == ranks_.rank(); };
    if (scale + 2 <= Shares::kBoxBits) return is_own(Slot{0}) ? kAll : 0;  // a supercube lies in one box
    std::uint64_t own = 0;
    for (Slot slot{0}; slot < kSlots; ++slot) own |= std::uint64_t(is_own(slot)) << std::uint32_t(slot);
    return own;
  }

  void find_errors() {
    FieldDescription& d = parts_.description;
    const SupercubeSet coarse = some_diamonds(domain_, [](int scale, Vertex) { return scale > 0; });
    place_vertices(coarse);
    const RankErrors errors =
        measure_errors(ranks_, {domain_, shares_, coarse, build_.type, std::as_const(samples_).bytes()}, build_.progress, build_.errors);
    d.max_error = double(errors.greatest);
    parts_.error_levels.resize(coarse.size());
    std::transform(errors.coarse.begin(), errors.coarse.end(), parts_.error_levels.begin(),
                   [&](float error) { return ValueVolume::level_of_error(d.max_error, double(error)); });
  }

  // The samples at the vertices of large diamonds, which may lie anywhere: they are the values of coarse keys.
  void place_vertices(const SupercubeSet& coarse) {
    constexpr int kLarge = 4;
    const Diamond root(domain_.root());
    visit_samples(build_.type, std::as_const(samples_).bytes(), [&]<class T>(std::span<const T> samples) {
      const Field<T> field{samples, domain_.last()};
      const std::span<T> to(reinterpret_cast<T*>(samples_.bytes().data()), samples.size());
      const auto place = [&](Vertex v, ValueKey key) { to[field.index(domain_.clamp(v))] = T(parts_.description.format.value(key)); };
      for (int v = 0; v < kRootVertices; ++v) place(root.vertex(v), parts_.description.corners[std::size_t(v)]);
      for (int scale = kLarge; scale < domain_.levels(); ++scale) {
        for (int cls = 0; cls < 3; ++cls) coarse.for_each(scale, cls, [&](const Place& p) { place(SupercubeSet::centre(p), parts_.keys[p.index]); });
      }
    });
  }

  void find_weights() {
    std::map<BlockKey, BrickRun> runs;
    for (const BrickRun& run : blocks_of(parts_.set)) runs[block_of(parts_.set.bricks()[run.first].key)] = run;
    std::vector<BrickRun> blocks;
    for (std::size_t page = 0; page < shares_.pages().size(); ++page) {
      if (shares_.pages()[page].rank != ranks_.rank()) continue;
      own_pages_.push_back(std::uint32_t(page));
      ValuePage& own = pages_.emplace_back();
      for (const BlockKey block : shares_.pages()[page].blocks) own.push_back(runs.at(block));
      blocks.insert(blocks.end(), own.begin(), own.end());
    }
    WeightSums sums;
    sums.add(parts_, blocks, shares_.diamonds(), on_all_cores);
    WeightSums all;
    for (const WeightSums& of_rank : joined<WeightSums>(ranks_, std::span<const WeightSums>(&sums, 1))) all.add(of_rank);
    parts_.weights = all.solve();
  }

  // Of all pages.
  std::vector<PageBounds> find_bounds() {
    std::vector<BlockKey> own;
    std::vector<std::vector<BlockKey>> pages;
    for (const Shares::Page& page : shares_.pages()) {
      pages.push_back(page.blocks);
      if (page.rank == ranks_.rank()) own.insert(own.end(), page.blocks.begin(), page.blocks.end());
    }
    return bounds_of_pages(joined<BlockValues>(ranks_, values_in(parts_, own, on_all_cores)), pages);
  }

  // The own pages, each at its place in the file.
  Result<BuiltByRanks> write() {
    std::vector<std::vector<std::uint8_t>> coded(pages_.size());
    on_all_cores(pages_.size(), [&](std::size_t i) {
      const PageName name{0, own_pages_[i]};
      if (build_.pages != nullptr) {
        if (auto found = build_.pages->find(name)) {
          coded[i] = std::move(*found);
          return;
        }
      }
      coded[i] = encode_page(parts_, pages_[i]);
      if (build_.pages != nullptr) build_.pages->keep(name, coded[i]);
    });
    struct Written {
      std::uint64_t page = 0;
      PageRecord record;
    };
    std::vector<Written> written;
    for (std::size_t i = 0; i < coded.size(); ++i) written.push_back({own_pages_[i], record_of(coded[i])});
    written = joined<Written>(ranks_, written);
    std::sort(written.begin(), written.end(), [](const Written& a, const Written& b) { return a.page < b.page; });

    Streams streams = encode_field(parts_);
    append_bounds(streams, find_bounds());
    std::uint64_t pages_bytes = 0;
    std::vector<std::uint64_t> offset;  // of each page, from the first
    for (const Written& page : written) {
      append(streams[StreamType::page_index], std::span(&page.record, 1));
      offset.push_back(pages_bytes);
      pages_bytes += page.record.bytes;
    }
    const ContainerFrame frame = make_frame(FileScope::every_range, streams, pages_bytes);
    std::vector<SharedPiece> pieces;
    for (std::size_t i = 0; i < coded.size(); ++i) pieces.push_back({frame.pages_at + offset[own_pages_[i]], std::as_bytes(std::span(coded[i]))});
    if (ranks_.rank() == 0) {
      pieces.push_back({0, frame.before});
      pieces.push_back({frame.pages_at + pages_bytes, frame.after});
    }
    if (auto ok = write_shared_file(ranks_, build_.output, pieces, build_.writes); !ok) return tl::unexpected(ok.error());
    BuiltByRanks built{std::move(parts_.description), 0, shares_.supercubes(), frame.file_bytes};
    for (const std::size_t diamonds : shares_.diamonds()) built.updates += diamonds;
    return built;
  }

  Ranks& ranks_;
  const RankBuild& build_;
  Domain domain_;
  Shares shares_;
  std::vector<bool> known_, own_;  // cells
  RankSamples samples_;
  SampleRange range_;
  ValueVolume::Parts parts_;  // the set: all coarse diamonds, and those of the own blocks and of thin ones
  std::vector<std::uint32_t> own_pages_;
  std::vector<ValuePage> pages_;
};

}  // namespace

Result<BuiltByRanks> build_on_ranks(Ranks& ranks, const RankBuild& build) {
  if (build.field.grid.sample_count() > kMostSamples) return misuse("the volume has more than 2^36 samples, too many for every range");
  return Part(ranks, build).run();
}

}  // namespace intervale

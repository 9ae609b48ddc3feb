#include "server/cluster/build_on_ranks.h"

#include <algorithm>
#include <utility>

#include "common/ivm/channel_file.h"
#include "common/ivm/page_bounds.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/field.h"
#include "server/builder/channel_builder.h"
#include "server/builder/make_volume_table.h"
#include "server/builder/value_histogram.h"
#include "server/builder/value_steps.h"
#include "server/cluster/rank_errors.h"
#include "server/cluster/rank_values.h"
#include "server/cluster/shared_file.h"

namespace intervale {
namespace {

// One rank's part of a build, step by step.
class Part {
 public:
  Part(Ranks& ranks, const RankBuild& build) : build_(build), part_(ranks, build.field.grid) { parts_.description = build.field; }

  Result<BuiltByRanks> run() {
    if (auto ok = make_field(); !ok) return tl::unexpected(ok.error());
    const OwnPages own(part_, parts_.set);
    parts_.weights = fit_weights(part_, own, parts_);
    const RankPages pages = encode_pages(part_, own, parts_, {build_.pages, 0});
    std::vector<RankPages> channels;  // of each component
    for (const RankChannel& channel : build_.channels) {
      if (build_.begins) build_.begins(channel.name);
      if (auto ok = add_channel(channel, own, channels); !ok) return tl::unexpected(ok.error());
    }
    return write(own, pages, channels);
  }

 private:
  // All but the weights.
  Result<void> make_field() {
    auto read = read_on_ranks(part_.ranks, build_.input, part_.domain, part_.known);
    if (!read) return tl::unexpected(read.error());
    RankSamples samples = std::move(read->front());
    FieldDescription& d = parts_.description;
    SampleRange range = sample_range(part_, samples);
    auto format = choose_value_format(part_, samples, range, build_.step);
    if (!format) return tl::unexpected(format.error());
    d.format = std::move(*format);
    d.is_exact = has_exact_values(part_, samples, d.format);
    if (is_float(samples.type())) {  // the samples become the values of their keys
      samples.for_each_layer(part_.known, true, [&](Volume& layer) { round_samples(layer, d.format); });
      range = sample_range(part_, samples);
    }
    count(samples);
    const auto is_own = [this](Vertex first) { return part_.shares.rank_of_sample(first) == part_.ranks.rank(); };
    d.statistics.volumes = make_volume_table({part_.view_of(samples), range.least, range.greatest, is_own,
                                              [this](std::vector<double>& values) {
                                                std::sort(values.begin(), values.end());
                                                values = joined_in_order(part_.ranks, values);
                                              },
                                              [this](std::span<std::uint64_t> sums) { part_.ranks.sum(sums); }});
    parts_.set = known_diamonds(part_);
    RankKeys keys = find_keys(part_, samples, d.format, parts_.set);
    parts_.keys = std::move(keys.keys);
    d.corners = keys.corners;
    find_errors(samples);
    return {};
  }

  void count(RankSamples& samples) {
    ValueHistogram& histogram = parts_.description.statistics.histogram;
    // Of no samples: bins of the right number and width.
    Volume none;
    none.type = samples.type();
    histogram = make_value_histogram(none, parts_.description.format);
    samples.for_each_layer(part_.own, false, [&](const Volume& layer) {
      const ValueHistogram more = make_value_histogram(layer, parts_.description.format);
      for (std::size_t bin = 0; bin < more.count.size(); ++bin) histogram.count[bin] += more.count[bin];
    });
    part_.ranks.sum(histogram.count);
  }

  void find_errors(RankSamples& samples) {
    FieldDescription& d = parts_.description;
    const SupercubeSet coarse = some_diamonds(part_.domain, [](int scale, Vertex) { return scale > 0; });
    place_vertices(coarse, samples);
    const RankField field{part_.domain, part_.shares, coarse, samples.type(), std::as_const(samples).bytes()};
    const RankErrors errors = measure_errors(part_.ranks, field, build_.progress, build_.errors);
    d.max_error = double(errors.greatest);
    parts_.error_levels.resize(coarse.size());
    std::transform(errors.coarse.begin(), errors.coarse.end(), parts_.error_levels.begin(),
                   [&](float error) { return ValueVolume::level_of_error(d.max_error, double(error)); });
  }

  // The samples at the vertices of large diamonds, which may lie anywhere: they are the values of coarse keys.
  void place_vertices(const SupercubeSet& coarse, RankSamples& samples) {
    constexpr int kLarge = 4;
    const Diamond root(part_.domain.root());
    visit_samples(samples.type(), std::as_const(samples).bytes(), [&]<class T>(std::span<const T> all) {
      const Field<T> field{all, part_.domain.last()};
      const std::span<T> to(reinterpret_cast<T*>(samples.bytes().data()), all.size());
      const auto place = [&](Vertex v, ValueKey key) { to[field.index(part_.domain.clamp(v))] = T(parts_.description.format.value(key)); };
      for (int v = 0; v < kRootVertices; ++v) place(root.vertex(v), parts_.description.corners[std::size_t(v)]);
      for (int scale = kLarge; scale < part_.domain.levels(); ++scale) {
        for (int cls = 0; cls < 3; ++cls) coarse.for_each(scale, cls, [&](const Place& p) { place(SupercubeSet::centre(p), parts_.keys[p.index]); });
      }
    });
  }

  // The components of a channel, one after the other.
  Result<void> add_channel(const RankChannel& from, const OwnPages& own, std::vector<RankPages>& coded) {
    auto samples = read_on_ranks(part_.ranks, from.input, part_.domain, part_.known);
    if (!samples) return tl::unexpected(samples.error());
    Channel& channel = parts_.description.channels.emplace_back(Channel{from.name, from.input.header.labels.field_unit, {}});
    for (RankSamples& one : *samples) {
      const auto format = channel_format(choose_value_format(part_, one, sample_range(part_, one), from.step));
      if (!format) return of_channel(from.name, format.error());
      const RankKeys keys = find_keys(part_, one, *format, parts_.set);
      channel.components.push_back({*format, has_exact_values(part_, one, *format), keys.corners, {}});
      const PagedValues values(build_.field.grid, parts_.set, channel.components.back(), keys.keys);
      channel.components.back().weights = fit_weights(part_, own, values);
      coded.push_back(encode_pages(part_, own, values, {build_.pages, std::uint32_t(coded.size() + 1)}));
    }
    return {};
  }

  // Of all pages.
  std::vector<PageBounds> find_bounds() {
    std::vector<BlockKey> own;
    std::vector<std::vector<BlockKey>> pages;
    for (const Shares::Page& page : part_.shares.pages()) {
      pages.push_back(page.blocks);
      if (page.rank == part_.ranks.rank()) own.insert(own.end(), page.blocks.begin(), page.blocks.end());
    }
    return bounds_of_pages(joined<BlockValues>(part_.ranks, values_in(parts_, own, on_all_cores)), pages);
  }

  // The own pages, each at its place in the file.
  Result<BuiltByRanks> write(const OwnPages& own, const RankPages& pages, const std::vector<RankPages>& channels) {
    Streams streams = encode_field(parts_);
    append_bounds(streams, find_bounds());
    append<PageRecord>(streams[StreamType::page_index], pages.all);
    auto next = channels.begin();
    append_channels(streams, build_.field.grid, parts_.description.channels,
                    [&](std::vector<std::byte>& to, std::size_t, std::size_t) { append<PageRecord>(to, (next++)->all); });
    PagesElsewhere elsewhere{pages.bytes(), 0, 0};
    for (const RankPages& one : channels) elsewhere.channel_pages_bytes += one.bytes();
    const ContainerFrame frame = make_frame(FileScope::every_range, streams, elsewhere);

    std::vector<SharedPiece> pieces;
    const auto add_pages = [&](const RankPages& coded, std::uint64_t at) {
      auto number = own.numbers.begin();
      auto bytes = coded.own.begin();
      for (std::uint32_t page = 0; page < coded.all.size(); ++page) {
        if (number != own.numbers.end() && *number == page) {
          pieces.push_back({at, std::as_bytes(std::span(*bytes))});
          ++number;
          ++bytes;
        }
        at += coded.all[page].bytes;
      }
      return at;
    };
    add_pages(pages, frame.pages_at);
    std::uint64_t at = frame.channel_pages_at;
    for (const RankPages& one : channels) at = add_pages(one, at);
    if (part_.ranks.rank() == 0) {
      for (const ContainerFrame::Piece& piece : frame.pieces) pieces.push_back({piece.offset, piece.bytes});
    }
    // The checksum of the channels' pages is over those of all ranks: known once they are in the file.
    ContainerFrame last;
    const auto head = [&](const std::filesystem::path& file) -> Result<std::vector<SharedPiece>> {
      if (channels.empty()) return std::vector<SharedPiece>();
      const auto checksum = checksum_of(file, frame.channel_pages_at, elsewhere.channel_pages_bytes);
      if (!checksum) return tl::unexpected(checksum.error());
      elsewhere.channel_pages_checksum = *checksum;
      last = make_frame(FileScope::every_range, streams, elsewhere);
      return std::vector<SharedPiece>{{0, last.pieces.front().bytes}};
    };
    if (auto ok = write_shared_file(part_.ranks, build_.output, pieces, head, build_.writes); !ok) return tl::unexpected(ok.error());
    BuiltByRanks built{std::move(parts_.description), 0, part_.shares.supercubes(), frame.file_bytes};
    for (const std::size_t diamonds : part_.shares.diamonds()) built.updates += diamonds;
    return built;
  }

  const RankBuild& build_;
  RankPart part_;
  ValueVolume::Parts parts_;  // the set: known_diamonds()
};

}  // namespace

Result<BuiltByRanks> build_on_ranks(Ranks& ranks, const RankBuild& build) {
  if (build.field.grid.sample_count() > kMostSamples) return misuse("the volume has more than 2^36 samples, too many for every range");
  return Part(ranks, build).run();
}

}  // namespace intervale

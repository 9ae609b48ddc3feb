#include "common/ivm/channel_file.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <string>

#include "common/codec/coding_rate.h"
#include "common/diamond/domain.h"
#include "common/ivm/paged_values.h"
#include "common/ivm/value_streams.h"
#include "common/patch/labels.h"

namespace intervale {
namespace {

struct ComponentRecord {
  double step;
  std::int64_t first;
  std::uint32_t type, last, is_exact, corners[kRootVertices];
  std::uint32_t unused;
};
static_assert(sizeof(ComponentRecord) == 64, "no padding");

ComponentRecord record_of(const ChannelComponent& component) {
  const ValueFormat& f = component.format;
  ComponentRecord r{f.step, f.first, std::uint32_t(f.type), f.last, component.is_exact, {}, 0};
  std::copy(component.corners.begin(), component.corners.end(), r.corners);
  return r;
}

void append_text(std::vector<std::byte>& out, const std::string& text) {
  const auto bytes = std::uint8_t(text.size());
  append(out, std::span(&bytes, 1));
  append<char>(out, text);
}

tl::unexpected<Error> damaged() { return fail("the channels are damaged"); }

// Numbers and texts off the front of bytes from outside; nothing where these are too short.
template <class T>
std::optional<T> take(std::span<const std::byte>& bytes) {
  if (bytes.size() < sizeof(T)) return {};
  T number;
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes = bytes.subspan(sizeof number);
  return number;
}
std::optional<std::string> take_text(std::span<const std::byte>& bytes) {
  const auto size = take<std::uint8_t>(bytes);
  if (!size || *size > kMaxLabel || bytes.size() < *size) return {};
  std::string text(std::size_t(*size), '\0');
  std::memcpy(text.data(), bytes.data(), text.size());
  bytes = bytes.subspan(text.size());
  return text;
}

// levels: of the domain.
Result<ChannelComponent> take_component(std::span<const std::byte>& bytes, int levels) {
  const auto r = take<ComponentRecord>(bytes);
  const std::size_t weights = std::size_t(levels) * 3 * sizeof(PredictorWeights);
  if (!r || r->type >= std::uint32_t(kSampleTypes) || r->is_exact > 1 || r->unused != 0 || bytes.size() < weights) return damaged();
  ChannelComponent component{{SampleType(r->type), r->step, r->first, r->last}, r->is_exact != 0, {}, {}};
  std::copy_n(r->corners, kRootVertices, component.corners.begin());
  std::memcpy(component.weights.of.data(), bytes.data(), weights);
  bytes = bytes.subspan(weights);
  if (auto valid = check_value_format(component.format); !valid) return tl::unexpected(valid.error());
  return component;
}

}  // namespace

void append_channels(Streams& streams, const Grid& grid, const std::vector<Channel>& channels, const AppendIndex& index) {
  if (channels.empty()) return;
  std::vector<std::byte>& out = streams[StreamType::channels];
  const auto scales = std::size_t(Domain(grid.dims).levels());
  const auto count = std::uint8_t(channels.size());
  append(out, std::span(&count, 1));
  for (std::size_t i = 0; i < channels.size(); ++i) {
    append_text(out, channels[i].name);
    append_text(out, channels[i].unit);
    const auto components = std::uint8_t(channels[i].components.size());
    append(out, std::span(&components, 1));
    for (std::size_t c = 0; c < components; ++c) {
      const ChannelComponent& component = channels[i].components[c];
      const ComponentRecord record = record_of(component);
      append(out, std::span(&record, 1));
      append(out, std::span<const PredictorWeights>(&component.weights.of[0][0], scales * 3));
      index(out, i, c);
    }
  }
}

void append_channels(Streams& streams, const Grid& grid, const SupercubeSet& set, const std::vector<Channel>& channels,
                     const std::vector<ChannelKeys>& keys, const ParallelFor& parallel, KeptPages* kept) {
  std::uint32_t values = 0;  // the last ones whose pages were appended: the field's
  append_channels(streams, grid, channels, [&](std::vector<std::byte>& to, std::size_t i, std::size_t c) {
    append_pages({grid, set, channels[i].components[c], keys[i][c]}, to, streams[StreamType::channel_pages], parallel, {kept, ++values});
  });
}

Result<StoredChannels> read_channels(const Container& file, const Grid& grid, const SupercubeSet& set, const ParallelFor& parallel,
                                     PageFaults* faults) {
  StoredChannels stored;
  auto bytes = file[StreamType::channels], pages = file[StreamType::channel_pages];
  const int levels = Domain(grid.dims).levels();
  const std::uint8_t count = bytes.empty() ? std::uint8_t(0) : *take<std::uint8_t>(bytes);
  if (count > kMaxChannels) return damaged();
  for (std::size_t i = 0; i < count; ++i) {
    const auto name = take_text(bytes), unit = take_text(bytes);
    const auto components = take<std::uint8_t>(bytes);
    if (!name || !unit || !components || *components > kMaxComponents) return damaged();
    Channel& channel = stored.channels.emplace_back(Channel{*name, *unit, {}});
    ChannelKeys& keys = stored.keys.emplace_back();
    for (std::size_t c = 0; c < *components; ++c) {
      auto component = take_component(bytes, levels);
      if (!component) return tl::unexpected(component.error());
      if (set.size() > most_coded_bits(pages.size())) return fail("the file claims more values than it can hold");
      ValueKeys& to = keys.emplace_back(0, component->format.last);
      file.claim(set.size() * std::uint64_t(to.width()));
      if (auto ok = take_pages(bytes, pages, {grid, set, *component, to}, parallel, faults, *name); !ok) return tl::unexpected(ok.error());
      channel.components.push_back(std::move(*component));
    }
  }
  if (!bytes.empty() || !pages.empty()) return damaged();
  if (auto valid = check_channels(stored.channels); !valid) return tl::unexpected(valid.error());
  return stored;
}

}  // namespace intervale

#include "common/ivm/value_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/codec/coding_rate.h"
#include "common/ivm/channel_file.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/value_page.h"
#include "common/ivm/value_streams.h"

namespace intervale {
namespace {

constexpr std::size_t kMostPositions = 4096;  // of the table of volumes

// The numbers of a stream.
template <class T>
std::vector<T> numbers_of(std::span<const std::byte> bytes) {
  std::vector<T> numbers(bytes.size() / sizeof(T));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(T));
  return numbers;
}

constexpr double kShareUnits = 1 << 30;  // shares of the box are stored as whole numbers

// Shares from 0 to 1 that do not descend: each as the difference from the one before.
void append_shares(std::vector<std::uint8_t>& out, std::span<const double> shares) {
  std::uint64_t before = 0;
  for (const double share : shares) {
    const auto units = std::uint64_t(std::llround(share * kShareUnits));
    append_varint(out, units - std::exchange(before, units));
  }
}
std::optional<std::vector<double>> take_shares(std::span<const std::uint8_t>& bytes, std::size_t count) {
  std::vector<double> shares;
  std::uint64_t units = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto more = take_varint(bytes);
    if (!more || *more > std::uint64_t(kShareUnits) - units) return {};
    units += *more;
    shares.push_back(double(units) / kShareUnits);
  }
  return shares;
}

void append_statistics(const FieldDescription& d, std::vector<std::byte>& histogram, std::vector<std::byte>& volumes) {
  std::vector<std::uint8_t> counts, shares;
  for (const std::uint64_t n : d.statistics.histogram.count) append_varint(counts, n);
  append(histogram, std::span(&d.statistics.histogram.width, 1));
  append<std::uint8_t>(histogram, counts);
  append_shares(shares, d.statistics.volumes.below);
  append_shares(shares, d.statistics.volumes.not_above);
  const std::uint64_t rows = d.statistics.volumes.position.size();
  append(volumes, std::span(&rows, 1));
  append<double>(volumes, d.statistics.volumes.position);
  append<std::uint8_t>(volumes, shares);
}

Result<void> read_histogram(std::span<const std::byte> bytes, FieldDescription& d) {
  const auto damaged = [] { return fail("the histogram is damaged"); };
  if (bytes.size() < sizeof(double)) return damaged();
  d.statistics.histogram = {d.format.least(), numbers_of<double>(bytes.first(sizeof(double)))[0], {}};
  if (!(d.statistics.histogram.width > 0) || !std::isfinite(d.statistics.histogram.width)) return damaged();
  std::uint64_t left = d.grid.sample_count();
  for (auto counts = octets(bytes.subspan(sizeof(double))); !counts.empty();) {
    const auto count = take_varint(counts);
    if (!count || *count > left || d.statistics.histogram.count.size() == kMostBins) return damaged();
    left -= *count;
    d.statistics.histogram.count.push_back(*count);
  }
  if (d.statistics.histogram.count.empty()) return damaged();
  return {};
}

Result<void> read_volumes(std::span<const std::byte> bytes, FieldDescription& d) {
  const auto damaged = [] { return fail("the table of volumes is damaged"); };
  if (bytes.size() < 8) return damaged();
  const std::uint64_t rows = numbers_of<std::uint64_t>(bytes.first(8))[0];
  if (rows == 0 || rows > kMostPositions || bytes.size() < 8 * (rows + 1)) return damaged();
  d.statistics.volumes.position = numbers_of<double>(bytes.subspan(8, 8 * rows));
  auto shares = octets(bytes.subspan(8 * (rows + 1)));
  const auto below = take_shares(shares, rows), not_above = take_shares(shares, rows);
  if (!below || !not_above || !shares.empty()) return damaged();
  d.statistics.volumes.below = *below;
  d.statistics.volumes.not_above = *not_above;
  const auto& position = d.statistics.volumes.position;
  for (std::size_t i = 0; i < rows; ++i) {
    if (!std::isfinite(position[i]) || (i > 0 && position[i] <= position[i - 1])) return damaged();
  }
  return {};
}

// No more than the diamonds of these scales: those at samples whose coordinates are multiples of 2^finest.
std::uint64_t least_values(const Grid& grid, int finest) {
  std::uint64_t values = 1;
  for (const std::int32_t samples : grid.dims) values *= (std::uint64_t(samples - 1) >> finest) + 1;
  return values;
}

}  // namespace

std::uint64_t memory_to_decode(const Grid& grid, ValueKey last, int finest) {
  std::uint64_t supercubes = 2, samples = 1;
  for (const std::int32_t side : grid.dims) {
    const std::uint64_t at_scale = (std::uint64_t(side - 1) >> finest) + 1;
    samples *= at_scale;
    supercubes *= at_scale / 4 + 2;
  }
  return samples * (3 * ValueKeys(0, last).width() + 2) + supercubes * 72;
}

bool is_value_file(const std::filesystem::path& path) { return scope_of(path) == FileScope::every_range; }

Streams encode_field(const ValueVolume::Parts& parts) {
  Streams streams;
  append_field(streams, parts, parts.description.is_exact);
  append_labels(streams, parts.description.labels);
  append_statistics(parts.description, streams[StreamType::histogram], streams[StreamType::volumes]);
  return streams;
}

void append_bounds(Streams& streams, std::span<const PageBounds> bounds) {
  if (bounds.size() > 1) append(streams[StreamType::page_bounds], bounds);
}

std::vector<std::byte> encode_values(const ValueVolume& volume, const ParallelFor& parallel, KeptPages* kept) {
  const FieldDescription& d = volume.description();
  Streams streams = encode_field(volume.parts());
  append_pages(volume.parts(), streams[StreamType::page_index], streams[StreamType::pages], parallel, {kept, 0});
  append_bounds(streams, bounds_of_pages(volume.parts(), pages_of(volume.set()), parallel));
  append_channels(streams, d.grid, volume.set(), d.channels, volume.parts().channel_keys, parallel, kept);
  return make_container(FileScope::every_range, streams);
}

namespace {

// All but what the pages hold. finest: the finest scale of those that are there. pages_bytes: of their pages.
Result<ValueVolume::Parts> read_description(const Container& file, std::uint64_t pages_bytes, std::string name, int finest) {
  ValueVolume::Parts parts;
  FieldDescription& d = parts.description;
  d.name = std::move(name);
  d.content_hash = file.content_hash();
  if (auto ok = read_field(file, d); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_labels(file, d.labels); !ok) return tl::unexpected(ok.error());
  // Sizes before contents.
  if (d.grid.sample_count() > kMostSamples) return fail("more samples than this program can read");
  if (least_values(d.grid, finest) > most_coded_bits(pages_bytes) + kRootVertices) return fail("the file claims more values than it can hold");
  file.claim(memory_to_decode(d.grid, d.format.last, finest));
  if (auto ok = read_weights(file, Domain(d.grid.dims).levels(), parts.weights); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_histogram(file[StreamType::histogram], d); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_volumes(file[StreamType::volumes], d); !ok) return tl::unexpected(ok.error());
  return parts;
}

}  // namespace

ValueSummary summary_of(const ValueVolume& volume, std::uint64_t file_bytes) {
  return {volume.description(), volume.set().size(), volume.set().supercubes(), volume.memory_bytes(), file_bytes};
}

Result<std::optional<StreamPlace>> pages_beside_summary(std::span<const std::byte> start, std::uint64_t file_bytes) {
  const auto scope = scope_of(start, file_bytes);
  if (!scope) return tl::unexpected(scope.error());
  if (*scope != FileScope::every_range) return std::nullopt;
  const auto channels = place_of(StreamType::channels, start, file_bytes, *scope);
  if (!channels) return tl::unexpected(channels.error());
  if (channels->bytes != 0) return std::nullopt;
  return place_of(StreamType::pages, start, file_bytes, *scope);
}

Result<ValueSummary> decode_summary(const FileEnds& ends, std::string name) {
  const auto file = Container::open_ends(ends, FileScope::every_range);
  if (!file) return tl::unexpected(file.error());
  const auto pages = place_of(StreamType::pages, ends.first, ends.file_bytes, FileScope::every_range);
  if (!pages) return tl::unexpected(pages.error());
  auto parts = read_description(*file, pages->bytes, std::move(name), 0);
  if (!parts) return tl::unexpected(parts.error());
  ValueSummary summary{std::move(parts->description), 0, 0, 0, ends.file_bytes};
  const ValueFormat& format = summary.description.format;
  const Domain domain(summary.description.grid.dims);
  const SetCounts counts = count_supercubes(domain);
  summary.updates = count_diamonds(domain);
  summary.supercubes = counts.supercubes;
  const std::uint64_t levels = summary.updates - count_diamonds(domain, 0, {}, last_supercube(domain, 0));
  summary.memory_bytes = format.memory_bytes() + SupercubeSet::memory_bytes_of(counts.bricks, counts.supercubes) +
                         summary.updates * ValueKeys(0, format.last).width() + levels * sizeof(ErrorLevel);
  return summary;
}

Result<std::optional<ValueSummary>> load_summary(const std::filesystem::path& path) {
  const auto failed = [&path](const Error& error) { return fail(path.string() + ": " + error.message); };
  FileParts file;
  if (auto opened = file.open(path); !opened) return failed(opened.error());
  const auto start = file.read(0, std::min<std::uint64_t>(file.bytes(), kMostHeadBytes));
  if (!start) return failed(start.error());
  const auto pages = pages_beside_summary(*start, file.bytes());
  if (!pages) return failed(pages.error());
  if (!*pages) return std::nullopt;
  const std::uint64_t after = (*pages)->offset + (*pages)->bytes;
  const auto first = file.read(0, (*pages)->offset);
  if (!first) return failed(first.error());
  const auto last = file.read(after, file.bytes() - after);
  if (!last) return failed(last.error());
  auto summary = decode_summary({*first, *last, file.bytes()}, path.stem().string());
  if (!summary) return failed(summary.error());
  return *std::move(summary);
}

Result<ValueVolume> decode_coarse_values(const FileEnds& ends, std::string name, int finest, const ParallelFor& parallel) {
  const auto file = Container::open_ends(ends, FileScope::every_range);
  if (!file) return tl::unexpected(file.error());
  auto parts = read_description(*file, (*file)[StreamType::pages].size(), std::move(name), finest);
  if (!parts) return tl::unexpected(parts.error());
  const Domain domain(parts->description.grid.dims);
  parts->set = all_diamonds(domain, parallel, finest);
  parts->finer = std::size_t(count_diamonds(domain)) - parts->set.size();
  parts->keys = ValueKeys(0, parts->description.format.last);
  auto index = (*file)[StreamType::page_index], pages = (*file)[StreamType::pages];
  if (auto ok = take_pages(index, pages, *parts, parallel, nullptr); !ok) return tl::unexpected(ok.error());
  return ValueVolume(std::move(*parts));
}

namespace {

static_assert(sizeof(PageBounds) == 8, "no padding");

Result<std::vector<PageBounds>> read_bounds(const Container& file, const ValueFormat& format, std::size_t pages) {
  const auto bytes = file.stream(StreamType::page_bounds, pages * sizeof(PageBounds));
  if (!bytes) return tl::unexpected(bytes.error());
  std::vector<PageBounds> bounds = numbers_of<PageBounds>(*bytes);
  const auto is_valid = [&](const PageBounds& b) { return b.least <= b.greatest && b.greatest <= format.last; };
  if (!std::all_of(bounds.begin(), bounds.end(), is_valid)) return fail("the bounds of the pages are damaged");
  return bounds;
}

constexpr std::uint64_t kLittle = 16 << 10;  // bytes that come sooner than the answer to another request

// Adds the pages that begin within the first `there` bytes, and those between two others that are no more than kLittle
// together.
void add_little_between(std::vector<bool>& pages, std::span<const std::uint64_t> lengths, std::uint64_t there) {
  std::uint64_t between = 0;
  std::size_t before = 0;  // the last one that is to be read
  for (std::size_t page = 0; page < pages.size(); ++page) {
    if (!pages[page] && there == 0) {
      between = between > kLittle ? between : between + std::min(lengths[page], kLittle + 1);
      continue;
    }
    there -= std::min(there, lengths[page]);
    if (between <= kLittle) std::fill(pages.begin() + std::ptrdiff_t(before), pages.begin() + std::ptrdiff_t(page) + 1, true);
    pages[page] = true;
    before = page;
    between = 0;
  }
}

}  // namespace

Result<std::optional<NeededPages>> needed_pages(const FileEnds& ends, const ShownRanges& shown) {
  const auto file = Container::open_ends(ends, FileScope::every_range);
  if (!file) return tl::unexpected(file.error());
  if ((*file)[StreamType::page_bounds].empty() || !(*file)[StreamType::channels].empty()) return std::nullopt;
  FieldDescription d;
  if (auto ok = read_field(*file, d); !ok) return tl::unexpected(ok.error());
  const std::vector<std::uint64_t> lengths = page_lengths((*file)[StreamType::page_index]);
  const auto bounds = read_bounds(*file, d.format, lengths.size());
  if (!bounds) return tl::unexpected(bounds.error());
  const auto place = place_of(StreamType::pages, ends.first, ends.file_bytes, FileScope::every_range);
  if (!place) return tl::unexpected(place.error());
  NeededPages needed{pages_for(*bounds, d.format, shown), {}};
  const std::uint64_t there = ends.first.size();
  add_little_between(needed.pages, lengths, place->offset < there ? there - place->offset : 0);
  std::uint64_t at = place->offset, bytes = 0;
  for (std::size_t page = 0; page < lengths.size(); at += lengths[page++]) {
    if (lengths[page] > place->offset + place->bytes - at) return fail("the index of the pages is damaged");
    if (!needed.pages[page]) continue;
    bytes += lengths[page];
    const std::uint64_t begin = std::max(at, there), end = at + lengths[page];
    if (begin >= end) continue;
    if (needed.places.empty() || needed.places.back().offset + needed.places.back().bytes != begin) needed.places.push_back({begin, 0});
    needed.places.back().bytes += end - begin;
  }
  if (at != place->offset + place->bytes) return fail("the index of the pages is damaged");
  if (least_values(d.grid, 0) > most_coded_bits(bytes) + kRootVertices) return std::nullopt;
  return needed;
}

// What the other pages hold does not matter, but for the side of each range's ends: any value within their bounds is on the
// right one.
Result<ValueVolume> decode_needed_values(const FileEnds& ends, std::string name, const std::vector<bool>& pages, const ParallelFor& parallel) {
  const auto file = Container::open_ends(ends, FileScope::every_range);
  if (!file) return tl::unexpected(file.error());
  auto parts = read_description(*file, (*file)[StreamType::pages].size(), std::move(name), 0);
  if (!parts) return tl::unexpected(parts.error());
  parts->set = all_diamonds(Domain(parts->description.grid.dims), parallel);
  const std::vector<ValuePage> all = pages_of(parts->set);
  if (pages.size() != all.size()) return fail("the index of the pages is damaged");
  const auto bounds = read_bounds(*file, parts->description.format, all.size());
  if (!bounds) return tl::unexpected(bounds.error());
  parts->keys = ValueKeys(0, parts->description.format.last);
  const auto decoded = take_some_pages((*file)[StreamType::page_index], (*file)[StreamType::pages], pages, *parts, parallel);
  if (!decoded) return tl::unexpected(decoded.error());
  for (std::size_t page = 0; page < all.size(); ++page) {
    if ((*decoded)[page]) continue;
    for (const BrickRun& block : all[page]) {
      for (BrickIndex brick = block.first; brick < block.end; ++brick) {
        const std::size_t first = parts->set.bricks()[brick].first;
        for (std::size_t i = first; i < first + parts->set.updates(brick); ++i) parts->keys.set(i, (*bounds)[page].least);
      }
    }
  }
  return ValueVolume(std::move(*parts));
}

Result<ValueVolume> decode_values(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel, std::uint64_t room,
                                  PageFaults* faults) {
  const auto file = Container::open(bytes, FileScope::every_range, room, faults != nullptr);
  if (!file) return tl::unexpected(file.error());
  auto read = read_description(*file, (*file)[StreamType::pages].size(), std::move(name), 0);
  if (!read) return tl::unexpected(read.error());
  ValueVolume::Parts& parts = *read;
  FieldDescription& d = parts.description;
  const Domain domain(d.grid.dims);
  parts.set = all_diamonds(domain, parallel);
  parts.keys = ValueKeys(0, d.format.last);
  if (auto ok = read_pages(*file, parts, parallel, faults); !ok) return tl::unexpected(ok.error());
  if (!(*file)[StreamType::page_bounds].empty()) {
    auto bounds = read_bounds(*file, d.format, pages_of(parts.set).size());
    if (!bounds) return tl::unexpected(bounds.error());
    parts.page_bounds = *std::move(bounds);
  }
  auto channels = read_channels(*file, d.grid, parts.set, parallel, faults);
  if (!channels) return tl::unexpected(channels.error());
  d.channels = std::move(channels->channels);
  parts.channel_keys = std::move(channels->keys);
  parts.left = take_faults(domain, parts.set, faults, d.content_hash);
  return ValueVolume(std::move(parts));
}

Result<std::uint64_t> save_values(const std::filesystem::path& path, const ValueVolume& volume, const ParallelFor& parallel, KeptPages* kept) {
  const std::vector<std::byte> bytes = encode_values(volume, parallel, kept);
  if (auto ok = save_container(path, bytes); !ok) return tl::unexpected(ok.error());
  return bytes.size();
}

Result<std::shared_ptr<const ValueVolume>> load_values(const std::filesystem::path& path, const ParallelFor& parallel, PageFaults* faults) {
  const auto bytes = read_container(path, FileScope::every_range, parallel);
  if (!bytes) return tl::unexpected(bytes.error());
  auto volume = decode_values(*bytes, path.stem().string(), parallel, kAnyRoom, faults);
  if (!volume) return fail(path.string() + ": " + volume.error().message);
  return std::make_shared<const ValueVolume>(std::move(*volume));
}

}  // namespace intervale

#include "common/ivm/ivm_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/codec/coding_rate.h"
#include "common/ivm/channel_file.h"
#include "common/ivm/ivm_coding.h"
#include "common/ivm/value_streams.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr int kCompression = 9;     // zstd; 19 gains a few percent and takes ten times as long
constexpr unsigned kSlotBytes = 7;  // of an occupancy word: 56 slots
constexpr std::uint64_t kMostVarintBytes = 9;
constexpr std::uint64_t kMostCuts = 2 * kMaxVertices;  // of an update: two on each subdivision edge

struct RangeRecord {
  double alpha, beta;
  std::uint32_t refine, errors;
  std::uint64_t updates, coefficients, supercubes, bricks, full_vertices, full_tets;
};
static_assert(sizeof(RangeRecord) == 72, "no padding");

RangeRecord record_of(const IntervalVolume& volume) {
  const Description& d = volume.description();
  return {d.range.alpha,   d.range.beta,   std::uint32_t(d.refine),   std::uint32_t(volume.error_steps().size()),
          d.updates,       d.coefficients, volume.set().supercubes(), volume.set().bricks().size(),
          d.full.vertices, d.full.tets};
}

// The contents of a stream that is compressed.
std::vector<std::uint8_t> contents_of(const IntervalVolume& volume, StreamType type) {
  const SupercubeSet& set = volume.set();
  std::vector<std::uint8_t> contents;
  if (type == StreamType::bricks) {
    std::uint64_t previous = 0;
    for (const SupercubeSet::Brick& b : set.bricks()) append_varint(contents, (b.key >> 6) - std::exchange(previous, b.key >> 6));
  }
  if (type == StreamType::masks) {
    std::vector<std::uint64_t> masks;
    masks.reserve(set.bricks().size());
    for (const SupercubeSet::Brick& b : set.bricks()) masks.push_back(b.mask);
    contents = split_bytes(masks, 8);
  }
  if (type == StreamType::occupancy) contents = split_bytes(set.occupancy(), kSlotBytes);
  if (type == StreamType::errors) {
    const auto bytes = octets(std::as_bytes(volume.error_steps()));
    contents.assign(bytes.begin(), bytes.end());
  }
  if (type == StreamType::error_to_distance) {
    contents.reserve(set.supercubes());
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      const BrickNeeds needs = volume.relevant().brick(b);
      std::size_t n = 0;
      set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey) { contents.push_back(needs.to_distance(n++).code()); });
    }
  }
  return contents;
}

constexpr std::array kCompressed{StreamType::bricks, StreamType::masks, StreamType::occupancy, StreamType::errors, StreamType::error_to_distance};

std::vector<std::uint8_t> coded_error_steps(const IntervalVolume& volume) {
  std::vector<std::uint8_t> steps(volume.steps().begin(), volume.steps().end());
  RangeEncoder coder;
  (void)code_error_steps(coder, volume.set(), steps, serial);
  return coder.finish();
}

std::vector<std::uint8_t> coded_update_slopes(const IntervalVolume& volume) {
  std::vector<std::uint8_t> slopes;
  slopes.reserve(volume.size());
  const SupercubeSet& set = volume.set();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    const BrickNeeds needs = volume.relevant().brick(b);
    std::size_t n = 0;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
      const std::uint64_t relevant = needs.slots(n, set.occupancy()[s]);  // those of others are never read
      for (const Slot slot : set_bits<Slot>(set.occupancy()[s]))
        slopes.push_back((relevant >> slot & 1) != 0 ? needs.of_update(n, relevant, slot).slope : std::uint8_t(0));
      ++n;
    });
  }
  RangeEncoder coder;
  (void)code_update_slopes(coder, volume.set(), slopes, serial);
  return coder.finish();
}

std::string name_of(StreamType type) { return "stream " + std::to_string(std::uint32_t(type)); }

tl::unexpected<Error> does_not_decompress(StreamType type) { return fail(name_of(type) + " does not decompress"); }

// The contents of a compressed stream: at most so many bytes.
Result<std::vector<std::uint8_t>> read_at_most(const Container& file, StreamType type, std::uint64_t most) {
  auto bytes = octets(file[type]);
  auto contents = take_plane(bytes, most);
  if (!contents || !bytes.empty()) return does_not_decompress(type);
  return std::move(*contents);
}

// The same: exactly so many.
Result<std::vector<std::uint8_t>> read_exactly(const Container& file, StreamType type, std::uint64_t expected) {
  auto contents = read_at_most(file, type, expected);
  if (contents && contents->size() != expected) {
    return fail(name_of(type) + " holds " + std::to_string(contents->size()) + " bytes, " + std::to_string(expected) + " expected");
  }
  return contents;
}

// Counts before contents: each bounded by the number of bytes.
Result<RangeRecord> read_range(const Container& file, Description& d) {
  RangeRecord r;
  const auto bytes = file.stream(StreamType::range, sizeof r);
  if (!bytes) return tl::unexpected(bytes.error());
  std::memcpy(&r, bytes->data(), sizeof r);
  if (r.refine > 1) return fail("the refinement mode is unknown");
  if (!(r.alpha <= r.beta)) return fail("invalid range: alpha is greater than beta");
  if (r.errors > std::uint32_t(kMaxErrorSteps)) return fail("the number of errors is out of range");
  if (r.updates > most_coded_bits(std::min(file[StreamType::pages].size(), file[StreamType::error_steps].size())))
    return fail("the file claims more values than it can hold");
  if (r.updates > kMostUpdates) return fail("more updates than this program can read");
  if (r.bricks > r.supercubes || r.supercubes > r.updates || r.updates > r.supercubes * kSlots || r.coefficients > r.updates * kMostCuts)
    return fail("the counts contradict each other");
  if (r.supercubes > kMostSupercubes) return fail("more updates than this program can read");
  // An update's key, its bounds, its error step and what that is decoded with, its slope; what makes the set, and its
  // supercubes.
  file.claim(r.updates * (3 * ValueKeys(0, d.format.last).width() + 5) + r.supercubes * 56 + r.bricks * 128);
  d.refine = Refine(r.refine);
  d.range = {r.alpha, r.beta};
  d.coefficients = r.coefficients;
  d.full = {r.full_vertices, r.full_tets};
  return r;
}

// The supercubes' keys from bricks and masks; ascending. levels: of the domain
Result<std::vector<SupercubeKey>> supercube_keys(std::span<const std::uint8_t> steps, std::span<const std::uint64_t> masks, std::uint64_t count,
                                                 int levels, const ParallelFor& parallel) {
  std::vector<SupercubeKey> keys;
  keys.reserve(count);
  std::uint64_t brick = 0;
  for (std::size_t b = 0; b < masks.size(); ++b) {
    may_stop(parallel);
    const auto step = take_varint(steps);
    if (!step || (b > 0 && *step == 0) || *step >= (std::uint64_t(1) << 56) - brick || masks[b] == 0) return fail("bricks do not ascend");
    brick += *step;
    const SupercubeKey first = brick << 6;
    if (scale_of_key(first) < 0 || scale_of_key(first) >= levels) return fail("a brick's scale is out of range");
    for (const int bit : set_bits(masks[b])) {
      if (keys.size() == count) return fail("more supercubes than the file says");
      keys.push_back(first + unsigned(bit));
      const Vertex p = position_of_key(keys.back());
      if (std::max({p.x, p.y, p.z}) > (1 << kMaxLevels) >> (scale_of_key(first) + 2)) return fail("a supercube outside the largest grid");
    }
  }
  if (keys.size() != count || !steps.empty()) return fail("the numbers of supercubes in bricks and in the range's record differ");
  return keys;
}

Result<SupercubeSet> read_set(const Container& file, const RangeRecord& r, int levels, const ParallelFor& parallel) {
  const auto bricks = read_at_most(file, StreamType::bricks, r.bricks * kMostVarintBytes);
  if (!bricks) return tl::unexpected(bricks.error());
  const auto masks = read_exactly(file, StreamType::masks, r.bricks * 8);
  if (!masks) return tl::unexpected(masks.error());
  const auto slots = read_exactly(file, StreamType::occupancy, r.supercubes * kSlotBytes);
  if (!slots) return tl::unexpected(slots.error());
  const auto keys = supercube_keys(*bricks, join_bytes(*masks, 8), r.supercubes, levels, parallel);
  if (!keys) return tl::unexpected(keys.error());
  auto occupancy = join_bytes(*slots, kSlotBytes);
  std::uint64_t occupied = 0;
  for (const std::uint64_t word : occupancy) {
    if (word == 0) return fail("a supercube without a diamond");
    occupied += std::uint64_t(std::popcount(word));
  }
  if (occupied != r.updates) return fail("the numbers of updates and occupied slots differ");
  return SupercubeSet(*keys, std::move(occupancy));
}

// Errors, and what converts them to distances. The set is known.
Result<void> read_errors(const Container& file, const RangeRecord& r, IntervalVolume::Parts& parts, const ParallelFor& parallel) {
  const auto errors = read_exactly(file, StreamType::errors, r.errors * sizeof(float));
  if (!errors) return tl::unexpected(errors.error());
  parts.error_steps.resize(r.errors);
  if (!errors->empty()) std::memcpy(parts.error_steps.data(), errors->data(), errors->size());
  const auto codes = read_exactly(file, StreamType::error_to_distance, r.supercubes);
  if (!codes) return tl::unexpected(codes.error());
  parts.surface.to_distance.reserve(codes->size());
  for (const std::uint8_t code : *codes) parts.surface.to_distance.emplace_back(code);
  parts.steps.resize(r.updates);
  RangeDecoder coder(octets(file[StreamType::error_steps]));
  if (!code_error_steps(coder, parts.set, parts.steps, parallel) || !coder.is_spent()) return does_not_decompress(StreamType::error_steps);
  const auto slopes = octets(file[StreamType::update_slopes]);
  if (slopes.empty()) return {};
  if (r.updates > most_coded_bits(slopes.size())) return does_not_decompress(StreamType::update_slopes);
  parts.surface.slopes.resize(r.updates);
  RangeDecoder of_slopes(slopes);
  if (!code_update_slopes(of_slopes, parts.set, parts.surface.slopes, parallel) || !of_slopes.is_spent())
    return does_not_decompress(StreamType::update_slopes);
  return {};
}

}  // namespace

std::vector<std::byte> encode_ivm(const IntervalVolume& volume, const ParallelFor& parallel, KeptPages* kept) {
  Streams streams;
  append_values(streams, volume, volume.description().is_exact, parallel, kept);
  append_labels(streams, volume.description().labels);
  const RangeRecord record = record_of(volume);
  append(streams[StreamType::range], std::span(&record, 1));
  parallel(kCompressed.size() + 2, [&](std::size_t i) {
    if (i == kCompressed.size()) {
      append<std::uint8_t>(streams[StreamType::error_steps], coded_error_steps(volume));
      return;
    }
    if (i > kCompressed.size()) {
      if (volume.relevant().has_slopes()) append<std::uint8_t>(streams[StreamType::update_slopes], coded_update_slopes(volume));
      return;
    }
    std::vector<std::uint8_t> stored;
    append_plane(stored, contents_of(volume, kCompressed[i]), kCompression);
    append<std::uint8_t>(streams[kCompressed[i]], stored);
  });
  append_channels(streams, volume.description().grid, volume.set(), volume.description().channels, volume.channel_keys(), parallel, kept);
  return make_container(FileScope::one_range, streams);
}

Result<IntervalVolume> decode_ivm(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel, std::uint64_t room,
                                  PageFaults* faults) {
  const auto file = Container::open(bytes, FileScope::one_range, room, faults != nullptr);
  if (!file) return tl::unexpected(file.error());
  IntervalVolume::Parts parts;
  Description& d = parts.description;
  d.name = std::move(name);
  d.content_hash = file->content_hash();
  if (auto ok = read_field(*file, d); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_labels(*file, d.labels); !ok) return tl::unexpected(ok.error());
  const auto record = read_range(*file, d);
  if (!record) return tl::unexpected(record.error());
  const int levels = Domain(d.grid.dims).levels();
  if (auto ok = read_weights(*file, levels, d.weights); !ok) return tl::unexpected(ok.error());
  auto set = read_set(*file, *record, levels, parallel);
  if (!set) return tl::unexpected(set.error());
  parts.set = std::move(*set);
  parts.keys = ValueKeys(0, d.format.last);
  if (auto ok = read_pages(*file, parts, parallel, faults); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_errors(*file, *record, parts, parallel); !ok) return tl::unexpected(ok.error());
  auto channels = read_channels(*file, d.grid, parts.set, parallel, faults);
  if (!channels) return tl::unexpected(channels.error());
  parts.left = take_faults(Domain(d.grid.dims), parts.set, faults, d.content_hash);
  auto volume = IntervalVolume::assemble(std::move(parts), parallel);
  if (!volume) return volume;
  if (auto ok = volume->set_channels(std::move(channels->channels), std::move(channels->keys)); !ok) return tl::unexpected(ok.error());
  return volume;
}

Result<void> save_ivm(const std::filesystem::path& path, const IntervalVolume& volume, const ParallelFor& parallel, KeptPages* kept) {
  return save_container(path, encode_ivm(volume, parallel, kept));
}

Result<std::shared_ptr<const IntervalVolume>> load_ivm(const std::filesystem::path& path, const ParallelFor& parallel, PageFaults* faults) {
  const auto bytes = read_container(path, FileScope::one_range, parallel);
  if (!bytes) return tl::unexpected(bytes.error());
  auto volume = decode_ivm(*bytes, path.stem().string(), parallel, kAnyRoom, faults);
  if (!volume) return fail(path.string() + ": " + volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale

#include "tests/support/evil_files.h"

#include <oneapi/tbb/global_control.h>
#include <xxhash.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <tuple>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/special_values.h"

namespace intervale::testing {
namespace {

using Stream = StreamType;
using Spoil = std::function<void(Streams&)>;
using Bytes = std::vector<std::byte>;

constexpr Dims kDims{33, 20, 17};
constexpr std::uint64_t kMost64 = std::numeric_limits<std::uint64_t>::max();
// Where the parts of the records are (FORMAT.md).
constexpr std::size_t kType = 12, kAffine = 16, kStep = 112, kMaxError = 120, kFirst = 128, kLast = 136, kCorners = 140, kIsExact = 172;
constexpr std::size_t kAlpha = 0, kBeta = 8, kRefine = 16, kErrors = 20, kUpdates = 24, kCoefficients = 32, kSupercubes = 40, kBricks = 48;

Streams streams_of(const Bytes& bytes, FileScope scope) {
  const auto file = Container::open(bytes, scope).value();
  Streams streams;
  for (std::uint32_t type = 1; type < kStreamTypes; ++type) {
    const auto stream = file[Stream(type)];
    streams[Stream(type)].assign(stream.begin(), stream.end());
  }
  return streams;
}

template <class T>
Spoil number(Stream type, std::size_t at, T value) {
  return [=](Streams& streams) { std::memcpy(streams[type].data() + at, &value, sizeof value); };
}
// Adds to the number there.
Spoil more(Stream type, std::size_t at, std::uint64_t what) {
  return [=](Streams& streams) {
    std::uint64_t value = 0;
    std::memcpy(&value, streams[type].data() + at, sizeof value);
    value += what;
    std::memcpy(streams[type].data() + at, &value, sizeof value);
  };
}
Spoil cut(Stream type, std::size_t bytes) {
  return [=](Streams& streams) { streams[type].resize(streams[type].size() - bytes); };
}
Spoil longer(Stream type, std::size_t bytes) {
  return [=](Streams& streams) { streams[type].resize(streams[type].size() + bytes, std::byte(1)); };
}
Spoil bytes_of(Stream type, const std::string& bytes) {
  return [=](Streams& streams) {
    const auto all = std::as_bytes(std::span(bytes));
    streams[type].assign(all.begin(), all.end());
  };
}
// The contents of a plane, changed.
Spoil plane(Stream type, const std::function<void(std::vector<std::uint8_t>&)>& change) {
  return [=](Streams& streams) {
    auto bytes = octets(streams[type]);
    auto contents = take_plane(bytes, 1 << 20).value();
    change(contents);
    std::vector<std::uint8_t> stored;
    append_plane(stored, contents, 1);
    streams[type].clear();
    append<std::uint8_t>(streams[type], stored);
  };
}
// 16 MiB of zeros in a thousandth of that; says: the length that it claims.
Spoil bomb(Stream type, std::uint64_t says) {
  return [=](Streams& streams) {
    std::vector<std::uint8_t> honest, stored;
    append_plane(honest, std::vector<std::uint8_t>(16 << 20), 1);
    std::span<const std::uint8_t> rest(honest);
    (void)take_varint(rest);
    append_varint(stored, says);
    stored.insert(stored.end(), rest.begin(), rest.end());
    streams[type].clear();
    append<std::uint8_t>(streams[type], stored);
  };
}
template <class T>
auto number_in(std::size_t i, T value) {
  return [=](std::vector<std::uint8_t>& contents) { std::memcpy(contents.data() + i * sizeof value, &value, sizeof value); };
}
auto shorter_by(std::size_t bytes) {
  return [=](std::vector<std::uint8_t>& contents) { contents.resize(contents.size() - bytes); };
}
// The first page, and all that is known of it, are noise.
void noise_page(Streams& streams) {
  std::uint64_t size = 0;
  std::memcpy(&size, streams[Stream::page_index].data(), sizeof size);
  std::mt19937 random(1);
  for (std::size_t i = 0; i < size; ++i) streams[Stream::pages][i] = std::byte(random() % 256);
  number(Stream::page_index, 8, XXH3_64bits(streams[Stream::pages].data(), size))(streams);
}

// A list of lies about one file.
class Liar {
 public:
  Liar(std::vector<EvilFile>& to, std::string kind, FileScope scope, const Bytes& good)
      : to_(to), kind_(std::move(kind)), scope_(scope), good_(streams_of(good, scope)) {}
  void operator()(const std::string& name, const Spoil& spoil, const std::string& about) {
    Streams streams = good_;
    spoil(streams);
    to_.push_back({kind_ + "-" + name, make_container(scope_, streams), about});
  }

 private:
  std::vector<EvilFile>& to_;
  std::string kind_;
  FileScope scope_;
  Streams good_;
};

void lie_about_the_field(Liar& lie) {
  constexpr Stream f = Stream::field;
  for (const auto& [name, side] : std::vector<std::pair<std::string, std::int32_t>>{{"0", 0}, {"1", 1}, {"negative", -33}, {"long", (1 << 20) + 1}})
    lie("side-" + name, number(f, 4, side), "samples is out of bounds");
  lie("type", number(f, kType, std::uint32_t(8)), "type of the samples is unknown");
  lie("affine-nan", number(f, kAffine, kNan), "not finite");
  lie("affine-huge", number(f, kAffine, 1e308), "far corner");
  lie("affine-singular", number(f, kAffine, 0.0), "singular");
  for (const auto& [name, step] : std::vector<std::pair<std::string, double>>{{"nan", kNan}, {"negative", -1.0}, {"infinite", kInf}})
    lie("step-" + name, number(f, kStep, step), "step of the values");
  lie("step-tiny", number(f, kStep, 1e-300), "too fine");
  lie("step-huge", number(f, kStep, 1e308), "not finite");
  lie(
      "step-0-of-whole-numbers",
      [](Streams& s) {
        number(f, kStep, 0.0)(s);
        number(f, kType, std::uint32_t(2))(s);
      },
      "values");
  for (const auto& [name, error] : std::vector<std::pair<std::string, double>>{{"nan", kNan}, {"negative", -1.0}, {"infinite", kInf}})
    lie("max-error-" + name, number(f, kMaxError, error), "largest error");
  lie("first", number(f, kFirst, std::numeric_limits<std::int64_t>::max()), "out of range");
  lie("last", number(f, kLast, std::uint32_t(0xffffffff)), "too many steps");
  lie("last-0", number(f, kLast, std::uint32_t(0)), "corner's value");
  lie("corner", number(f, kCorners + 12, std::uint32_t(0xfffffffe)), "corner's value");
  lie("exact", number(f, kIsExact, std::uint32_t(2)), "record is damaged");
  lie("short", cut(f, 4), "172 bytes, 176 expected");
  lie("long", longer(f, 4), "180 bytes, 176 expected");
}

void lie_about_values(Liar& lie) {
  lie("weights-short", cut(Stream::weights, 2), "bytes,");
  lie("weights-none", bytes_of(Stream::weights, ""), "0 bytes,");
  lie("page-vast", number(Stream::page_index, 0, kMost64), "index of the pages");
  lie("page-overlaps", more(Stream::page_index, 0, 1), "");
  lie("page-short", more(Stream::page_index, 0, kMost64), "");
  lie("page-checksum", more(Stream::page_index, 8, 1), "page 0 of");
  lie("page-noise", noise_page, "page 0 of");
  lie("page-index-short", cut(Stream::page_index, 16), "index of the pages");
  lie("page-index-long", longer(Stream::page_index, 16), "index of the pages");
  lie("page-index-uneven", longer(Stream::page_index, 1), "index of the pages");
  lie("pages-none", bytes_of(Stream::pages, ""), "claims more values than it can hold");
  lie("pages-long", longer(Stream::pages, 1), "index of the pages");
  lie("labels-none", bytes_of(Stream::labels, ""), "labels are damaged");
  lie("labels-long", bytes_of(Stream::labels, "\xff" + std::string(255, 'x') + std::string(2, '\0')), "labels are damaged");
  lie("labels-control", bytes_of(Stream::labels, std::string("\x04\x1b[2J\0\0", 7)), "without control characters");
  lie("labels-no-utf8", bytes_of(Stream::labels, std::string("\x02\xff\xff\0\0", 5)), "not UTF-8");
  lie("labels-more", longer(Stream::labels, 1), "labels are damaged");
  lie("table-without-need", bytes_of(Stream::value_table, "xxxxxxxx"), "does not belong");
}

// Where the first component's record is in the channels: behind their number, and the channel's name, unit and number of
// components.
constexpr std::size_t kComponent = 1 + 1 + 5 + 1 + 1;  // "noise"

void lie_about_channels(Liar& lie) {
  constexpr Stream c = Stream::channels;
  const auto byte = [](std::size_t at, unsigned value) { return number(c, at, std::uint8_t(value)); };
  lie("channels-17", byte(0, 17), "channels are damaged");
  lie("channels-none", byte(0, 0), "channels are damaged");
  lie("channels-3", byte(0, 3), "channels are damaged");
  lie("channel-long-name", byte(1, 65), "channels are damaged");
  lie(
      "channel-no-name",
      [](Streams& s) {
        s[c][1] = std::byte(0);
        s[c].erase(s[c].begin() + 2, s[c].begin() + 7);
      },
      "no label");
  lie("channel-control", byte(2, 0x1b), "no label");
  lie(
      "channel-reserved", [](Streams& s) { std::memcpy(s[c].data() + 2, "value", 5); }, "no label");
  lie(
      "channel-same-names", [](Streams& s) { std::memcpy(s[c].data() + 2, "place", 5); }, "two channels have one name");
  lie("channel-2-components", byte(8, 2), "");
  lie("channel-255-components", byte(8, 255), "channels are damaged");
  lie("channel-step", number(c, kComponent, kNan), "step of the values");
  lie("channel-first", number(c, kComponent + 8, std::numeric_limits<std::int64_t>::min()), "out of range");
  lie("channel-type", number(c, kComponent + 16, std::uint32_t(8)), "channels are damaged");
  lie("channel-last", number(c, kComponent + 20, std::uint32_t(0xffffffff)), "too many steps");
  lie("channel-corner", number(c, kComponent + 28, std::uint32_t(0xfffffffe)), "");
  lie(
      "channel-table",
      [](Streams& s) {
        number(c, kComponent, 0.0)(s);
        number(c, kComponent + 16, std::uint32_t(2))(s);
      },
      "table of values");
  lie("channels-short", cut(c, 1), "");
  lie("channels-long", longer(c, 1), "channels are damaged");
  lie("channel-pages-none", bytes_of(Stream::channel_pages, ""), "claims more values than it can hold");
  lie("channel-pages-long", longer(Stream::channel_pages, 3), "channels are damaged");
}

void lie_about_one_range(Liar& lie) {
  constexpr Stream r = Stream::range;
  lie("range-upside-down", number(r, kAlpha, 7.0), "alpha is greater than beta");
  lie("range-nan", number(r, kBeta, kNan), "alpha is greater than beta");
  lie("refine", number(r, kRefine, std::uint32_t(2)), "refinement mode");
  lie("errors-many", number(r, kErrors, std::uint32_t(257)), "number of errors");
  lie("errors-less", more(r, kErrors, kMost64), "does not decompress");
  lie("updates-most", number(r, kUpdates, kMost64), "claims more values than it can hold");
  lie("updates-0", number(r, kUpdates, std::uint64_t(0)), "contradict");
  lie("updates-more", more(r, kUpdates, 1), "numbers of updates");
  lie("coefficients", number(r, kCoefficients, kMost64), "contradict");
  lie("supercubes-less", more(r, kSupercubes, kMost64), "does not decompress");
  lie("supercubes-most", number(r, kSupercubes, kMost64), "contradict");
  lie("bricks-0", number(r, kBricks, std::uint64_t(0)), "does not decompress");
  lie("bricks-twice", plane(Stream::bricks, [](auto& steps) { steps.back() = 0; }), "do not ascend");
  lie("bricks-endless", plane(Stream::bricks, [](auto& steps) { steps.back() = 0xff; }), "do not ascend");
  lie("bricks-bomb", bomb(Stream::bricks, 4), "does not decompress");
  lie("bricks-no-plane", bytes_of(Stream::bricks, std::string(12, '\xff')), "does not decompress");
  lie("mask-0", plane(Stream::masks, [](auto& planes) { std::fill(planes.begin(), planes.end(), std::uint8_t(0)); }), "do not ascend");
  lie("masks-short", plane(Stream::masks, shorter_by(8)), "expected");
  lie("masks-bomb", bomb(Stream::masks, 16 << 20), "does not decompress");
  lie("occupancy-0", plane(Stream::occupancy, [](auto& planes) { std::fill(planes.begin(), planes.end(), std::uint8_t(0)); }), "without a diamond");
  lie("occupancy-full", plane(Stream::occupancy, [](auto& planes) { std::fill(planes.begin(), planes.end(), std::uint8_t(255)); }),
      "numbers of updates");
  lie("error-nan", plane(Stream::errors, number_in(1, std::numeric_limits<float>::quiet_NaN())), "do not ascend");
  lie("error-negative", plane(Stream::errors, number_in(0, -1.0F)), "do not ascend");
  lie("error-descends", plane(Stream::errors, number_in(0, 1e30F)), "do not ascend");
  lie("error-to-distance-short", plane(Stream::error_to_distance, shorter_by(1)), "expected");
  lie("error-to-distance-bomb", bomb(Stream::error_to_distance, 1), "");
  lie("error-steps-long", longer(Stream::error_steps, 64), "does not decompress");
  lie("slopes-long", longer(Stream::update_slopes, 64), "does not decompress");
  lie("slopes-short", bytes_of(Stream::update_slopes, std::string(1, '\xff')), "does not decompress");
  lie(
      "sides-vast",
      [](Streams& s) {
        for (const std::size_t at : {0, 4, 8}) number(Stream::field, at, std::int32_t(1 << 20))(s);
      },
      "bytes,");
}

void lie_about_every_range(Liar& lie) {
  constexpr Stream h = Stream::histogram, v = Stream::volumes;
  for (const auto& [name, width] : std::vector<std::pair<std::string, double>>{{"0", 0}, {"nan", kNan}, {"negative", -1}, {"infinite", kInf}})
    lie("histogram-width-" + name, number(h, 0, width), "histogram is damaged");
  lie("histogram-none", bytes_of(h, ""), "histogram is damaged");
  lie("histogram-empty", bytes_of(h, std::string(8, '\1')), "histogram is damaged");
  lie("histogram-long", bytes_of(h, std::string(8 + 257, '\1')), "histogram is damaged");
  lie("histogram-endless", longer(h, 400), "histogram is damaged");
  lie("histogram-of-more-samples", bytes_of(h, std::string(8, '\1') + "\x01\xff\xff\x7f\x01"), "histogram is damaged");
  lie(
      "histogram-cut", [](Streams& s) { s[h].back() = std::byte(0x80); }, "histogram is damaged");
  lie("volumes-none", bytes_of(v, ""), "table of volumes");
  lie("volumes-0-rows", number(v, 0, std::uint64_t(0)), "table of volumes");
  lie("volumes-most-rows", number(v, 0, kMost64), "table of volumes");
  lie("volumes-more-rows", more(v, 0, 1), "table of volumes");
  lie("volumes-nan", number(v, 8, kNan), "table of volumes");
  lie("volumes-descend", number(v, 8, 1e300), "table of volumes");
  lie(
      "volumes-share", [](Streams& s) { std::fill(s[v].end() - 9, s[v].end(), std::byte(0x7f)); }, "table of volumes");
  lie("volumes-long", longer(v, 1), "table of volumes");
  lie(
      "sides-vast",
      [](Streams& s) {
        for (const std::size_t at : {0, 4, 8}) number(Stream::field, at, std::int32_t(1 << 20))(s);
      },
      "more samples than this program can read");
  for (const auto& [name, last, about] : {std::tuple{"sides-over-most", 4097, "more samples than this program can read"},
                                          std::tuple{"sides-most", 4096, "claims more values than it can hold"}})
    lie(
        name,
        [last = last](Streams& s) {
          for (const std::size_t at : {0, 4}) number(Stream::field, at, std::int32_t(1 << 12))(s);
          number(Stream::field, 8, std::int32_t(last))(s);
        },
        about);
  lie(
      "sides-long",
      [](Streams& s) {
        for (const std::size_t at : {0, 4}) number(Stream::field, at, std::int32_t(1 << 13))(s);
      },
      "claims more values than it can hold");
}

}  // namespace

std::vector<std::byte> good_file_of_one_range() {
  IntervalVolume volume = build(gyroid(kDims), {.range = {-0.3, 0.4}});
  set_channels(volume, 1);
  return encode_ivm(volume);
}

std::vector<std::byte> good_file_of_every_range() {
  Volume samples = gyroid(kDims);
  ValueVolume::Parts parts = build_value_volume(samples, choose_value_format(samples, {}).value()).take();
  for (const auto& [name, volume] : {NamedVolume{"noise", noise(kDims, 1, 300, 1)}, NamedVolume{"place", places(kDims)}}) {
    auto built = build_channel(volume, name, {}, parts.set).value();
    parts.description.channels.push_back(std::move(built.channel));
    parts.channel_keys.push_back(std::move(built.keys));
  }
  return encode_values(ValueVolume(std::move(parts)));
}

std::vector<EvilFile> evil_files() {
  // On this thread: oneTBB is not instrumented, and the thread sanitizer takes what its threads do for races.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<EvilFile> files;
  Liar one(files, "one", FileScope::one_range, good_file_of_one_range()), every(files, "every", FileScope::every_range, good_file_of_every_range());
  for (Liar* const lie : {&one, &every}) {
    lie_about_the_field(*lie);
    lie_about_values(*lie);
    lie_about_channels(*lie);
  }
  lie_about_one_range(one);
  lie_about_every_range(every);
  return files;
}

}  // namespace intervale::testing

#include "server/resume/build_checkpoint.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "common/diamond/domain.h"
#include "common/patch/description.h"
#include "common/patch/labels.h"

namespace intervale {
namespace {

// Kinds of records.
enum class Kind : std::uint32_t { every_range = 1, one_range = 2, channel = 3, page = 4, errors = 5 };
BuildJournal::Name name_of(Kind kind, std::uint32_t first = 0, std::uint32_t second = 0) { return {std::uint32_t(kind), first, second}; }

constexpr std::size_t kMostText = 4096;
constexpr std::size_t kShort = 1 << 20;    // bytes of errors that are written at once
constexpr std::size_t kKeysAtOnce = 4096;  // of supercubes

// The two directions of the functions below, which have one text so that both have the same order. In reading, sizes come
// before contents, and nothing is allocated that is not there; once something is wrong, all is.
class Out {
 public:
  static constexpr bool kReads = false;
  explicit Out(BuildJournal::Writer& writer) : writer_(writer) {}
  void bytes(std::span<const std::byte> bytes) { writer_.write(bytes); }
  [[nodiscard]] bool is_good() const { return true; }

 private:
  BuildJournal::Writer& writer_;
};

class In {
 public:
  static constexpr bool kReads = true;
  explicit In(BuildJournal::Reader& reader) : reader_(reader) {}
  void bytes(std::span<std::byte> bytes) { is_good_ = is_good_ && reader_.read(bytes); }
  [[nodiscard]] bool is_good() const { return is_good_; }
  void require(bool is_so) { is_good_ = is_good_ && is_so; }
  [[nodiscard]] std::uint64_t left() const { return reader_.left(); }  // bytes
  // Whether so many things of so many bytes can follow.
  [[nodiscard]] bool has(std::uint64_t count, std::size_t each) {
    require(count <= reader_.left() / each);
    return is_good_;
  }

 private:
  BuildJournal::Reader& reader_;
  bool is_good_ = true;
};

// A number, or numbers without padding.
template <class File, class T>
void code(File& file, T& number) {
  static_assert(std::is_trivially_copyable_v<T> && !std::is_enum_v<std::remove_const_t<T>> && !std::is_same_v<std::remove_const_t<T>, bool>);
  if constexpr (File::kReads)
    file.bytes(std::as_writable_bytes(std::span(&number, 1)));
  else
    file.bytes(std::as_bytes(std::span(&number, 1)));
}

template <class File, class T>
void code_small(File& file, T& value, unsigned most) {
  auto number = std::uint8_t(value);
  code(file, number);
  if constexpr (File::kReads) {
    file.require(number <= most);
    if (file.is_good()) value = T(number);
  }
}

// A count and what it counts: a vector or a string.
template <class File, class Many>
void code_many(File& file, Many& many, std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) {
  std::uint64_t count = many.size();
  code(file, count);
  if constexpr (File::kReads) {
    file.require(count <= most);
    if (!file.has(count, sizeof many[0])) return;
    many.resize(count);
    file.bytes(std::as_writable_bytes(std::span(many)));
  } else {
    file.bytes(std::as_bytes(std::span(many)));
  }
}

template <class File, class Format>
void code_format(File& file, Format& format) {
  code_small(file, format.type, unsigned(kSampleTypes) - 1);
  code(file, format.step);
  code(file, format.first);
  code(file, format.last);
  if constexpr (File::kReads) {
    std::vector<double> table;
    code_many(file, table);
    if (!table.empty()) format.table = std::make_shared<const std::vector<double>>(std::move(table));
    file.require(file.is_good() && check_value_format(format));
  } else {
    const std::vector<double> none;
    code_many(file, format.table ? *format.table : none);
  }
}

// Keys, as many as there are diamonds. last: the greatest one.
template <class File, class Keys>
void code_keys(File& file, Keys& keys, std::size_t size, ValueKey last) {
  if constexpr (File::kReads) {
    if (!file.has(size, ValueKeys(0, last).width())) return;
    keys = ValueKeys(size, last);
    file.bytes(std::as_writable_bytes(keys.bytes()));
    if (!file.is_good()) return;
    bool fits = true;
    for (std::size_t i = 0; i < size; ++i) fits = fits && keys[i] <= last;
    file.require(fits);
  } else {
    file.bytes(std::as_bytes(keys.bytes()));
  }
}

void write_set(Out& file, const SupercubeSet& set) {
  const std::uint64_t count = set.supercubes();
  code(file, count);
  std::vector<SupercubeKey> keys;
  const auto flush = [&] {
    file.bytes(std::as_bytes(std::span(keys)));
    keys.clear();
  };
  for (BrickIndex brick{0}; brick < set.bricks().size(); ++brick) {
    set.for_each_supercube(brick, [&](SupercubeIndex, SupercubeKey key) { keys.push_back(key); });
    if (keys.size() >= kKeysAtOnce) flush();
  }
  flush();
  file.bytes(std::as_bytes(set.occupancy()));
}

// levels: of the domain.
bool fits(const std::vector<SupercubeKey>& keys, const std::vector<std::uint64_t>& occupancy, int levels) {
  std::uint64_t diamonds = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const int scale = scale_of_key(keys[i]);
    if ((i > 0 && keys[i] <= keys[i - 1]) || scale < 0 || scale >= levels || occupancy[i] == 0 || occupancy[i] >> kSlots != 0) return false;
    const Vertex p = position_of_key(keys[i]);
    if (std::max({p.x, p.y, p.z}) > (1 << kMaxLevels) >> (scale + 2)) return false;
    diamonds += std::uint64_t(std::popcount(occupancy[i]));
  }
  return diamonds <= kMostUpdates && keys.size() <= kMostSupercubes;
}

SupercubeSet read_set(In& file, int levels) {
  std::uint64_t count = 0;
  code(file, count);
  if (!file.has(count, sizeof(SupercubeKey) + sizeof(std::uint64_t))) return {};
  std::vector<SupercubeKey> keys(count);
  std::vector<std::uint64_t> occupancy(count);
  file.bytes(std::as_writable_bytes(std::span(keys)));
  file.bytes(std::as_writable_bytes(std::span(occupancy)));
  file.require(file.is_good() && fits(keys, occupancy, levels));
  if (!file.is_good()) return {};
  return {keys, std::move(occupancy)};
}

template <class File, class Set>
void code_set(File& file, Set& set, const Grid& grid) {
  if constexpr (File::kReads) {
    if (file.is_good()) set = read_set(file, Domain(grid.dims).levels());
  } else {
    write_set(file, set);
  }
}

// What both kinds of descriptions have.
template <class File, class D>
void code_description(File& file, D& d) {
  code(file, d.grid.dims);
  code(file, d.grid.affine.rows);
  if constexpr (File::kReads) file.require(file.is_good() && check_grid(d.grid));
  for (auto* label : {&d.labels.unit, &d.labels.field, &d.labels.field_unit, &d.labels.space}) code_many(file, *label, kMaxLabel);
  if constexpr (File::kReads) file.require(file.is_good() && check_labels(d.labels));
  code_format(file, d.format);
  code_small(file, d.is_exact, 1);
  code(file, d.corners);
  code(file, d.max_error);
  if constexpr (File::kReads) {
    file.require(std::all_of(d.corners.begin(), d.corners.end(), [&d](ValueKey key) { return key <= d.format.last; }));
    file.require(d.max_error >= 0 && std::isfinite(d.max_error));
  }
}

template <class File, class Statistics>
void code_statistics(File& file, Statistics& statistics) {
  auto& [histogram, volumes] = statistics;
  code(file, histogram.least);
  code(file, histogram.width);
  code_many(file, histogram.count, kMostBins);
  code_many(file, volumes.position);
  code_many(file, volumes.below);
  code_many(file, volumes.not_above);
  if constexpr (File::kReads) {
    const std::size_t rows = volumes.position.size();
    file.require(histogram.width > 0 && !histogram.count.empty() && rows > 0 && volumes.below.size() == rows && volumes.not_above.size() == rows);
  }
}

template <class File, class Parts>
void code_every_range(File& file, Parts& parts) {
  code_description(file, parts.description);
  code_statistics(file, parts.description.statistics);
  code(file, parts.weights);
  code_set(file, parts.set, parts.description.grid);
  code_many(file, parts.error_levels);
  if constexpr (File::kReads) {
    file.require(parts.error_levels.size() == coarse_diamonds(parts.set));
    file.require(std::all_of(parts.error_levels.begin(), parts.error_levels.end(), [](ErrorLevel level) { return level < kErrorLevels; }));
  }
  code_keys(file, parts.keys, parts.set.size(), parts.description.format.last);
}

template <class File, class Surface>
void code_surface(File& file, Surface& surface) {
  std::vector<std::uint8_t> codes;
  if constexpr (!File::kReads) {
    codes.reserve(surface.to_distance.size());
    for (const ErrorToDistance& ratio : surface.to_distance) codes.push_back(ratio.code());
  }
  code_many(file, codes);
  if constexpr (File::kReads) {
    surface.to_distance.reserve(codes.size());
    for (const std::uint8_t number : codes) surface.to_distance.emplace_back(number);
  }
  code_many(file, surface.slopes);
  code_many(file, surface.distances);
}

template <class File, class Parts, class Text>
void code_one_range(File& file, Parts& parts, Text& values) {
  auto& d = parts.description;
  code_many(file, values, kMostText);
  code_description(file, d);
  code(file, d.range.alpha);
  code(file, d.range.beta);
  code_small(file, d.refine, unsigned(Refine::uniform));
  code(file, d.weights);
  code(file, d.coefficients);
  code(file, d.full.vertices);
  code(file, d.full.tets);
  code_set(file, parts.set, d.grid);
  code_many(file, parts.steps);
  code_many(file, parts.error_steps, std::uint64_t(kMaxErrorSteps));
  code_surface(file, parts.surface);
  code_keys(file, parts.keys, parts.set.size(), d.format.last);
}

template <class File, class C>
void code_channel(File& file, C& channel) {
  code_many(file, channel.name, kMaxLabel);
  code_many(file, channel.unit, kMaxLabel);
  auto components = std::uint8_t(channel.components.size());
  code(file, components);
  if constexpr (File::kReads) {
    file.require(components <= kMaxComponents);
    if (!file.is_good()) return;
    channel.components.resize(components);
  }
  for (auto& component : channel.components) {
    code_format(file, component.format);
    code_small(file, component.is_exact, 1);
    code(file, component.corners);
    code(file, component.weights);
  }
  if constexpr (File::kReads) file.require(file.is_good() && check_channels(std::span(&channel, 1)));
}

template <class Code>
void write(BuildJournal& journal, const BuildJournal::Name& name, Code&& code_all) {
  BuildJournal::Writer writer(journal, name);
  Out out(writer);
  code_all(out);
  writer.end();
}

// Whether there is a record of this name, and all of it is as it was written.
template <class Code>
bool read(BuildJournal& journal, const BuildJournal::Name& name, Code&& code_all) {
  BuildJournal::Reader reader(journal, name);
  if (!reader.is_there()) return false;
  In in(reader);
  code_all(in);
  if (in.is_good()) return reader.is_intact();
  journal.drop(name);
  return false;
}

}  // namespace

Result<std::unique_ptr<BuildCheckpoint>> BuildCheckpoint::open(const std::filesystem::path& path, std::uint64_t fingerprint,
                                                               BuildJournal::Warn warn) {
  auto journal = BuildJournal::open(path, fingerprint, std::move(warn));
  if (!journal) return tl::unexpected(journal.error());
  return std::unique_ptr<BuildCheckpoint>(new BuildCheckpoint(std::move(*journal)));
}

bool BuildCheckpoint::find_errors(int scale, std::span<float> errors) {
  return read(*journal_, name_of(Kind::errors, std::uint32_t(scale)), [&](In& in) {
    in.require(in.left() == errors.size_bytes());
    in.bytes(std::as_writable_bytes(errors));
    in.require(std::all_of(errors.begin(), errors.end(), [](float error) { return error >= 0 && std::isfinite(error); }));
  });
}

void BuildCheckpoint::keep_errors(int scale, std::span<const float> errors) {
  const BuildJournal::Name name = name_of(Kind::errors, std::uint32_t(scale));
  const auto bytes = std::as_bytes(errors);
  if (bytes.size() <= kShort) return journal_->append(name, bytes);
  write(*journal_, name, [&](Out& out) { out.bytes(bytes); });
}

std::size_t BuildCheckpoint::error_scales() const { return journal_->count(std::uint32_t(Kind::errors)); }

std::optional<ValueVolume::Parts> BuildCheckpoint::take_every_range() {
  ValueVolume::Parts parts;
  if (!read(*journal_, name_of(Kind::every_range), [&](In& in) { code_every_range(in, parts); })) return {};
  return parts;
}

void BuildCheckpoint::keep_every_range(const ValueVolume::Parts& parts) {
  write(*journal_, name_of(Kind::every_range), [&](Out& out) { code_every_range(out, parts); });
  journal_->free(std::uint32_t(Kind::errors));
}

std::optional<BuildCheckpoint::OneRange> BuildCheckpoint::take_one_range() {
  OneRange kept;
  if (!read(*journal_, name_of(Kind::one_range), [&](In& in) { code_one_range(in, kept.parts, kept.values); })) return {};
  return kept;
}

void BuildCheckpoint::keep_one_range(const IntervalVolume::Parts& parts, const std::string& values) {
  write(*journal_, name_of(Kind::one_range), [&](Out& out) { code_one_range(out, parts, values); });
  journal_->free(std::uint32_t(Kind::errors));
}

std::optional<BuildCheckpoint::KeptChannel> BuildCheckpoint::take_channel(std::uint32_t number, const SupercubeSet& set) {
  KeptChannel kept;
  const bool is_there = read(*journal_, name_of(Kind::channel, number), [&](In& in) {
    code_channel(in, kept.channel);
    for (const ChannelComponent& component : kept.channel.components) code_keys(in, kept.keys.emplace_back(), set.size(), component.format.last);
  });
  if (!is_there) return {};
  return kept;
}

void BuildCheckpoint::keep_channel(std::uint32_t number, const Channel& channel, const ChannelKeys& keys) {
  write(*journal_, name_of(Kind::channel, number), [&](Out& out) {
    code_channel(out, channel);
    for (std::size_t c = 0; c < keys.size(); ++c) code_keys(out, keys[c], keys[c].size(), channel.components[c].format.last);
  });
}

std::optional<std::vector<std::uint8_t>> BuildCheckpoint::find(const PageName& page) {
  std::vector<std::uint8_t> bytes;
  const bool is_there = read(*journal_, name_of(Kind::page, page.values, page.page), [&](In& in) {
    bytes.resize(in.left());
    in.bytes(std::as_writable_bytes(std::span(bytes)));
  });
  if (!is_there) return {};
  return bytes;
}

void BuildCheckpoint::keep(const PageName& page, std::span<const std::uint8_t> bytes) {
  journal_->append(name_of(Kind::page, page.values, page.page), std::as_bytes(bytes));
}

std::size_t BuildCheckpoint::pages() const { return journal_->count(std::uint32_t(Kind::page)); }

}  // namespace intervale

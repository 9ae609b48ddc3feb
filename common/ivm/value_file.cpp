#include "common/ivm/value_file.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <optional>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/ivm/value_page.h"
#include "common/util/atomic_file.h"

namespace intervale {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they lie in memory: little endian");

constexpr char kMagic[8] = {'\x89', 'I', 'V', 'M', '\r', '\n', '\x1a', '\n'};
constexpr std::uint64_t kValuesPerByte = 8192;  // no page has more: no bit is less probable than 1/1040
constexpr std::uint32_t kMaxStreams = 64;
constexpr std::size_t kMostPositions = 4096;  // of the table of volumes

enum StreamType : std::uint32_t { kField = 1, kWeights = 2, kPageIndex = 3, kPages = 4, kHistogram = 5, kVolumes = 6 };
constexpr StreamType kLastStream = kVolumes;
constexpr std::uint32_t kOptional = 1;  // flag: a reader that does not know the type skips the stream

struct Header {
  char magic[8];
  std::uint32_t version, streams;
  std::uint64_t file_bytes, content_hash;
  std::uint64_t checksum;  // XXH3 of header and stream table, this field 0
};
struct Stream {
  std::uint32_t type, flags;
  std::uint64_t offset, bytes;
  std::uint64_t checksum;  // XXH3 of its bytes; 0 for the pages, each of which has its own
};
struct FieldRecord {
  std::int32_t dims[3];
  std::uint32_t type;
  double spacing[3], origin[3], step, max_error;
  std::int64_t first;
  std::uint32_t last, corners[kRootVertices], is_exact;
};
struct PageRecord {
  std::uint64_t bytes, checksum;
};
static_assert(sizeof(Header) == 40 && sizeof(Stream) == 32 && sizeof(FieldRecord) == 128 && sizeof(PageRecord) == 16, "no padding");

template <class T>
void append(std::vector<std::byte>& out, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

FieldRecord record_of(const FieldDescription& d) {
  FieldRecord r{};
  for (std::size_t i = 0; i < 3; ++i) {
    r.dims[i] = d.grid.dims[i];
    r.spacing[i] = d.grid.spacing[i];
    r.origin[i] = d.grid.origin[i];
  }
  r.type = std::uint32_t(d.format.type);
  r.step = d.format.step;
  r.max_error = d.max_error;
  r.first = d.format.first;
  r.last = d.format.last;
  r.is_exact = d.is_exact;
  std::copy(d.corners.begin(), d.corners.end(), r.corners);
  return r;
}

Result<FieldDescription> description_of(const FieldRecord& r, std::string name) {
  FieldDescription d;
  d.name = std::move(name);
  for (std::size_t i = 0; i < 3; ++i) {
    d.grid.dims[i] = r.dims[i];
    d.grid.spacing[i] = r.spacing[i];
    d.grid.origin[i] = r.origin[i];
  }
  if (auto ok = check_grid(d.grid); !ok) return tl::unexpected(ok.error());
  if (r.type >= std::uint32_t(kSampleTypes)) return fail("the type of the samples is unknown");
  d.format = {SampleType(r.type), r.step, r.first, r.last};
  if (auto ok = check_value_format(d.format); !ok) return tl::unexpected(ok.error());
  if (r.is_exact > 1) return fail("the field's record is damaged");
  d.is_exact = r.is_exact != 0;
  d.max_error = r.max_error;
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  std::copy_n(r.corners, kRootVertices, d.corners.begin());
  if (std::any_of(d.corners.begin(), d.corners.end(), [&](ValueKey key) { return key > d.format.last; }))
    return fail("a corner's value is out of range");
  return d;
}

std::uint64_t head_checksum(std::span<const std::byte> head) {
  std::vector<std::byte> copy(head.begin(), head.end());
  std::memset(copy.data() + offsetof(Header, checksum), 0, 8);
  return XXH3_64bits(copy.data(), copy.size());
}

// What a file consists of, checked.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> file) : file_(file) {}

  [[nodiscard]] Result<void> read_head() {
    if (file_.size() < sizeof kMagic || std::memcmp(file_.data(), kMagic, sizeof kMagic) != 0) return fail("not an interval volume file (.ivm)");
    if (file_.size() < sizeof header_) return fail("the file ends within its header");
    std::memcpy(&header_, file_.data(), sizeof header_);
    if (header_.version != kValueFileVersion) {
      return fail("version " + std::to_string(header_.version) + " of the format, this program reads version " + std::to_string(kValueFileVersion) +
                  (header_.version > kValueFileVersion ? "; use a newer program" : "; build the file again"));
    }
    if (header_.streams > kMaxStreams) return fail("the header is damaged: too many streams");
    const std::size_t head = sizeof header_ + header_.streams * sizeof(Stream);
    if (file_.size() < head) return fail("the file ends within its header");
    if (header_.checksum != head_checksum(file_.first(head))) return fail("the header is damaged (checksum)");
    if (header_.file_bytes != file_.size()) {
      return fail("the file has " + std::to_string(file_.size()) + " bytes, " + std::to_string(header_.file_bytes) +
                  " expected: it was cut short or added to");
    }
    std::uint64_t next = head;
    for (std::uint32_t i = 0; i < header_.streams; ++i) {
      Stream s;
      std::memcpy(&s, file_.data() + sizeof header_ + i * sizeof s, sizeof s);
      if (s.offset != next || s.bytes > file_.size() - next) return fail("the table of streams is damaged");
      next += s.bytes;
      const bool is_known = s.type >= kField && s.type <= kLastStream;
      if (!is_known && (s.flags & kOptional) == 0) return fail("stream " + std::to_string(s.type) + " is unknown; use a newer program");
      if (!is_known) continue;
      if (streams_[s.type]) return fail("stream " + std::to_string(s.type) + " is there twice");
      const auto bytes = file_.subspan(s.offset, s.bytes);
      if (s.type != kPages && XXH3_64bits(bytes.data(), bytes.size()) != s.checksum) {
        return fail("stream " + std::to_string(s.type) + " is damaged (checksum)");
      }
      streams_[s.type] = bytes;
    }
    if (next != file_.size()) return fail("bytes after the last stream");
    return {};
  }

  // The bytes of a stream that must be there, in records of so many bytes.
  [[nodiscard]] Result<std::span<const std::byte>> stream(StreamType type, std::size_t bytes) const {
    if (!streams_[type]) return fail("stream " + std::to_string(type) + " is missing");
    if (streams_[type]->size() != bytes) {
      return fail("stream " + std::to_string(type) + " has " + std::to_string(streams_[type]->size()) + " bytes, " + std::to_string(bytes) +
                  " expected");
    }
    return *streams_[type];
  }
  [[nodiscard]] std::size_t bytes_of(StreamType type) const { return streams_[type] ? streams_[type]->size() : 0; }
  [[nodiscard]] const Header& header() const { return header_; }

 private:
  std::span<const std::byte> file_;
  Header header_{};
  std::array<std::optional<std::span<const std::byte>>, kLastStream + 1> streams_;
};

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
  for (const std::uint64_t n : d.histogram.count) append_varint(counts, n);
  append(histogram, std::span(&d.histogram.width, 1));
  append<std::uint8_t>(histogram, counts);
  append_shares(shares, d.volumes.below);
  append_shares(shares, d.volumes.not_above);
  const std::uint64_t rows = d.volumes.position.size();
  append(volumes, std::span(&rows, 1));
  append<double>(volumes, d.volumes.position);
  append<std::uint8_t>(volumes, shares);
}

std::span<const std::uint8_t> octets(std::span<const std::byte> bytes) { return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}; }

Result<void> read_histogram(std::span<const std::byte> bytes, FieldDescription& d) {
  const auto damaged = [] { return fail("the histogram is damaged"); };
  if (bytes.size() < sizeof(double)) return damaged();
  d.histogram = {d.format.least(), numbers_of<double>(bytes.first(sizeof(double)))[0], {}};
  if (!(d.histogram.width > 0)) return damaged();
  for (auto counts = octets(bytes.subspan(sizeof(double))); !counts.empty();) {
    const auto count = take_varint(counts);
    if (!count || d.histogram.count.size() == kMostBins) return damaged();
    d.histogram.count.push_back(*count);
  }
  if (d.histogram.count.empty()) return damaged();
  return {};
}

Result<void> read_volumes(std::span<const std::byte> bytes, FieldDescription& d) {
  const auto damaged = [] { return fail("the table of volumes is damaged"); };
  if (bytes.size() < 8) return damaged();
  const std::uint64_t rows = numbers_of<std::uint64_t>(bytes.first(8))[0];
  if (rows == 0 || rows > kMostPositions || bytes.size() < 8 * (rows + 1)) return damaged();
  d.volumes.position = numbers_of<double>(bytes.subspan(8, 8 * rows));
  auto shares = octets(bytes.subspan(8 * (rows + 1)));
  const auto below = take_shares(shares, rows), not_above = take_shares(shares, rows);
  if (!below || !not_above || !shares.empty()) return damaged();
  d.volumes.below = *below;
  d.volumes.not_above = *not_above;
  const auto& position = d.volumes.position;
  for (std::size_t i = 0; i < rows; ++i) {
    if (!std::isfinite(position[i]) || (i > 0 && position[i] <= position[i - 1])) return damaged();
  }
  return {};
}

// Decodes pages, those of one scale in parallel: they depend on coarser ones only.
Result<void> decode_pages(ValueVolume::Parts& parts, const Reader& file, const ParallelFor& parallel) {
  const std::vector<ValuePage> pages = pages_of(parts.set);
  const auto index = file.stream(kPageIndex, pages.size() * sizeof(PageRecord));
  if (!index) return tl::unexpected(index.error());
  std::vector<PageRecord> records(pages.size());
  if (!records.empty()) std::memcpy(records.data(), index->data(), index->size());
  const auto all = file.stream(kPages, file.bytes_of(kPages));
  if (!all) return tl::unexpected(all.error());
  std::vector<std::span<const std::byte>> bytes;
  std::size_t at = 0;
  for (const PageRecord& r : records) {
    if (r.bytes > all->size() - at) return fail("the index of the pages is damaged");
    bytes.push_back(all->subspan(at, r.bytes));
    at += r.bytes;
  }
  if (at != all->size()) return fail("the index of the pages is damaged");
  const auto scale = [&](std::size_t page) { return scale_of_key(parts.set.bricks()[pages[page].front().first].key); };
  constexpr std::size_t kNone = ~std::size_t(0);
  std::atomic<std::size_t> damaged = kNone;
  for (std::size_t first = 0, end = 0; first < pages.size() && damaged == kNone; first = end) {
    while (end < pages.size() && scale(end) == scale(first)) ++end;
    parallel(end - first, [&](std::size_t i) {
      const std::size_t page = first + i;
      const auto of = bytes[page];
      const bool is_intact = XXH3_64bits(of.data(), of.size()) == records[page].checksum;
      if (!is_intact || !decode_page(parts, pages[page], {reinterpret_cast<const std::uint8_t*>(of.data()), of.size()})) damaged = page;
    });
  }
  if (damaged != kNone) return fail("page " + std::to_string(damaged.load()) + " of " + std::to_string(pages.size()) + " is damaged");
  return {};
}

}  // namespace

bool is_value_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  Header header{};
  in.read(reinterpret_cast<char*>(&header), offsetof(Header, streams));
  return in && std::memcmp(header.magic, kMagic, sizeof kMagic) == 0 && header.version >= kValueFileVersion;
}

std::vector<std::byte> encode_values(const ValueVolume& volume, const ParallelFor& parallel) {
  const ValueVolume::Parts& parts = volume.parts();
  const std::vector<ValuePage> pages = pages_of(parts.set);
  std::vector<std::vector<std::uint8_t>> coded(pages.size());
  parallel(pages.size(), [&](std::size_t page) { coded[page] = encode_page(parts, pages[page]); });

  std::array<std::vector<std::byte>, kLastStream + 1> streams;
  const FieldRecord field = record_of(parts.description);
  append(streams[kField], std::span(&field, 1));
  append(streams[kWeights], std::span<const PredictorWeights>(&parts.weights.of[0][0], std::size_t(volume.domain().levels()) * 3));
  for (const auto& page : coded) {
    const PageRecord record{page.size(), XXH3_64bits(page.data(), page.size())};
    append(streams[kPageIndex], std::span(&record, 1));
    append(streams[kPages], std::span(page));
  }
  append_statistics(parts.description, streams[kHistogram], streams[kVolumes]);

  std::vector<std::byte> file(sizeof(Header));
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kValueFileVersion;
  header.streams = kLastStream;
  header.content_hash = XXH3_64bits(streams[kPageIndex].data(), streams[kPageIndex].size());
  header.content_hash = XXH3_64bits_withSeed(streams[kField].data(), streams[kField].size(), header.content_hash);
  header.file_bytes = sizeof(Header) + header.streams * sizeof(Stream);
  for (std::uint32_t type = kField; type <= kLastStream; ++type) {
    const auto& bytes = streams[type];
    const Stream s{type, type >= kHistogram ? kOptional : 0, header.file_bytes, bytes.size(),
                   type == kPages ? 0 : XXH3_64bits(bytes.data(), bytes.size())};
    append(file, std::span(&s, 1));
    header.file_bytes += bytes.size();
  }
  std::memcpy(file.data(), &header, sizeof header);
  header.checksum = head_checksum(file);
  std::memcpy(file.data(), &header, sizeof header);
  file.reserve(header.file_bytes);
  for (const auto& bytes : streams) file.insert(file.end(), bytes.begin(), bytes.end());
  return file;
}

Result<ValueVolume> decode_values(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel) {
  Reader file(bytes);
  if (auto ok = file.read_head(); !ok) return tl::unexpected(ok.error());
  const auto field = file.stream(kField, sizeof(FieldRecord));
  if (!field) return tl::unexpected(field.error());
  FieldRecord record;
  std::memcpy(&record, field->data(), sizeof record);
  auto description = description_of(record, std::move(name));
  if (!description) return tl::unexpected(description.error());
  ValueVolume::Parts parts;
  parts.description = std::move(*description);
  FieldDescription& d = parts.description;
  d.content_hash = file.header().content_hash;
  // Sizes before contents.
  if (d.grid.sample_count() > std::uint64_t(~std::uint32_t(0)) / 2) return fail("more samples than this program can read");
  if (d.grid.sample_count() / kValuesPerByte > bytes.size()) return fail("the file claims more values than it can hold");
  const Domain domain(d.grid.dims);
  const auto weights = file.stream(kWeights, std::size_t(domain.levels()) * 3 * sizeof(PredictorWeights));
  if (!weights) return tl::unexpected(weights.error());
  std::memcpy(parts.weights.of.data(), weights->data(), weights->size());
  const auto histogram = file.stream(kHistogram, file.bytes_of(kHistogram)), volumes = file.stream(kVolumes, file.bytes_of(kVolumes));
  if (!histogram) return tl::unexpected(histogram.error());
  if (!volumes) return tl::unexpected(volumes.error());
  if (auto ok = read_histogram(*histogram, d); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_volumes(*volumes, d); !ok) return tl::unexpected(ok.error());

  parts.set = all_diamonds(domain);
  parts.keys = ValueKeys(parts.set.size(), d.format.last);
  parts.error_levels.resize(coarse_diamonds(parts.set));
  if (auto ok = decode_pages(parts, file, parallel); !ok) return tl::unexpected(ok.error());
  return ValueVolume(std::move(parts));
}

Result<std::uint64_t> save_values(const std::filesystem::path& path, const ValueVolume& volume, const ParallelFor& parallel) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  const std::vector<std::byte> bytes = encode_values(volume, parallel);
  if (auto ok = file->write(bytes); !ok) return tl::unexpected(ok.error());
  if (auto ok = file->commit(); !ok) return tl::unexpected(ok.error());
  return bytes.size();
}

Result<std::shared_ptr<const ValueVolume>> load_values(const std::filesystem::path& path, const ParallelFor& parallel) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return fail(path.string() + ": " + std::strerror(errno));
  const std::streamoff size = in.tellg();
  std::vector<std::byte> bytes(size < 0 ? 0 : std::size_t(size));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  if (!in) return fail(path.string() + ": could not be read to its end");
  auto volume = decode_values(bytes, path.stem().string(), parallel);
  if (!volume) return fail(path.string() + ": " + volume.error().message);
  return std::make_shared<const ValueVolume>(std::move(*volume));
}

}  // namespace intervale

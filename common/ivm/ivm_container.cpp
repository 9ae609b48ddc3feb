#include "common/ivm/ivm_container.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "common/util/atomic_file.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they lie in memory: little endian");

constexpr char kMagic[8] = {'\x89', 'I', 'V', 'M', '\r', '\n', '\x1a', '\n'};
constexpr std::uint32_t kMaxStreams = 64;
constexpr std::uint32_t kOptional = 1;  // flag: a reader that does not know the type skips the stream

struct Header {
  char magic[8];
  std::uint32_t version, streams;
  std::uint64_t file_bytes, content_hash;
  std::uint64_t checksum;  // XXH3 of header and stream table, this field 0
};
struct Entry {
  std::uint32_t type, flags;
  std::uint64_t offset, bytes;
  std::uint64_t checksum;  // XXH3 of its bytes; 0 for the pages, each of which has its own
};
static_assert(sizeof(Header) == 40 && sizeof(Entry) == 32, "no padding");
constexpr std::uint64_t kReadBytes = 4 << 20;  // at a time
static_assert(kMostHeadBytes == sizeof(Header) + kMaxStreams * sizeof(Entry));

constexpr std::uint32_t bit_of(StreamType type) { return std::uint32_t(1) << std::uint32_t(type); }

// The types of a scope's streams, as bits. A file has all of them, but kSometimes only if needed.
constexpr std::uint32_t kCommon =
    bit_of(StreamType::field) | bit_of(StreamType::weights) | bit_of(StreamType::page_index) | bit_of(StreamType::pages) | bit_of(StreamType::labels);
constexpr std::uint32_t kStatistics = bit_of(StreamType::histogram) | bit_of(StreamType::volumes);
constexpr std::uint32_t kChannels = bit_of(StreamType::channels) | bit_of(StreamType::channel_pages);
constexpr std::uint32_t kNotNeeded = kStatistics | bit_of(StreamType::labels) | kChannels | bit_of(StreamType::update_slopes) |
                                     bit_of(StreamType::page_bounds);  // what a mesh can do without
constexpr std::uint32_t kSometimes =
    bit_of(StreamType::value_table) | kChannels | bit_of(StreamType::update_slopes) | bit_of(StreamType::page_bounds);
constexpr std::uint32_t types_of(FileScope scope) {
  if (scope == FileScope::every_range) return kCommon | kStatistics | (kSometimes & ~bit_of(StreamType::update_slopes));
  return ((std::uint32_t(1) << kStreamTypes) - 2) & ~(kStatistics | bit_of(StreamType::page_bounds));
}

std::uint64_t head_checksum(std::span<const std::byte> head) {
  std::vector<std::byte> copy(head.begin(), head.end());
  std::memset(copy.data() + offsetof(Header, checksum), 0, 8);
  return XXH3_64bits(copy.data(), copy.size());
}

// Of what makes the mesh: over the checksums of the streams that are not optional, by type. That of the page index stands
// for the pages, whose checksums it has.
std::uint64_t hash_of_contents(std::vector<Entry> entries) {
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.type < b.type; });
  std::vector<std::uint64_t> checksums;
  checksums.reserve(entries.size());
  for (const Entry& e : entries) {
    if ((e.flags & kOptional) == 0) checksums.push_back(e.checksum);
  }
  return XXH3_64bits(checksums.data(), 8 * checksums.size());
}

// A header and its table, checked.
struct Head {
  Header header{};
  std::vector<Entry> entries;
  [[nodiscard]] bool has(StreamType type) const {
    return std::any_of(entries.begin(), entries.end(), [type](const Entry& e) { return e.type == std::uint32_t(type); });
  }
  [[nodiscard]] FileScope scope() const { return has(StreamType::range) ? FileScope::one_range : FileScope::every_range; }
};

std::string name_of(std::uint32_t type) { return "stream " + std::to_string(type); }

// The table: streams without gaps up to the end of the file, none twice, and each that the scope has.
Result<void> check_entries(const Head& head) {
  std::uint64_t next = sizeof(Header) + head.entries.size() * sizeof(Entry);
  std::uint32_t found = 0;
  for (const Entry& e : head.entries) {
    if (e.offset != next || e.bytes > head.header.file_bytes - next || (e.flags & ~kOptional) != 0) return fail("the table of streams is damaged");
    next += e.bytes;
    const bool is_known = e.type > 0 && e.type < kStreamTypes;
    if (!is_known && (e.flags & kOptional) == 0) return fail(name_of(e.type) + " is unknown; use a newer program");
    if (!is_known) continue;
    const std::uint32_t bit = bit_of(StreamType(e.type));
    if ((found & bit) != 0) return fail(name_of(e.type) + " is there twice");
    if ((types_of(head.scope()) & bit) == 0) return fail(name_of(e.type) + " does not belong to a data set of this kind");
    found |= bit;
  }
  if (next != head.header.file_bytes) return fail("bytes after the last stream");
  for (const int type : set_bits(types_of(head.scope()) & ~kSometimes & ~found))
    return fail(name_of(std::uint32_t(type)) + " is missing: an older program wrote the file, or it is damaged; build it again");
  return {};
}

// Checks the start of a file of so many bytes: at least header and table, or the whole file if it is shorter.
Result<Head> read_head(std::span<const std::byte> start, std::uint64_t bytes) {
  if (start.size() < sizeof kMagic || std::memcmp(start.data(), kMagic, sizeof kMagic) != 0) return fail("not an interval volume file (.ivm)");
  if (start.size() < sizeof(Header)) return fail("the file ends within its header");
  Head head;
  Header& header = head.header;
  std::memcpy(&header, start.data(), sizeof header);
  if (header.version != kIvmVersion) {
    return fail("version " + std::to_string(header.version) + " of the format, this program reads version " + std::to_string(kIvmVersion) +
                (header.version > kIvmVersion ? "; use a newer program" : "; build the file again"));
  }
  if (header.streams > kMaxStreams) return fail("the header is damaged: too many streams");
  const std::size_t head_bytes = sizeof header + header.streams * sizeof(Entry);
  if (start.size() < head_bytes) return fail("the file ends within its header");
  if (header.checksum != head_checksum(start.first(head_bytes))) return fail("the header is damaged (checksum)");
  if (header.file_bytes != bytes) {
    return fail("the file has " + std::to_string(bytes) + " bytes, " + std::to_string(header.file_bytes) + " expected: it was cut short or added to");
  }
  head.entries.resize(header.streams);
  if (header.streams > 0) std::memcpy(head.entries.data(), start.data() + sizeof header, header.streams * sizeof(Entry));
  if (auto ok = check_entries(head); !ok) return tl::unexpected(ok.error());
  return head;
}

// The same, of a file that must have a scope, if there is one.
Result<Head> read_head(std::span<const std::byte> start, std::uint64_t bytes, std::optional<FileScope> scope) {
  auto head = read_head(start, bytes);
  if (!head || !scope || head->scope() == *scope) return head;
  if (*scope == FileScope::one_range) return fail("a data set of every range, not of one range");
  return fail("a data set of one range, not of every range");
}

// The header and the table, at least, or all of a shorter file.
Result<std::vector<std::byte>> read_start(FileParts& file) { return file.read(0, std::min<std::uint64_t>(kMostHeadBytes, file.bytes())); }

Result<std::vector<std::byte>> read_bytes(const std::filesystem::path& path, std::optional<FileScope> scope, const ParallelFor& parallel) {
  FileParts file;
  if (auto opened = file.open(path); !opened) return tl::unexpected(opened.error());
  auto bytes = read_start(file);
  if (!bytes) return bytes;
  if (auto head = read_head(*bytes, file.bytes(), scope); !head) return tl::unexpected(head.error());
  bytes->reserve(std::size_t(file.bytes()));  // takes memory only as it is filled
  while (bytes->size() < file.bytes()) {
    may_stop(parallel);
    auto more = file.read(bytes->size(), std::min<std::uint64_t>(file.bytes() - bytes->size(), kReadBytes));
    if (!more) return more;
    bytes->insert(bytes->end(), more->begin(), more->end());
  }
  return bytes;
}

}  // namespace

namespace {

// The header and the table. checksum: of a stream; 0 of pages, each of which has its own.
struct StreamSize {
  std::uint64_t bytes = 0, checksum = 0;
};
template <class SizeOf>
std::pair<std::vector<std::byte>, std::vector<Entry>> make_head(FileScope scope, const SizeOf& size_of) {
  std::array<StreamSize, kStreamTypes> sizes;
  std::uint32_t types = types_of(scope);
  for (const int type : set_bits(types)) {
    sizes[std::size_t(type)] = size_of(StreamType(type));
    if (sizes[std::size_t(type)].bytes == 0) types &= ~(kSometimes & bit_of(StreamType(type)));
  }
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kIvmVersion;
  header.streams = std::uint32_t(std::popcount(types));
  header.file_bytes = sizeof(Header) + header.streams * sizeof(Entry);
  std::vector<Entry> entries;
  entries.reserve(header.streams);
  for (const int type : set_bits(types)) {
    const StreamSize& size = sizes[std::size_t(type)];
    entries.push_back({std::uint32_t(type), (kNotNeeded >> type & 1) != 0 ? kOptional : 0, header.file_bytes, size.bytes, size.checksum});
    header.file_bytes += size.bytes;
  }
  header.content_hash = hash_of_contents(entries);
  std::vector<std::byte> head(sizeof header);
  append<Entry>(head, entries);
  std::memcpy(head.data(), &header, sizeof header);
  header.checksum = head_checksum(head);
  std::memcpy(head.data(), &header, sizeof header);
  return {std::move(head), std::move(entries)};
}

StreamSize size_of(const std::vector<std::byte>& bytes) { return {bytes.size(), XXH3_64bits(bytes.data(), bytes.size())}; }

}  // namespace

ContainerFrame make_frame(FileScope scope, const Streams& streams, const PagesElsewhere& elsewhere) {
  auto [head, entries] = make_head(scope, [&](StreamType type) {
    if (type == StreamType::pages) return StreamSize{elsewhere.pages_bytes, 0};
    if (type == StreamType::channel_pages) return StreamSize{elsewhere.channel_pages_bytes, elsewhere.channel_pages_checksum};
    return size_of(streams[type]);
  });
  ContainerFrame frame{{{0, std::move(head)}}, 0, 0, entries.back().offset + entries.back().bytes};
  for (const Entry& e : entries) {
    const auto type = StreamType(e.type);
    if (type == StreamType::pages || type == StreamType::channel_pages) {
      (type == StreamType::pages ? frame.pages_at : frame.channel_pages_at) = e.offset;
      frame.pieces.push_back({e.offset + e.bytes, {}});
    } else {
      append<std::byte>(frame.pieces.back().bytes, streams[type]);
    }
  }
  return frame;
}

std::vector<std::byte> make_container(FileScope scope, const Streams& streams) {
  auto [file, entries] = make_head(scope, [&](StreamType type) {
    return type == StreamType::pages ? StreamSize{streams[type].size(), 0} : size_of(streams[type]);
  });
  file.reserve(std::size_t(entries.back().offset + entries.back().bytes));
  for (const Entry& e : entries) append<std::byte>(file, streams[StreamType(e.type)]);
  return file;
}

void Container::claim(std::uint64_t bytes) const {
  if (bytes > room_) throw NoRoom();
  if (room_ != kAnyRoom) room_ -= bytes;
}

// bytes_of: a stream's bytes, by its place and type; all of the pages' bytes that are there.
template <class BytesOf>
Result<Container> Container::open_streams(std::span<const std::byte> start, std::uint64_t file_bytes, FileScope scope, bool tolerates_damage,
                                          const BytesOf& bytes_of) {
  const auto head = read_head(start, file_bytes, scope);
  if (!head) return tl::unexpected(head.error());
  if (head->header.content_hash != hash_of_contents(head->entries)) return fail("the header is damaged (content hash)");
  Container container;
  container.content_hash_ = head->header.content_hash;
  container.file_bytes_ = std::size_t(file_bytes);
  for (const Entry& e : head->entries) {
    const Result<std::span<const std::byte>> bytes = bytes_of(e);
    if (!bytes) return tl::unexpected(bytes.error());
    const bool is_pages = StreamType(e.type) == StreamType::pages;
    const bool is_left = tolerates_damage && StreamType(e.type) == StreamType::channel_pages;
    if (!is_left && e.checksum != (is_pages ? 0 : XXH3_64bits(bytes->data(), bytes->size()))) return fail(name_of(e.type) + " is damaged (checksum)");
    if (e.type < kStreamTypes) container.streams_[e.type] = *bytes;
    if (StreamType(e.type) == StreamType::channels) {
      const std::array<std::uint64_t, 2> both{container.content_hash_, e.checksum};
      container.content_hash_ = XXH3_64bits(both.data(), sizeof both);
    }
  }
  return container;
}

Result<Container> Container::open(std::span<const std::byte> file, FileScope scope, std::uint64_t room, bool tolerates_damage) {
  auto container = open_streams(file, file.size(), scope, tolerates_damage,
                                [file](const Entry& e) -> Result<std::span<const std::byte>> { return file.subspan(e.offset, e.bytes); });
  if (container) container->room_ = room;
  return container;
}

Result<Container> Container::open_ends(const FileEnds& file, FileScope scope) {
  if (file.first.size() > file.file_bytes || file.last.size() > file.file_bytes - file.first.size()) return fail("more bytes than the file has");
  const std::uint64_t last_from = file.file_bytes - file.last.size();
  return open_streams(file.first, file.file_bytes, scope, false, [&](const Entry& e) -> Result<std::span<const std::byte>> {
    if (e.offset >= last_from) return file.last.subspan(std::size_t(e.offset - last_from), e.bytes);
    if (e.offset + e.bytes <= file.first.size()) return file.first.subspan(e.offset, e.bytes);
    if (StreamType(e.type) != StreamType::pages) return fail(name_of(e.type) + " is not there yet");
    return file.first.subspan(std::min<std::size_t>(e.offset, file.first.size()));
  });
}

Result<std::span<const std::byte>> Container::stream(StreamType type, std::size_t bytes) const {
  const auto found = (*this)[type];
  if (found.size() == bytes) return found;
  return fail(name_of(std::uint32_t(type)) + " has " + std::to_string(found.size()) + " bytes, " + std::to_string(bytes) + " expected");
}

Result<std::uint64_t> check_container_start(std::span<const std::byte> start, std::optional<std::uint64_t> file_bytes) {
  std::uint64_t bytes = start.size();
  if (file_bytes) {
    bytes = *file_bytes;
  } else if (start.size() >= sizeof(Header)) {
    std::memcpy(&bytes, start.data() + offsetof(Header, file_bytes), sizeof bytes);
  }
  const auto head = read_head(start, bytes);
  if (!head) return tl::unexpected(head.error());
  return bytes;
}

Result<StreamPlace> place_of(StreamType type, std::span<const std::byte> start, std::uint64_t file_bytes, FileScope scope) {
  const auto head = read_head(start, file_bytes, scope);
  if (!head) return tl::unexpected(head.error());
  for (const Entry& e : head->entries) {
    if (e.type == std::uint32_t(type)) return StreamPlace{e.offset, e.bytes};
  }
  return StreamPlace{};
}

bool begins_as_ivm(const std::filesystem::path& path) {
  char start[sizeof kMagic] = {};
  std::ifstream(path, std::ios::binary).read(start, sizeof start);
  return std::memcmp(start, kMagic, sizeof kMagic) == 0;
}

Result<FileScope> scope_of(std::span<const std::byte> start, std::uint64_t file_bytes) {
  return read_head(start, file_bytes).map([](const Head& head) { return head.scope(); });
}

std::optional<FileScope> scope_of(std::span<const std::byte> file) {
  const auto head = read_head(file, file.size());
  return head ? std::optional(head->scope()) : std::nullopt;
}

std::optional<FileScope> scope_of(const std::filesystem::path& path) {
  FileParts file;
  if (!file.open(path)) return {};
  const auto start = read_start(file);
  if (!start) return {};
  const auto head = read_head(*start, file.bytes());
  if (!head) return {};
  return head->scope();
}

Result<std::vector<std::byte>> read_container(const std::filesystem::path& path, std::optional<FileScope> scope, const ParallelFor& parallel) {
  auto bytes = read_bytes(path, scope, parallel);
  if (!bytes) return fail(path.string() + ": " + bytes.error().message);
  return bytes;
}

Result<void> FileParts::open(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) return fail("is a folder, not an interval volume file (.ivm)");
  in_.open(path, std::ios::binary | std::ios::ate);
  if (!in_) return fail(std::strerror(errno));
  const std::streamoff size = in_.tellg();
  if (size < 0) return fail("not a file that can be read at once");
  bytes_ = std::uint64_t(size);
  return {};
}

Result<std::vector<std::byte>> FileParts::read(std::uint64_t first, std::uint64_t bytes) {
  std::vector<std::byte> part(std::size_t(bytes), std::byte(0));
  in_.seekg(std::streamoff(first));
  in_.read(reinterpret_cast<char*>(part.data()), std::streamsize(part.size()));
  if (!in_) return fail("could not be read to its end");
  return part;
}

Result<void> save_container(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto ok = file->write(bytes); !ok) return ok;
  return file->commit();
}

}  // namespace intervale

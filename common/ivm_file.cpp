#include "common/ivm_file.h"

#include <xxhash.h>
#include <zstd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "common/atomic_file.h"
#include "common/planes.h"

namespace intervale {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are stored as they lie in memory: little endian");

constexpr char kMagic[8] = {'\x89', 'I', 'V', 'M', '\r', '\n', '\x1a', '\n'};
constexpr int kCompression = 9;               // zstd; 19 gains a few percent and takes ten times as long
constexpr unsigned kSlotBytes = 7;            // of an occupancy word: 56 slots
constexpr std::uint64_t kMaxRatio = 1 << 15;  // zstd's own: a block of 128 KiB in 4 bytes

enum Section : std::uint32_t { kMeta, kBase, kErrors, kBricks, kMasks, kOccupancy, kShapes, kLevels, kFirst, kOther, kSections };
constexpr const char* kSectionNames[kSections] = {"meta", "base", "errors", "bricks", "masks", "occupancy", "shapes", "levels", "first", "other"};

struct Header {
  char magic[8];
  std::uint32_t version, sections;
  std::uint64_t file_bytes;
  std::uint64_t checksum;  // XXH3 of header and section table, this field 0
};
struct Entry {
  std::uint32_t section, reserved;
  std::uint64_t offset, stored_bytes, raw_bytes;
  std::uint64_t checksum;  // XXH3 of the stored bytes
};
struct Meta {
  std::int32_t dims[3];
  std::uint32_t refine;
  double spacing[3], origin[3], range[2], max_error;
  std::uint64_t updates, coefficients, supercubes, bricks, full_vertices, full_tets, content_hash;
};
static_assert(sizeof(Header) == 32 && sizeof(Entry) == 40 && sizeof(Meta) == 144, "no padding");

constexpr std::size_t kTableBytes = sizeof(Header) + kSections * sizeof(Entry);

std::vector<std::byte> compress(std::span<const std::uint8_t> raw) {
  std::vector<std::byte> out(ZSTD_compressBound(raw.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), kCompression));
  return out;
}

template <class T>
std::vector<std::uint8_t> bytes_of(std::span<const T> values) {
  const auto* const first = reinterpret_cast<const std::uint8_t*>(values.data());
  return {first, first + values.size_bytes()};
}

Meta meta_of(const IntervalVolume& volume) {
  const Description& d = volume.description();
  Meta meta{};
  for (int i = 0; i < 3; ++i) {
    meta.dims[i] = d.grid.dims[i];
    meta.spacing[i] = d.grid.spacing[i];
    meta.origin[i] = d.grid.origin[i];
  }
  meta.refine = std::uint32_t(d.refine);
  meta.range[0] = d.range.alpha;
  meta.range[1] = d.range.beta;
  meta.max_error = d.max_error;
  meta.updates = d.updates;
  meta.coefficients = d.coefficients;
  meta.supercubes = volume.set().supercubes();
  meta.bricks = volume.set().bricks().size();
  meta.full_vertices = d.full.vertices;
  meta.full_tets = d.full.tets;
  meta.content_hash = d.content_hash;
  return meta;
}

// What a section holds, before compression.
std::vector<std::uint8_t> section_bytes(const IntervalVolume& volume, Section section) {
  std::vector<std::uint8_t> raw;
  const auto bricks = volume.set().bricks();
  const auto codes = volume.codes();
  switch (section) {
    case kMeta: {
      const Meta meta = meta_of(volume);
      return bytes_of(std::span<const Meta>(&meta, 1));
    }
    case kBase:
      return volume.description().base;
    case kErrors:
      return bytes_of(volume.error_levels());
    case kBricks: {
      std::uint64_t previous = 0;
      for (const SupercubeSet::Brick& b : bricks) append_varint(raw, (b.key >> 6) - std::exchange(previous, b.key >> 6));
      return raw;
    }
    case kMasks: {
      std::vector<std::uint64_t> masks;
      for (const SupercubeSet::Brick& b : bricks) masks.push_back(b.mask);
      return split_bytes(masks, 8);
    }
    case kOccupancy:
      return split_bytes(volume.set().occupancy(), kSlotBytes);
    case kShapes:
      raw.reserve(codes.size());
      for (const UpdateCode c : codes) raw.push_back(std::uint8_t(c.bits() & 127));
      return raw;
    case kLevels:  // as split_bytes would
      raw.reserve(2 * codes.size());
      for (const unsigned shift : {0u, 8u}) {
        for (const UpdateCode c : codes) raw.push_back(std::uint8_t(c.error_level() >> shift));
      }
      return raw;
    case kFirst:
    case kOther:
    case kSections:
      break;
  }
  const std::uint8_t* differences = volume.differences().data();
  for (const UpdateCode c : codes) {
    const unsigned begin = section == kFirst ? 0 : c.first_cuts(), end = section == kFirst ? c.first_cuts() : c.coefficients();
    raw.insert(raw.end(), differences + begin, differences + end);
    differences += c.coefficients();
  }
  return raw;
}

std::uint64_t table_checksum(std::span<const std::byte> table) {
  std::vector<std::byte> copy(table.begin(), table.end());
  std::memset(copy.data() + offsetof(Header, checksum), 0, 8);
  return XXH3_64bits(copy.data(), copy.size());
}

// The raw bytes of a section, of which there must be `expected`.
Result<std::vector<std::uint8_t>> read(std::span<const std::byte> file, const Entry& e, std::uint64_t expected) {
  const std::string name = kSectionNames[e.section];
  if (e.raw_bytes != expected)
    return fail("section '" + name + "' has " + std::to_string(e.raw_bytes) + " bytes, " + std::to_string(expected) + " expected");
  const auto stored = file.subspan(e.offset, e.stored_bytes);
  std::vector<std::uint8_t> raw(e.raw_bytes);
  const std::size_t got = ZSTD_decompress(raw.data(), raw.size(), stored.data(), stored.size());
  if (ZSTD_isError(got) || got != raw.size()) return fail("section '" + name + "' does not decompress");
  return raw;
}

// The supercubes' keys from bricks and masks; ascending.
Result<std::vector<SupercubeKey>> supercube_keys(std::span<const std::uint8_t> steps, std::span<const std::uint64_t> masks, std::uint64_t count) {
  std::vector<SupercubeKey> keys;
  keys.reserve(count);
  std::uint64_t brick = 0;
  for (std::size_t b = 0; b < masks.size(); ++b) {
    const auto step = take_varint(steps);
    if (!step || (b > 0 && *step == 0) || *step >= (std::uint64_t(1) << 56) - brick || masks[b] == 0) return fail("bricks do not ascend");
    brick += *step;
    const SupercubeKey first = brick << 6;
    if (scale_of_key(first) < 0 || scale_of_key(first) >= kMaxLevels) return fail("a brick is of no scale");
    for (std::uint64_t mask = masks[b]; mask != 0; mask &= mask - 1) {
      if (keys.size() == count) return fail("more supercubes than there should be");
      keys.push_back(first + unsigned(std::countr_zero(mask)));
    }
  }
  if (keys.size() != count || !steps.empty()) return fail("bricks and supercubes do not fit");
  return keys;
}

}  // namespace

std::vector<std::byte> encode_ivm(const IntervalVolume& volume) {
  std::vector<std::byte> file(kTableBytes);
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kIvmVersion;
  header.sections = kSections;
  // One section at a time: together they would be as large as the volume that they come from.
  for (int s = 0; s < int(kSections); ++s) {
    const std::vector<std::uint8_t> raw = section_bytes(volume, Section(s));
    const std::vector<std::byte> stored = compress(raw);
    const Entry e{std::uint32_t(s), 0, file.size(), stored.size(), raw.size(), XXH3_64bits(stored.data(), stored.size())};
    std::memcpy(file.data() + sizeof(Header) + s * sizeof(Entry), &e, sizeof e);
    file.insert(file.end(), stored.begin(), stored.end());
  }
  header.file_bytes = file.size();
  std::memcpy(file.data(), &header, sizeof header);
  header.checksum = table_checksum(std::span(file).first(kTableBytes));
  std::memcpy(file.data(), &header, sizeof header);
  return file;
}

Result<IntervalVolume> decode_ivm(std::span<const std::byte> file, std::string name) {
  Header header;
  if (file.size() < sizeof kMagic || std::memcmp(file.data(), kMagic, sizeof kMagic) != 0) return fail("not an interval volume file (.ivm)");
  if (file.size() < kTableBytes) return fail("the file ends within its header");
  std::memcpy(&header, file.data(), sizeof header);
  if (header.version != kIvmVersion) {
    return fail("version " + std::to_string(header.version) + " of the format, this program reads version " + std::to_string(kIvmVersion) +
                "; build the file again");
  }
  if (header.checksum != table_checksum(file.first(kTableBytes))) return fail("the header is damaged (checksum)");
  if (header.sections != kSections)
    return fail("the header names " + std::to_string(header.sections) + " sections, not " + std::to_string(kSections));
  if (header.file_bytes != file.size()) {
    return fail("the file has " + std::to_string(file.size()) + " bytes, " + std::to_string(header.file_bytes) +
                " expected: it was cut short or added to");
  }
  Entry entries[kSections];
  std::uint64_t next = kTableBytes;
  for (int s = 0; s < int(kSections); ++s) {
    Entry& e = entries[s];
    std::memcpy(&e, file.data() + sizeof(Header) + s * sizeof(Entry), sizeof e);
    if (e.section != std::uint32_t(s) || e.reserved != 0 || e.offset != next || e.stored_bytes > file.size() - next)
      return fail("the section table is damaged");
    next += e.stored_bytes;
    if (XXH3_64bits(file.data() + e.offset, e.stored_bytes) != e.checksum)
      return fail(std::string("section '") + kSectionNames[s] + "' is damaged (checksum)");
    if (e.raw_bytes / kMaxRatio > e.stored_bytes + 4)
      return fail(std::string("section '") + kSectionNames[s] + "' claims more bytes than it can hold");
  }
  if (next != file.size()) return fail("bytes after the last section");

  const auto meta_bytes = read(file, entries[kMeta], sizeof(Meta));
  if (!meta_bytes) return tl::unexpected(meta_bytes.error());
  Meta meta;
  std::memcpy(&meta, meta_bytes->data(), sizeof meta);
  IntervalVolume::Parts parts;
  Description& d = parts.description;
  d.name = std::move(name);
  for (int i = 0; i < 3; ++i) {
    d.grid.dims[i] = meta.dims[i];
    d.grid.spacing[i] = meta.spacing[i];
    d.grid.origin[i] = meta.origin[i];
  }
  if (meta.refine > 1) return fail("the way of refining is none");
  d.refine = Refine(meta.refine);
  d.range = {meta.range[0], meta.range[1]};
  d.max_error = meta.max_error;
  d.full = {meta.full_vertices, meta.full_tets};
  // Counts before contents: each must be what its section holds.
  if (entries[kErrors].raw_bytes > kErrorLevels * sizeof(float) || entries[kErrors].raw_bytes % sizeof(float) != 0)
    return fail("error levels out of range");
  if (meta.bricks > meta.supercubes || meta.supercubes > meta.updates || meta.updates > meta.supercubes * kSlots ||
      meta.coefficients > meta.updates * kMaxCuts || meta.updates > std::numeric_limits<UpdateIndex>::max()) {
    return fail("the counts do not fit");
  }
  Result<std::vector<std::uint8_t>> raw[kSections];
  const std::uint64_t expected[kSections] = {
      sizeof(Meta), entries[kBase].raw_bytes, entries[kErrors].raw_bytes, entries[kBricks].raw_bytes, meta.bricks * 8, meta.supercubes * kSlotBytes,
      meta.updates, meta.updates * 2,         entries[kFirst].raw_bytes,  entries[kOther].raw_bytes};
  if (entries[kFirst].raw_bytes + entries[kOther].raw_bytes != meta.coefficients) return fail("updates and coefficients do not fit");
  for (int s = kBase; s < int(kSections); ++s) {
    raw[s] = read(file, entries[s], expected[s]);
    if (!raw[s]) return tl::unexpected(raw[s].error());
  }
  const auto keys = supercube_keys(*raw[kBricks], join_bytes(*raw[kMasks], 8), meta.supercubes);
  if (!keys) return tl::unexpected(keys.error());
  auto occupancy = join_bytes(*raw[kOccupancy], kSlotBytes);
  std::uint64_t slots = 0;
  for (std::uint64_t word : occupancy) {
    if (word == 0) return fail("a supercube without a diamond");
    slots += std::popcount(word);
  }
  if (slots != meta.updates) return fail("updates and supercubes do not fit");
  d.base = std::move(*raw[kBase]);
  parts.error_levels.resize(raw[kErrors]->size() / sizeof(float));
  if (!parts.error_levels.empty()) std::memcpy(parts.error_levels.data(), raw[kErrors]->data(), raw[kErrors]->size());
  parts.set = SupercubeSet(*keys, std::move(occupancy));
  const auto levels = join_bytes(*raw[kLevels], 2);
  std::span<const std::uint8_t> first(*raw[kFirst]), other(*raw[kOther]);
  parts.codes.reserve(meta.updates);
  parts.differences.reserve(meta.coefficients);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const unsigned shape = (*raw[kShapes])[i];
    if (shape > 127 || levels[i] >= kErrorLevels) return fail("an update's code is none");
    const UpdateCode code(std::uint16_t(shape | unsigned(levels[i]) << 7));
    const std::size_t firsts = code.first_cuts(), others = code.coefficients() - firsts;
    if (firsts > first.size() || others > other.size()) return fail("updates and coefficients do not fit");
    parts.codes.push_back(code);
    parts.differences.insert(parts.differences.end(), first.begin(), first.begin() + std::ptrdiff_t(firsts));
    parts.differences.insert(parts.differences.end(), other.begin(), other.begin() + std::ptrdiff_t(others));
    first = first.subspan(firsts);
    other = other.subspan(others);
  }
  auto volume = IntervalVolume::assemble(std::move(parts));
  if (volume && volume->description().content_hash != meta.content_hash) return fail("the contents are not those that were written (content hash)");
  return volume;
}

Result<void> save_ivm(const std::filesystem::path& path, const IntervalVolume& volume) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto ok = file->write(encode_ivm(volume)); !ok) return ok;
  return file->commit();
}

Result<std::shared_ptr<const IntervalVolume>> load_ivm(const std::filesystem::path& path) {
  const auto because = [&path](const std::string& why) { return fail(path.string() + ": " + why); };
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) return because("is a folder, not an interval volume file (.ivm)");
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return because(std::strerror(errno));
  const std::streamoff size = in.tellg();
  if (size < 0) return because("not a file that can be read at once");
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!in) return because("could not be read to its end");
  auto volume = decode_ivm(bytes, path.stem().string());
  if (!volume) return because(volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale

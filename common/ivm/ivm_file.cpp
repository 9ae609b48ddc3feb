#include "common/ivm/ivm_file.h"

#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "common/codec/byte_planes.h"
#include "common/ivm/ivm_coding.h"
#include "common/util/atomic_file.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are stored as they lie in memory: little endian");

constexpr char kMagic[8] = {'\x89', 'I', 'V', 'M', '\r', '\n', '\x1a', '\n'};
constexpr int kCompression = 9;               // zstd; 19 gains a few percent and takes ten times as long
constexpr unsigned kSlotBytes = 7;            // of an occupancy word: 56 slots
constexpr std::uint64_t kMaxRatio = 1 << 15;  // zstd's own: a block of 128 KiB in 4 bytes; a range coder's is less

enum Section : std::uint32_t { kMeta, kRootPatch, kErrors, kBricks, kMasks, kOccupancy, kErrorToDistance, kLevels, kShapes, kResiduals, kSections };
constexpr const char* kSectionNames[kSections] = {"meta",      "root_patch",        "errors", "bricks", "masks",
                                                  "occupancy", "error_to_distance", "levels", "shapes", "residuals"};

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

// A section as stored in the file, and its size when decompressed.
struct Stored {
  std::vector<std::uint8_t> bytes;
  std::uint64_t raw_bytes = 0;
};

Stored compressed(const std::vector<std::uint8_t>& raw) {
  Stored s{std::vector<std::uint8_t>(ZSTD_compressBound(raw.size())), raw.size()};
  s.bytes.resize(ZSTD_compress(s.bytes.data(), s.bytes.size(), raw.data(), raw.size(), kCompression));
  return s;
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

Stored stored(const IntervalVolume& volume, Section section) {
  std::vector<std::uint8_t> raw;
  const SupercubeSet& set = volume.set();
  const auto codes = volume.codes();
  switch (section) {
    case kMeta: {
      const Meta meta = meta_of(volume);
      return compressed(bytes_of(std::span<const Meta>(&meta, 1)));
    }
    case kRootPatch:
      return compressed(volume.description().root_patch);
    case kErrors:
      return compressed(bytes_of(volume.error_steps()));
    case kBricks: {
      std::uint64_t previous = 0;
      for (const SupercubeSet::Brick& b : set.bricks()) append_varint(raw, (b.key >> 6) - std::exchange(previous, b.key >> 6));
      return compressed(raw);
    }
    case kMasks: {
      std::vector<std::uint64_t> masks;
      for (const SupercubeSet::Brick& b : set.bricks()) masks.push_back(b.mask);
      return compressed(split_bytes(masks, 8));
    }
    case kOccupancy:
      return compressed(split_bytes(set.occupancy(), kSlotBytes));
    case kErrorToDistance:
      return compressed(bytes_of(volume.error_to_distance()));
    case kLevels:
    case kShapes:
    case kResiduals:
    case kSections:
      break;
  }
  RangeEncoder coder;
  if (section == kLevels) {
    std::vector<std::uint16_t> levels;
    levels.reserve(codes.size());
    for (const UpdateCode c : codes) levels.push_back(std::uint16_t(c.error_step()));
    code_error_steps(coder, set, levels);
    return {coder.finish(), 2 * levels.size()};
  }
  for (const UpdateCode c : codes) raw.push_back(c.shape());
  if (section == kShapes) {
    code_shapes(coder, set, raw);
    return {coder.finish(), raw.size()};
  }
  std::vector<std::uint8_t> residuals(volume.residuals().begin(), volume.residuals().end());
  code_residuals(coder, set, raw, residuals);
  return {coder.finish(), residuals.size()};
}

std::uint64_t table_checksum(std::span<const std::byte> table) {
  std::vector<std::byte> copy(table.begin(), table.end());
  std::memset(copy.data() + offsetof(Header, checksum), 0, 8);
  return XXH3_64bits(copy.data(), copy.size());
}

tl::unexpected<Error> does_not_decompress(const Entry& e) {
  return fail(std::string("section '") + kSectionNames[e.section] + "' does not decompress");
}

// The raw bytes of a section that zstd compressed.
Result<std::vector<std::uint8_t>> read(std::span<const std::uint8_t> file, const Entry& e) {
  const auto bytes = file.subspan(e.offset, e.stored_bytes);
  std::vector<std::uint8_t> raw(e.raw_bytes);
  const std::size_t got = ZSTD_decompress(raw.data(), raw.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(got) || got != raw.size()) return does_not_decompress(e);
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
    if (scale_of_key(first) < 0 || scale_of_key(first) >= kMaxLevels) return fail("a brick's scale is out of range");
    for (const int bit : set_bits(masks[b])) {
      if (keys.size() == count) return fail("more supercubes than the header says");
      keys.push_back(first + unsigned(bit));
      const Vertex p = position_of_key(keys.back());
      if (std::max({p.x, p.y, p.z}) > (1 << kMaxLevels) >> (scale_of_key(first) + 2)) return fail("a supercube outside the largest grid");
    }
  }
  if (keys.size() != count || !steps.empty()) return fail("the numbers of supercubes in bricks and in the header differ");
  return keys;
}

// Checks the start of a file of so many bytes: its header and section table, or the whole file if it is shorter.
Result<void> check_start(std::span<const std::byte> start, std::uint64_t bytes) {
  Header header;
  if (start.size() < sizeof kMagic || std::memcmp(start.data(), kMagic, sizeof kMagic) != 0) return fail("not an interval volume file (.ivm)");
  if (start.size() < kTableBytes) return fail("the file ends within its header");
  std::memcpy(&header, start.data(), sizeof header);
  if (header.version == kIvmVersion + 1) return fail("a data set of every range, which cannot be used here yet: build it with --range");
  if (header.version != kIvmVersion) {
    return fail("version " + std::to_string(header.version) + " of the format, this program reads version " + std::to_string(kIvmVersion) +
                (header.version > kIvmVersion ? "; use a newer program" : "; build the file again"));
  }
  if (header.checksum != table_checksum(start.first(kTableBytes))) return fail("the header is damaged (checksum)");
  if (header.sections != kSections)
    return fail("the header names " + std::to_string(header.sections) + " sections, not " + std::to_string(kSections));
  if (header.file_bytes != bytes) {
    return fail("the file has " + std::to_string(bytes) + " bytes, " + std::to_string(header.file_bytes) + " expected: it was cut short or added to");
  }
  return {};
}

}  // namespace

std::vector<std::byte> encode_ivm(const IntervalVolume& volume, const ParallelFor& parallel) {
  std::vector<std::byte> file(kTableBytes);
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kIvmVersion;
  header.sections = kSections;
  // Only compressed sections are kept: together, the raw ones would be as large as the volume.
  std::array<Stored, kSections> sections;
  parallel(kSections, [&](std::size_t s) { sections[s] = stored(volume, Section(s)); });
  for (std::size_t s = 0; s < kSections; ++s) {
    const auto bytes = std::as_bytes(std::span(sections[s].bytes));
    const Entry e{std::uint32_t(s), 0, file.size(), bytes.size(), sections[s].raw_bytes, XXH3_64bits(bytes.data(), bytes.size())};
    std::memcpy(file.data() + sizeof(Header) + s * sizeof(Entry), &e, sizeof e);
    file.insert(file.end(), bytes.begin(), bytes.end());
    sections[s] = Stored();
  }
  header.file_bytes = file.size();
  std::memcpy(file.data(), &header, sizeof header);
  header.checksum = table_checksum(std::span(file).first(kTableBytes));
  std::memcpy(file.data(), &header, sizeof header);
  return file;
}

Result<IntervalVolume> decode_ivm(std::span<const std::byte> file, std::string name) {
  if (auto checked = check_start(file.first(std::min(file.size(), kTableBytes)), file.size()); !checked) return tl::unexpected(checked.error());
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

  const auto is_size = [&entries](Section section, std::uint64_t expected) -> Result<void> {
    const std::uint64_t bytes = entries[section].raw_bytes;
    if (bytes == expected) return {};
    return fail(std::string("section '") + kSectionNames[section] + "' has " + std::to_string(bytes) + " bytes, " + std::to_string(expected) +
                " expected");
  };
  const std::span all(reinterpret_cast<const std::uint8_t*>(file.data()), file.size());
  if (auto ok = is_size(kMeta, sizeof(Meta)); !ok) return tl::unexpected(ok.error());
  const auto meta_bytes = read(all, entries[kMeta]);
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
  if (meta.refine > 1) return fail("the refinement mode is unknown");
  d.refine = Refine(meta.refine);
  d.range = {meta.range[0], meta.range[1]};
  d.max_error = meta.max_error;
  d.full = {meta.full_vertices, meta.full_tets};
  // Counts before contents: each must match the size of its section.
  if (entries[kErrors].raw_bytes > kMaxErrorSteps * sizeof(float) || entries[kErrors].raw_bytes % sizeof(float) != 0)
    return fail("the number of errors is out of range");
  if (meta.bricks > meta.supercubes || meta.supercubes > meta.updates || meta.updates > meta.supercubes * kSlots ||
      meta.coefficients > meta.updates * kMaxCuts || meta.updates > std::numeric_limits<std::uint32_t>::max()) {
    return fail("the counts contradict each other");
  }
  const std::pair<Section, std::uint64_t> expected[] = {{kMasks, meta.bricks * 8},
                                                        {kOccupancy, meta.supercubes * kSlotBytes},
                                                        {kErrorToDistance, meta.supercubes},
                                                        {kLevels, 2 * meta.updates},
                                                        {kShapes, meta.updates},
                                                        {kResiduals, meta.coefficients}};
  for (const auto& [section, bytes] : expected) {
    if (auto ok = is_size(section, bytes); !ok) return tl::unexpected(ok.error());
  }
  Result<std::vector<std::uint8_t>> raw[kLevels];
  for (int s = kRootPatch; s < int(kLevels); ++s) {
    raw[s] = read(all, entries[s]);
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
  if (slots != meta.updates) return fail("the numbers of updates and occupied slots differ");
  d.root_patch = std::move(*raw[kRootPatch]);
  parts.error_steps.resize(raw[kErrors]->size() / sizeof(float));
  if (!parts.error_steps.empty()) std::memcpy(parts.error_steps.data(), raw[kErrors]->data(), raw[kErrors]->size());
  for (const std::uint8_t code : *raw[kErrorToDistance]) parts.error_to_distance.emplace_back(code);
  parts.set = SupercubeSet(*keys, std::move(occupancy));
  const auto coded = [&](Section section) { return all.subspan(entries[section].offset, entries[section].stored_bytes); };
  std::vector<std::uint16_t> levels(meta.updates);
  RangeDecoder level_coder(coded(kLevels));
  code_error_steps(level_coder, parts.set, levels);
  if (!level_coder.is_spent()) return does_not_decompress(entries[kLevels]);
  std::vector<std::uint8_t> shapes(meta.updates);
  RangeDecoder shape_coder(coded(kShapes));
  code_shapes(shape_coder, parts.set, shapes);
  if (!shape_coder.is_spent()) return does_not_decompress(entries[kShapes]);
  parts.codes.reserve(meta.updates);
  std::uint64_t coefficients = 0;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const UpdateCode code(std::uint16_t(shapes[i] | levels[i] << 7));
    if (code.side_residual() > 2 || code.coefficients() > kMaxCuts) return fail("an update's code is invalid");
    parts.codes.push_back(code);
    coefficients += code.coefficients();
  }
  if (coefficients != meta.coefficients) return fail("the codes require another number of coefficients");
  parts.residuals.resize(meta.coefficients);
  RangeDecoder residual_coder(coded(kResiduals));
  code_residuals(residual_coder, parts.set, shapes, parts.residuals);
  if (!residual_coder.is_spent()) return does_not_decompress(entries[kResiduals]);
  auto volume = IntervalVolume::assemble(std::move(parts));
  if (volume && volume->description().content_hash != meta.content_hash) return fail("the contents differ from what was written (content hash)");
  return volume;
}

Result<void> save_ivm(const std::filesystem::path& path, const IntervalVolume& volume, const ParallelFor& parallel) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto ok = file->write(encode_ivm(volume, parallel)); !ok) return ok;
  return file->commit();
}

Result<std::vector<std::byte>> read_ivm(const std::filesystem::path& path) {
  const auto because = [&path](const std::string& why) { return fail(path.string() + ": " + why); };
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) return because("is a folder, not an interval volume file (.ivm)");
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return because(std::strerror(errno));
  const std::streamoff size = in.tellg();
  if (size < 0) return because("not a file that can be read at once");
  std::vector<std::byte> bytes(std::min(kTableBytes, static_cast<std::size_t>(size)));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  const auto read = bytes.size();
  if (in) {
    if (auto checked = check_start(bytes, std::uint64_t(size)); !checked) return because(checked.error().message);
    bytes.resize(static_cast<std::size_t>(size));
    in.read(reinterpret_cast<char*>(bytes.data() + read), std::streamsize(bytes.size() - read));
  }
  if (!in) return because("could not be read to its end");
  return bytes;
}

Result<std::shared_ptr<const IntervalVolume>> load_ivm(const std::filesystem::path& path) {
  const auto bytes = read_ivm(path);
  if (!bytes) return tl::unexpected(bytes.error());
  auto volume = decode_ivm(*bytes, path.stem().string());
  if (!volume) return fail(path.string() + ": " + volume.error().message);
  return std::make_shared<const IntervalVolume>(std::move(*volume));
}

}  // namespace intervale

#include <algorithm>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>

#include "server/volume/gzip_decoder.h"
#include "server/volume/nrrd.h"
#include "server/volume/nrrd_header.h"

namespace intervale {
namespace {

constexpr std::uint64_t kGreatestDeflateRatio = 1032;  // zlib's technical notes, "Maximum Compression Factor"
constexpr std::size_t kChunk = 1 << 16;

// The header that names the data file is untrusted: it must not reach other folders.
Result<std::filesystem::path> detached_path(const std::filesystem::path& header, const std::string& named) {
  const auto where = in_quotes(header) + ": data file '" + named + "'";
  if (named.empty()) return fail(in_quotes(header) + ": the 'data file' line names none");
  if (named.starts_with("LIST") || named.starts_with("SKIPLIST") || named.find('%') != named.npos)
    return fail(where + ": data in several files is not read; join them first, e.g. unu save -f nrrd");
  const std::filesystem::path relative(named);
  const auto escapes = [&] { return fail(where + " lies outside the header's folder; move it beside the header and name it alone"); };
  if (relative.is_absolute() || std::find(relative.begin(), relative.end(), "..") != relative.end()) return escapes();
  std::error_code error;
  const auto folder = std::filesystem::canonical(header.has_parent_path() ? header.parent_path() : ".", error);
  const auto target = error ? folder : std::filesystem::canonical(folder / relative, error);  // follows links, as opening would
  if (error) return fail(where + ": " + error.message());
  if (std::mismatch(folder.begin(), folder.end(), target.begin(), target.end()).first != folder.end()) return escapes();
  return target;
}

Result<std::uint64_t> skip_lines(const InputFile& file, std::uint64_t offset, std::uint32_t lines) {
  std::array<std::byte, kChunk> chunk;
  while (lines > 0) {
    const auto got = file.read_some(offset, chunk);
    if (!got) return tl::unexpected<Error>(got.error());
    if (*got == 0) return fail(in_quotes(file.path()) + " ends while lines before the data are skipped; check 'line skip'");
    std::size_t used = 0;
    for (; used < *got && lines > 0; ++used) lines -= chunk[used] == std::byte{'\n'};
    offset += used;
  }
  return offset;
}

std::string too_short(const InputFile& file, std::uint64_t expected, const std::string& got) {
  return in_quotes(file.path()) + ": the header promises " + std::to_string(expected) + " bytes of samples, but " + got + "; is the file cut short?";
}

Result<void> read_raw_data(const InputFile& file, std::uint64_t offset, const NrrdHeader& header, std::vector<std::byte>& out) {
  const std::uint64_t left = file.size() - offset, needed = header.data_bytes();
  // byte_skip of -1 - n: n bytes follow the data. Written so that the least std::int64_t does not overflow.
  const std::uint64_t beside =
      header.byte_skip >= 0 ? static_cast<std::uint64_t>(header.byte_skip) : static_cast<std::uint64_t>(-(header.byte_skip + 1));
  if (left < needed || left - needed < beside)
    return fail(
        too_short(file, needed, std::to_string(left) + " are there" + (beside > 0 ? ", " + std::to_string(beside) + " of them to skip" : "")));
  out.resize(needed);
  return file.read(header.byte_skip >= 0 ? offset + beside : file.size() - beside - needed, out);
}

Result<void> read_gzip_data(const InputFile& file, std::uint64_t offset, const NrrdHeader& header, std::vector<std::byte>& out) {
  const std::uint64_t needed = header.data_bytes(), packed = file.size() - offset;
  if (needed / kGreatestDeflateRatio > packed) return fail(too_short(file, needed, std::to_string(packed) + " bytes of gzip cannot hold as many"));
  std::uint64_t skip = static_cast<std::uint64_t>(std::max<std::int64_t>(header.byte_skip, 0));
  if (header.byte_skip < 0) {
    // Counted from the end, which only decoding finds. It decodes twice rather than keep the bytes before the samples
    // in memory.
    const auto length = gzip_length(file, offset);
    if (!length) return tl::unexpected<Error>(length.error());
    const auto after = static_cast<std::uint64_t>(-(header.byte_skip + 1));
    if (*length < needed || *length - needed < after) return fail(too_short(file, needed, std::to_string(*length) + " are there"));
    skip = *length - needed - after;
  }
  out.resize(needed);
  const auto got = gzip_decode(file, offset, skip, out);
  if (!got) return tl::unexpected<Error>(got.error());
  if (*got < needed) return fail(too_short(file, needed, std::to_string(*got) + " are there"));
  return {};
}

bool is_separator(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == ','; }

// Parses one number of a text into the bytes of a sample. Integers that do not fit their type fail instead of wrapping.
template <class T>
bool parse_sample(std::string_view text, std::byte* sample) {
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return false;
  std::memcpy(sample, &value, sizeof value);
  return true;
}

Result<void> read_text_data(const InputFile& file, std::uint64_t offset, const NrrdHeader& header, std::vector<std::byte>& out) {
  const std::uint64_t samples = header.grid.sample_count() * header.components, left = file.size() - offset;
  if (header.byte_skip < 0) return fail(in_quotes(file.path()) + ": a negative 'byte skip' makes no sense with text");
  const auto skipped = static_cast<std::uint64_t>(header.byte_skip);
  if (left < skipped || (left - skipped) / 2 + 1 < samples)
    return fail(too_short(file, header.data_bytes(), std::to_string(left) + " characters of text cannot hold as many"));
  out.resize(header.data_bytes());
  std::string text(left - skipped, '\0');
  if (auto read = file.read(offset + skipped, std::as_writable_bytes(std::span(text))); !read) return read;
  Volume shape{{}, header.grid, header.type, {}};
  return visit_samples(shape, [&]<class T>(std::span<const T>) -> Result<void> {
    std::size_t position = 0;
    for (std::uint64_t i = 0; i < samples; ++i) {
      while (position < text.size() && is_separator(text[position])) ++position;
      std::size_t end = position;
      while (end < text.size() && !is_separator(text[end])) ++end;
      if (!parse_sample<T>(std::string_view(text).substr(position, end - position), out.data() + i * sizeof(T)))
        return fail(in_quotes(file.path()) + ": sample " + std::to_string(i + 1) + " of " + std::to_string(samples) +
                    (position == end ? " is missing" : std::string(" is no ") + name_of(header.type)));
      position = end;
    }
    return {};
  });
}

}  // namespace

Result<Volume> read_nrrd(const std::filesystem::path& path) {
  const auto header_file = InputFile::open(path);
  if (!header_file) return tl::unexpected<Error>(header_file.error());
  const auto header = read_nrrd_header(*header_file);
  if (!header) return tl::unexpected<Error>(header.error());

  Volume volume{path.stem().string(), header->grid, header->type, {}, header->labels, header->components};
  const auto data = !header->data_file ? InputFile::open(path) : detached_path(path, *header->data_file).and_then(InputFile::open);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto start = skip_lines(*data, header->data_file ? 0 : header->data_offset, header->line_skip);
  if (!start) return tl::unexpected<Error>(start.error());
  if (*start > data->size()) return fail(in_quotes(data->path()) + " has changed while it was read");
  using Encoding = NrrdHeader::Encoding;
  const auto read_data = header->encoding == Encoding::raw ? read_raw_data : header->encoding == Encoding::gzip ? read_gzip_data : read_text_data;
  if (auto read = read_data(*data, *start, *header, volume.bytes); !read) return tl::unexpected<Error>(read.error());
  if (header->big_endian) swap_bytes(volume.bytes, volume.type);
  return volume;
}

}  // namespace intervale

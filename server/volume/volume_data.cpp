// The samples of a volume whose header has been read, whatever format it is of.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/patch/visit_samples.h"
#include "server/volume/decoder.h"
#include "server/volume/volume_header.h"

namespace intervale {
namespace {

constexpr std::uint64_t kGreatestDeflateRatio = 1032;  // zlib's technical notes, "Maximum Compression Factor"
constexpr std::size_t kLineChunk = 1 << 16;

// The header that names the data file is untrusted: it must not reach other folders.
Result<std::filesystem::path> detached_path(const std::filesystem::path& header, const std::string& named) {
  const auto where = in_quotes(header) + ": data file '" + named + "'";
  if (named.empty()) return fail(in_quotes(header) + ": the line of the data file names none");
  if (named.starts_with("LIST") || named.starts_with("SKIPLIST") || named.find('%') != named.npos)
    return fail(where + ": data in several files is not read; join them first");
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
  std::array<std::byte, kLineChunk> chunk;
  while (lines > 0) {
    const auto got = file.read_some(offset, chunk);
    if (!got) return tl::unexpected<Error>(got.error());
    if (*got == 0) return fail(in_quotes(file.path()) + " ends while lines before the data are skipped");
    std::size_t used = 0;
    for (; used < *got && lines > 0; ++used) lines -= chunk[used] == std::byte{'\n'};
    offset += used;
  }
  return offset;
}

// Where the data is, and how it is asked for.
struct Samples {
  const InputFile& file;
  const VolumeHeader& header;
  std::uint64_t start;   // bytes of the file before the data and what is skipped by byte_skip
  std::uint64_t before;  // bytes of other time points before the one that is read
  [[nodiscard]] std::uint64_t all() const { return header.data_bytes() * header.time_points; }
  // byte_skip, or of -1 - n the n bytes that follow the data. Written so that the least std::int64_t does not overflow.
  [[nodiscard]] std::uint64_t beside() const {
    return header.byte_skip >= 0 ? std::uint64_t(header.byte_skip) : std::uint64_t(-(header.byte_skip + 1));
  }
  [[nodiscard]] Coded coded() const { return {file, header.encoding, start, header.base64_skip, header.coded_bytes}; }
  [[nodiscard]] tl::unexpected<Error> too_short(const std::string& got) const {
    return fail(in_quotes(file.path()) + ": the header promises " + std::to_string(all()) + " bytes of samples, but " + got +
                "; is the file cut short?");
  }
};

Result<void> read_raw_data(const Samples& source, std::vector<std::byte>& out) {
  const std::uint64_t left = source.file.size() - source.start, all = source.all(), beside = source.beside();
  if (left < all || left - all < beside)
    return source.too_short(std::to_string(left) + " are there" + (beside > 0 ? ", " + std::to_string(beside) + " of them to skip" : ""));
  out.resize(source.header.data_bytes());
  const std::uint64_t first = source.header.byte_skip >= 0 ? source.start + beside : source.file.size() - beside - all;
  return source.file.read(first + source.before, out);
}

// Bytes to skip of the decoded data.
Result<std::uint64_t> decoded_skip(const Samples& source) {
  const VolumeHeader& header = source.header;
  if (header.byte_skip >= 0) return source.beside();
  // Counted from the end, which only decoding finds. It decodes twice rather than keep the bytes before the samples
  // in memory.
  const auto length = decoded_length(source.coded());
  if (!length) return tl::unexpected<Error>(length.error());
  if (*length < source.all() || *length - source.all() < source.beside()) return source.too_short(std::to_string(*length) + " are there");
  return *length - source.all() - source.beside();
}

Result<void> read_coded_data(const Samples& source, std::vector<std::byte>& out) {
  const VolumeHeader& header = source.header;
  const std::uint64_t needed = header.data_bytes(), packed = source.file.size() - source.start;
  const bool has_bound = header.encoding != Encoding::bzip2;
  const std::uint64_t most = header.encoding == Encoding::raw ? packed / 4 + 1 : packed;  // units of 3 bytes, or of one that deflate coded
  if (has_bound && source.all() / (header.encoding == Encoding::raw ? 3 : kGreatestDeflateRatio) > most)
    return source.too_short(std::to_string(packed) + " bytes of " + (header.encoding == Encoding::raw ? "base64" : "gzip") + " cannot hold as many");
  const auto skip = decoded_skip(source);
  if (!skip) return tl::unexpected<Error>(skip.error());
  if (*skip > UINT64_MAX - source.before) return fail(in_quotes(source.file.path()) + ": more bytes are to be skipped than a file can have");
  if (has_bound) {
    out.resize(needed);
    const auto got = decode(source.coded(), *skip + source.before, out);
    if (!got) return tl::unexpected<Error>(got.error());
    out.resize(*got);
  } else if (auto got = decode_growing(source.coded(), *skip + source.before, needed, out); !got) {
    return got;
  }
  if (out.size() < needed) return source.too_short(std::to_string(source.before + out.size()) + " are there");
  return {};
}

bool is_separator(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == ','; }

// Parses one number of a text into the bytes of a sample. Integers that do not fit their type, and floats that are too
// large, fail; floats that are too small are rounded.
template <class T>
bool parse_sample(std::string_view text, std::byte* sample) {
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || text.empty()) return false;
  if constexpr (std::is_floating_point_v<T>) {
    if (error == std::errc::result_out_of_range) {
      const double small = std::strtod(std::string(text).c_str(), nullptr);
      if (!(std::abs(small) < 1)) return false;
      value = T(small);
    }
  }
  if (error != std::errc{} && !(std::is_floating_point_v<T> && error == std::errc::result_out_of_range)) return false;
  std::memcpy(sample, &value, sizeof value);
  return true;
}

// The words of a text in a file, read in chunks. Those that hold numbers end before '<', too, which ends an XML element.
class WordReader {
 public:
  WordReader(const InputFile& file, std::uint64_t offset) : file_(file), offset_(offset) {}

  // The next word, or the beginning of a long one; empty at the end of the file, and before '<'. Valid until the next
  // call.
  Result<std::string_view> next() {
    for (;;) {
      while (at_ < text_.size() && is_separator(text_[at_])) ++at_;
      std::size_t end = at_;
      while (end < text_.size() && !is_separator(text_[end]) && text_[end] != '<' && end - at_ < kLongest) ++end;
      if (end < text_.size() || is_at_end_) {
        const std::string_view word = std::string_view(text_).substr(at_, end - at_);
        at_ = end;
        return word;
      }
      if (auto filled = fill(); !filled) return tl::unexpected<Error>(filled.error());
    }
  }

 private:
  static constexpr std::size_t kLongest = 512;  // characters of a number

  Result<void> fill() {
    text_.erase(0, at_);
    at_ = 0;
    const std::size_t before = text_.size();
    text_.resize(before + kLineChunk);
    const auto got = file_.read_some(offset_, std::as_writable_bytes(std::span(text_).subspan(before)));
    if (!got) return tl::unexpected<Error>(got.error());
    text_.resize(before + *got);
    offset_ += *got;
    is_at_end_ = *got == 0;
    return {};
  }

  const InputFile& file_;
  std::uint64_t offset_;
  std::string text_;  // what has been read
  std::size_t at_ = 0;
  bool is_at_end_ = false;
};

Result<void> read_text_data(const Samples& source, std::vector<std::byte>& out) {
  const VolumeHeader& header = source.header;
  const std::string name = in_quotes(source.file.path());
  const std::uint64_t before = source.before / size_of(header.type), samples = header.grid.sample_count() * header.components;
  const std::uint64_t all = samples * header.time_points, left = source.file.size() - source.start;
  if (header.byte_skip < 0) return fail(name + ": a negative 'byte skip' makes no sense with text");
  const std::uint64_t skipped = source.beside();
  if (left < skipped || (left - skipped) / 2 + 1 < all) return source.too_short(std::to_string(left) + " characters of text cannot hold as many");
  out.resize(header.data_bytes());
  WordReader words(source.file, source.start + skipped);
  const Volume shape{{}, header.grid, header.type, {}};
  return visit_samples(shape, [&]<class T>(std::span<const T>) -> Result<void> {
    std::array<std::byte, sizeof(T)> other;
    for (std::uint64_t i = 0; i < before + samples; ++i) {
      const auto word = words.next();
      if (!word) return tl::unexpected<Error>(word.error());
      if (!parse_sample<T>(*word, i < before ? other.data() : out.data() + (i - before) * sizeof(T)))
        return fail(name + ": sample " + std::to_string(i + 1) + " of " + std::to_string(all) +
                    (word->empty() ? " is missing" : std::string(" is no ") + name_of(header.type)));
    }
    return {};
  });
}

// The numbers of a volume in another type. They fit.
template <class To, class From>
std::vector<std::byte> converted(std::span<const From> from, double slope, double intercept) {
  std::vector<std::byte> bytes(from.size() * sizeof(To));
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto value = To(slope * double(from[i]) + intercept);
    std::memcpy(&bytes[i * sizeof(To)], &value, sizeof value);
  }
  return bytes;
}

bool is_whole(double value) { return std::abs(value) <= 1e9 && value == std::floor(value); }

// Of the types that hold all integers from `least` to `greatest` the first: `type` itself, then from narrow to wide.
std::optional<SampleType> integer_type(SampleType type, double least, double greatest) {
  for (const SampleType candidate : {type, SampleType::u8, SampleType::i8, SampleType::u16, SampleType::i16, SampleType::u32, SampleType::i32}) {
    const Volume shape{{}, {}, candidate, {}};
    const bool fits = visit_samples(shape, [&]<class T>(std::span<const T>) {
      return least >= double(std::numeric_limits<T>::lowest()) && greatest <= double(std::numeric_limits<T>::max());
    });
    if (fits) return candidate;
  }
  return {};
}

// Whether f32 keeps values apart that are a stored step apart, by a sixteenth of it. Of stored floats: as they are.
template <class T>
bool is_f32_enough(double slope, double intercept, double most) {
  constexpr double kLeast = 1e-20, kMost = 1e38;  // far from where f32 ends
  if (std::is_same_v<T, float>) return intercept == 0 && most >= kLeast && most <= kMost;
  return sizeof(T) <= 2 && most <= kMost && std::abs(slope) >= kLeast && most * 0x1p-20 <= std::abs(slope);
}

}  // namespace

Result<void> check_size(const VolumeHeader& header, const std::string& where) {
  constexpr std::uint64_t kMostNumbers = std::uint64_t(1) << 60;  // so that their bytes have a number
  if (header.time_points == 0) return fail(where + " has no time point");
  const std::uint64_t numbers = kMostNumbers / header.components / header.time_points;
  if (header.grid.sample_count() > numbers) return fail(where + " has too many samples");
  return {};
}

Result<std::uint64_t> check_time_point(const VolumeHeader& header, std::optional<std::uint64_t> time_point, const std::string& where) {
  const std::string last = std::to_string(header.time_points - 1);
  if (!time_point && header.time_points > 1)
    return misuse(where + " has " + std::to_string(header.time_points) + " time points: choose one, 0 to " + last + ", with --time-point");
  if (time_point.value_or(0) >= header.time_points)
    return misuse(where + " has no time point " + std::to_string(*time_point) + ": the last one is " + last);
  return time_point.value_or(0);
}

void rescale(Volume& volume, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return;
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    if (samples.empty()) return;
    const auto [least, greatest] = std::minmax_element(samples.begin(), samples.end());
    const auto [low, high] = std::minmax({slope * double(*least) + intercept, slope * double(*greatest) + intercept});
    std::optional<SampleType> type;
    if (std::is_integral_v<T> && is_whole(slope) && is_whole(intercept)) type = integer_type(volume.type, low, high);
    if (!type) type = is_f32_enough<T>(slope, intercept, std::max(std::abs(low), std::abs(high))) ? SampleType::f32 : SampleType::f64;
    const Volume shape{{}, {}, *type, {}};
    auto bytes = visit_samples(shape, [&]<class To>(std::span<const To>) { return converted<To>(samples, slope, intercept); });
    volume.type = *type;
    volume.bytes = std::move(bytes);
  });
}

Result<Volume> read_data(const InputFile& file, const VolumeHeader& header, std::optional<std::uint64_t> time_point) {
  const auto chosen = check_time_point(header, time_point, in_quotes(file.path()));
  if (!chosen) return tl::unexpected<Error>(chosen.error());
  Volume volume{file.path().stem().string(), header.grid, header.type, {}, header.labels, header.components};
  const auto data = !header.data_file ? InputFile::open(file.path()) : detached_path(file.path(), *header.data_file).and_then(InputFile::open);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto start = skip_lines(*data, header.data_offset, header.line_skip);
  if (!start) return tl::unexpected<Error>(start.error());
  if (*start > data->size())
    return fail(in_quotes(data->path()) + " has " + std::to_string(data->size()) + " bytes, and its samples begin after " + std::to_string(*start) +
                "; is the file cut short?");
  const bool is_plain = header.encoding == Encoding::raw && !header.base64_skip;
  const auto read = is_plain ? read_raw_data : header.encoding == Encoding::text ? read_text_data : read_coded_data;
  if (auto done = read({*data, header, *start, *chosen * header.data_bytes()}, volume.bytes); !done) return tl::unexpected<Error>(done.error());
  if (header.big_endian) swap_bytes(volume.bytes, volume.type);
  rescale(volume, header.slope, header.intercept);
  return volume;
}

}  // namespace intervale

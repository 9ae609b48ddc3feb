// The samples in a file whose header has been read: raw, coded or text.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/patch/visit_samples.h"
#include "server/volume/decoder.h"
#include "server/volume/volume_reader.h"

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

// Where the data is: what all of its readers need.
struct Data {
  InputFile file;
  VolumeHeader header;
  std::uint64_t start;   // bytes of the file before the data and what is skipped by byte_skip
  std::uint64_t before;  // bytes of other time points before the one that is read

  [[nodiscard]] std::uint64_t all() const { return header.data_bytes() * header.time_points; }
  // byte_skip, or of -1 - n the n bytes that follow the data. Written so that the least std::int64_t does not overflow.
  [[nodiscard]] std::uint64_t beside() const {
    return header.byte_skip >= 0 ? std::uint64_t(header.byte_skip) : std::uint64_t(-(header.byte_skip + 1));
  }
  [[nodiscard]] std::uint64_t bytes() const { return file.size() - start; }
  [[nodiscard]] Coded coded() const { return {file, header.encoding, start, header.base64_skip, header.coded_bytes}; }
  [[nodiscard]] tl::unexpected<Error> too_short(const std::string& got) const {
    return fail(in_quotes(file.path()) + ": the header promises " + std::to_string(all()) + " bytes of samples, but " + got +
                "; is the file cut short?");
  }
};

using Opened = Result<std::unique_ptr<VolumeReader>>;

class RawSamples final : public VolumeReader {
 public:
  static Opened open(Data data) {
    const std::uint64_t left = data.bytes(), all = data.all(), beside = data.beside();
    if (left < all || left - all < beside)
      return data.too_short(std::to_string(left) + " are there" + (beside > 0 ? ", " + std::to_string(beside) + " of them to skip" : ""));
    const std::uint64_t first = data.header.byte_skip >= 0 ? data.start + beside : data.file.size() - beside - all;
    return std::make_unique<RawSamples>(std::move(data.file), std::move(data.header), first + data.before);
  }
  RawSamples(InputFile file, VolumeHeader header, std::uint64_t offset)
      : VolumeReader(std::move(header), true), file_(std::move(file)), offset_(offset) {}

 private:
  Result<void> read_next(std::span<std::byte> out) override {
    auto done = file_.read(offset_, out);
    offset_ += out.size();
    if (done && header().big_endian) swap_bytes(out, header().type);
    return done;
  }
  Result<void> skip_next(std::uint64_t bytes) override {
    offset_ += bytes;
    return {};
  }
  InputFile file_;
  std::uint64_t offset_;
};

// Bytes to skip of the decoded data.
Result<std::uint64_t> decoded_skip(const Data& data) {
  if (data.header.byte_skip >= 0) return data.beside();
  // Counted from the end, which only decoding finds. It decodes twice rather than keep the bytes before the samples
  // in memory.
  const auto length = decoded_length(data.coded());
  if (!length) return tl::unexpected<Error>(length.error());
  if (*length < data.all() || *length - data.all() < data.beside()) return data.too_short(std::to_string(*length) + " are there");
  return *length - data.all() - data.beside();
}

class CodedSamples final : public VolumeReader {
 public:
  static Opened open(Data data) {
    const Encoding encoding = data.header.encoding;
    const std::uint64_t packed = data.bytes();
    const bool has_bound = encoding != Encoding::bzip2;
    const std::uint64_t most = encoding == Encoding::raw ? packed / 4 + 1 : packed;  // units of 3 bytes, or of one that deflate coded
    if (has_bound && data.all() / (encoding == Encoding::raw ? 3 : kGreatestDeflateRatio) > most)
      return data.too_short(std::to_string(packed) + " bytes of " + (encoding == Encoding::raw ? "base64" : "gzip") + " cannot hold as many");
    const auto skip = decoded_skip(data);
    if (!skip) return tl::unexpected<Error>(skip.error());
    if (*skip > UINT64_MAX - data.before) return fail(in_quotes(data.file.path()) + ": more bytes are to be skipped than a file can have");
    const std::uint64_t first = *skip + data.before;
    auto reader = std::make_unique<CodedSamples>(std::move(data), has_bound);
    // Without the bytes before the samples there are none of them: read_next() finds that.
    if (auto skipped = reader->decoder_.skip(first); !skipped) return tl::unexpected<Error>(skipped.error());
    return reader;
  }
  CodedSamples(Data data, bool has_bound) : VolumeReader(data.header, has_bound), data_(std::move(data)), decoder_(data_.coded()) {}

 private:
  Result<void> read_next(std::span<std::byte> out) override {
    const auto got = decoder_.read(out);
    if (!got) return tl::unexpected<Error>(got.error());
    done_ += *got;
    if (*got < out.size()) return data_.too_short(std::to_string(data_.before + done_) + " are there");
    if (header().big_endian) swap_bytes(out, header().type);
    return left() == 0 ? decoder_.look_for_end() : Result<void>();
  }
  Data data_;
  Decoder decoder_;
  std::uint64_t done_ = 0;
};

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

class TextSamples final : public VolumeReader {
 public:
  static Opened open(Data data) {
    const std::string name = in_quotes(data.file.path());
    const std::uint64_t all = data.all() / size_of(data.header.type), left = data.bytes(), skipped = data.beside();
    if (data.header.byte_skip < 0) return fail(name + ": a negative 'byte skip' makes no sense with text");
    if (left < skipped || (left - skipped) / 2 + 1 < all) return data.too_short(std::to_string(left) + " characters of text cannot hold as many");
    auto reader = std::make_unique<TextSamples>(std::move(data));
    if (auto done = reader->pass_over(reader->data_.before); !done) return tl::unexpected<Error>(done.error());
    return reader;
  }
  explicit TextSamples(Data data) : VolumeReader(data.header, true), data_(std::move(data)), words_(data_.file, data_.start + data_.beside()) {}

 private:
  Result<void> read_next(std::span<std::byte> out) override {
    const Volume shape{{}, {}, header().type, {}};
    return visit_samples(shape, [&]<class T>(std::span<const T>) -> Result<void> {
      for (std::size_t at = 0; at < out.size(); at += sizeof(T)) {
        const auto word = words_.next();
        if (!word) return tl::unexpected<Error>(word.error());
        ++parsed_;
        if (!parse_sample<T>(*word, out.data() + at))
          return fail(in_quotes(data_.file.path()) + ": sample " + std::to_string(parsed_) + " of " + std::to_string(data_.all() / sizeof(T)) +
                      (word->empty() ? " is missing" : std::string(" is no ") + name_of(header().type)));
      }
      return {};
    });
  }
  Result<void> skip_next(std::uint64_t bytes) override { return pass_over(bytes); }
  Result<void> pass_over(std::uint64_t bytes) {
    std::array<std::byte, 8> number{};
    for (const std::size_t size = size_of(header().type); bytes > 0; bytes -= size) {
      if (auto done = read_next(std::span(number).first(size)); !done) return done;
    }
    return {};
  }
  Data data_;
  WordReader words_;
  std::uint64_t parsed_ = 0;  // numbers
};

}  // namespace

Result<std::unique_ptr<VolumeReader>> open_samples(const InputFile& file, const VolumeHeader& header, std::optional<std::uint64_t> time_point) {
  const auto chosen = check_time_point(header, time_point, in_quotes(file.path()));
  if (!chosen) return tl::unexpected<Error>(chosen.error());
  auto data = !header.data_file ? InputFile::open(file.path()) : detached_path(file.path(), *header.data_file).and_then(InputFile::open);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto start = skip_lines(*data, header.data_offset, header.line_skip);
  if (!start) return tl::unexpected<Error>(start.error());
  if (*start > data->size())
    return fail(in_quotes(data->path()) + " has " + std::to_string(data->size()) + " bytes, and its samples begin after " + std::to_string(*start) +
                "; is the file cut short?");
  const bool is_plain = header.encoding == Encoding::raw && !header.base64_skip;
  const auto open = is_plain ? RawSamples::open : header.encoding == Encoding::text ? TextSamples::open : CodedSamples::open;
  return open({std::move(*data), header, *start, *chosen * header.data_bytes()});
}

}  // namespace intervale

#include "server/volume/decoder.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace intervale {
namespace {

constexpr std::size_t kChunk = 1 << 16;

// One library's decoder. Members follow each other; decode() reports the end of each.
class Codec {
 public:
  enum class State : std::uint8_t { within, ended, damaged };
  Codec() = default;
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;
  virtual ~Codec() = default;

  // Takes from the front of `in` and fills the front of `out`; both become what is left.
  virtual State decode(std::span<std::byte>& in, std::span<std::byte>& out) = 0;
  virtual bool restart() = 0;                                 // for the next member
  [[nodiscard]] virtual bool may_begin(std::byte) const = 0;  // the next member, with this byte
  [[nodiscard]] virtual std::string reason() const = 0;       // why the data is damaged
  [[nodiscard]] virtual const char* name() const = 0;
  [[nodiscard]] bool is_ready() const { return is_ready_; }

 protected:
  bool is_ready_ = false;
};

constexpr std::size_t kMost = std::numeric_limits<unsigned>::max();  // bytes a call: both libraries count in 32 bits

class Deflate : public Codec {
 public:
  Deflate() { is_ready_ = inflateInit2(&stream_, kAnyWrapping) == Z_OK; }
  ~Deflate() override {
    if (is_ready_) inflateEnd(&stream_);
  }
  State decode(std::span<std::byte>& in, std::span<std::byte>& out) override {
    if (stream_.total_in == 0 && !in.empty()) is_zlib_ = in[0] != kGzip;
    stream_.next_in = reinterpret_cast<Bytef*>(in.data());
    stream_.avail_in = uInt(std::min(in.size(), kMost));
    stream_.next_out = reinterpret_cast<Bytef*>(out.data());
    stream_.avail_out = uInt(std::min(out.size(), kMost));
    const std::size_t had = stream_.avail_in, wanted = stream_.avail_out;
    const int code = inflate(&stream_, Z_NO_FLUSH);
    in = in.subspan(had - stream_.avail_in);
    out = out.subspan(wanted - stream_.avail_out);
    if (code == Z_STREAM_END) return State::ended;
    return code == Z_OK || code == Z_BUF_ERROR ? State::within : State::damaged;
  }
  bool restart() override { return inflateReset(&stream_) == Z_OK; }
  [[nodiscard]] bool may_begin(std::byte first) const override { return is_zlib_ ? (first & std::byte{0x8f}) == std::byte{8} : first == kGzip; }
  [[nodiscard]] std::string reason() const override { return stream_.msg != nullptr ? stream_.msg : "not gzip"; }
  [[nodiscard]] const char* name() const override { return is_zlib_ ? "zlib" : "gzip"; }

 private:
  static constexpr int kAnyWrapping = 15 + 32;  // zlib's windowBits: 32 KiB window, gzip or zlib
  static constexpr std::byte kGzip{0x1f};       // what gzip begins with; zlib's own wrapping: 8, and in the high bits the window
  bool is_zlib_ = false;
  z_stream stream_{};
};

class Stored : public Codec {
 public:
  Stored() { is_ready_ = true; }
  State decode(std::span<std::byte>& in, std::span<std::byte>& out) override {
    const std::size_t count = std::min(in.size(), out.size());
    std::copy_n(in.begin(), count, out.begin());
    in = in.subspan(count);
    out = out.subspan(count);
    return State::ended;
  }
  bool restart() override { return true; }
  [[nodiscard]] bool may_begin(std::byte) const override { return true; }
  [[nodiscard]] std::string reason() const override { return ""; }
  [[nodiscard]] const char* name() const override { return "raw"; }
};

class Bzip2 : public Codec {
 public:
  Bzip2() { is_ready_ = BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK; }
  ~Bzip2() override {
    if (is_ready_) BZ2_bzDecompressEnd(&stream_);
  }
  State decode(std::span<std::byte>& in, std::span<std::byte>& out) override {
    stream_.next_in = reinterpret_cast<char*>(in.data());
    stream_.avail_in = unsigned(std::min(in.size(), kMost));
    stream_.next_out = reinterpret_cast<char*>(out.data());
    stream_.avail_out = unsigned(std::min(out.size(), kMost));
    const std::size_t had = stream_.avail_in, wanted = stream_.avail_out;
    const int code = BZ2_bzDecompress(&stream_);
    in = in.subspan(had - stream_.avail_in);
    out = out.subspan(wanted - stream_.avail_out);
    return code == BZ_STREAM_END ? State::ended : code == BZ_OK ? State::within : State::damaged;
  }
  bool restart() override {
    BZ2_bzDecompressEnd(&stream_);
    stream_ = {};
    return is_ready_ = BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK;
  }
  [[nodiscard]] bool may_begin(std::byte first) const override { return first == std::byte{'B'}; }
  [[nodiscard]] std::string reason() const override { return "not bzip2, or a checksum differs"; }
  [[nodiscard]] const char* name() const override { return "bzip2"; }

 private:
  bz_stream stream_{};
};

// The bytes of a file, or what base64 text in it stands for.
class Source {
 public:
  explicit Source(const Coded& data)
      : file_(data.file), offset_(data.offset), is_base64_(data.base64_skip.has_value()), first_end_(data.base64_skip.value_or(0)) {}

  // Fills the front of `out`, which has room for kChunk; 0 bytes only at the end.
  Result<std::size_t> read(std::span<std::byte> out) {
    if (!is_base64_) {
      auto got = file_.read_some(offset_, out);
      offset_ += got.value_or(0);
      return got;
    }
    std::size_t filled = 0;
    while (filled == 0 && !is_ended_) {
      auto got = file_.read_some(offset_, text_);
      if (!got || *got == 0) return got;
      offset_ += *got;
      for (std::size_t i = 0; i < *got && !is_ended_; ++i) filled += take(char(text_[i]), out.subspan(filled));
    }
    return filled;
  }

 private:
  // Of four characters with 6 bits each; '=' stands for none, and ends the text unless what is skipped ends there: that
  // may be a text of its own. Returns how many bytes are complete: 0, or 1 to 3.
  std::size_t take(char c, std::span<std::byte> out) {
    if (c == ' ' || c == '\n' || c == '\r' || c == '\t') return 0;
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    const bool is_misplaced = value >= 0 ? unused_ > 0 || (is_padded_ && done_ != first_end_) : c != '=' || characters_ < 2;
    if (is_misplaced) {
      is_ended_ = true;
      return 0;
    }
    bits_ = bits_ << 6 | std::uint32_t(std::max(value, 0));
    unused_ += value < 0;
    if (++characters_ < 4) return 0;
    const std::size_t bytes = 3 - std::min<std::size_t>(unused_, 3);
    for (std::size_t k = 0; k < bytes; ++k) out[k] = std::byte(bits_ >> (16 - 8 * k));
    is_padded_ = unused_ > 0;
    done_ += bytes;
    characters_ = bits_ = unused_ = 0;
    return bytes;
  }

  const InputFile& file_;
  std::uint64_t offset_;
  const bool is_base64_;
  const std::uint64_t first_end_;  // bytes that may be a text of their own
  bool is_ended_ = false, is_padded_ = false;
  std::uint64_t done_ = 0;                                // bytes
  std::uint32_t bits_ = 0, characters_ = 0, unused_ = 0;  // of the group of four
  std::array<std::byte, kChunk> text_;
};

std::unique_ptr<Codec> codec_of(Encoding encoding) {
  if (encoding == Encoding::raw) return std::make_unique<Stored>();
  if (encoding == Encoding::bzip2) return std::make_unique<Bzip2>();
  return std::make_unique<Deflate>();
}

}  // namespace

class Decoder::Impl {
 public:
  explicit Impl(const Coded& data)
      : file_(data.file), source_(data), codec_(codec_of(data.encoding)), before_(data.base64_skip.value_or(0)), left_(data.coded_bytes) {}

  // Fills `out`; fewer bytes only at the end of the data.
  Result<std::uint64_t> read(std::span<std::byte> out) {
    const std::size_t wanted = out.size();
    while (!out.empty() && !is_ended_) {
      if (!codec_->is_ready()) return fail("no memory left to decode " + in_quotes(file_.path()));
      if (auto filled = refill(); !filled) return tl::unexpected<Error>(filled.error());
      if (is_ended_) break;
      switch (codec_->decode(input_, out)) {
        case Codec::State::within:
          is_within_member_ = true;
          break;
        case Codec::State::ended:
          is_within_member_ = false;
          codec_->restart();
          break;
        case Codec::State::damaged:
          return fail(where() + "damaged " + codec_->name() + " data (" + codec_->reason() + ")");
      }
    }
    return wanted - out.size();
  }
  // Fewer bytes only at the end of the data.
  Result<std::uint64_t> skip(std::uint64_t bytes) {
    std::vector<std::byte> chunk(std::min<std::uint64_t>(bytes, kChunk));
    std::uint64_t done = 0;
    while (done < bytes) {
      auto got = read(std::span(chunk).first(std::min<std::uint64_t>(chunk.size(), bytes - done)));
      if (!got) return got;
      done += *got;
      if (*got == 0) break;
    }
    return done;
  }
  // zlib compares the checksum when it meets the end, which it has not looked for yet if the samples end with the data.
  Result<void> look_for_end() {
    if (auto rest = skip(kChunk); !rest) return tl::unexpected<Error>(rest.error());
    return {};
  }

 private:
  Result<void> refill() {
    while (input_.empty() && !is_ended_) {
      const auto got = source_.read(buffer_);
      if (!got) return tl::unexpected<Error>(got.error());
      const std::size_t skipped = std::min<std::uint64_t>(before_, *got);
      before_ -= skipped;
      const std::size_t taken = std::min<std::uint64_t>(*got - skipped, left_);
      left_ -= taken;
      input_ = std::span(buffer_).subspan(skipped, taken);
      is_ended_ = *got == 0 || (taken == 0 && left_ == 0);
      if (is_ended_ && is_within_member_) return fail(where() + "the " + codec_->name() + " data ends too early; is the file cut short?");
    }
    // Some tools pad gzip files, with zeros as a rule: whatever follows a whole member and is not another one is not
    // data.
    if (!is_within_member_ && !is_ended_ && !codec_->may_begin(input_[0])) is_ended_ = true;
    return {};
  }
  [[nodiscard]] std::string where() const { return in_quotes(file_.path()) + ": "; }

  const InputFile& file_;
  Source source_;
  std::unique_ptr<Codec> codec_;
  std::uint64_t before_;  // bytes that are still to be skipped before the coded data
  std::uint64_t left_;    // ... and of the coded data
  bool is_ended_ = false;
  bool is_within_member_ = true;  // a file that holds nothing is cut short, too
  std::array<std::byte, kChunk> buffer_;
  std::span<std::byte> input_;  // what is left of it
};

Decoder::Decoder(const Coded& data) : impl_(std::make_unique<Impl>(data)) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;
Result<std::uint64_t> Decoder::read(std::span<std::byte> out) { return impl_->read(out); }
Result<std::uint64_t> Decoder::skip(std::uint64_t bytes) { return impl_->skip(bytes); }
Result<void> Decoder::look_for_end() { return impl_->look_for_end(); }

Result<std::uint64_t> decode(const Coded& data, std::uint64_t skip, std::span<std::byte> out) {
  Decoder decoder(data);
  if (auto skipped = decoder.skip(skip); !skipped) return skipped;
  auto got = decoder.read(out);
  if (got && *got == out.size())
    if (auto end = decoder.look_for_end(); !end) return tl::unexpected<Error>(end.error());
  return got;
}

Result<std::uint64_t> decoded_length(const Coded& data) { return Decoder(data).skip(std::numeric_limits<std::uint64_t>::max()); }

}  // namespace intervale

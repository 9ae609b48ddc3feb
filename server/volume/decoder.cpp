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
  virtual bool restart() = 0;                              // for the next member
  [[nodiscard]] virtual std::byte first_byte() const = 0;  // of every member that may follow another one
  [[nodiscard]] virtual std::string reason() const = 0;    // why the data is damaged
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
  [[nodiscard]] std::byte first_byte() const override { return std::byte{0x1f}; }
  [[nodiscard]] std::string reason() const override { return stream_.msg != nullptr ? stream_.msg : "not gzip"; }
  [[nodiscard]] const char* name() const override { return "gzip"; }

 private:
  static constexpr int kAnyWrapping = 15 + 32;  // zlib's windowBits: 32 KiB window, gzip or zlib
  z_stream stream_{};
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
  [[nodiscard]] std::byte first_byte() const override { return std::byte{'B'}; }
  [[nodiscard]] std::string reason() const override { return "not bzip2, or a checksum differs"; }
  [[nodiscard]] const char* name() const override { return "bzip2"; }

 private:
  bz_stream stream_{};
};

class Decoder {
 public:
  Decoder(const InputFile& file, Encoding encoding, std::uint64_t offset) : file_(file), offset_(offset) {
    if (encoding == Encoding::bzip2) {
      codec_ = std::make_unique<Bzip2>();
    } else {
      codec_ = std::make_unique<Deflate>();
    }
  }

  // Fills `out`; fewer bytes only at the end of the data.
  Result<std::uint64_t> next(std::span<std::byte> out) {
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
  Result<std::uint64_t> discard(std::uint64_t bytes) {
    std::vector<std::byte> chunk(std::min<std::uint64_t>(bytes, kChunk));
    std::uint64_t done = 0;
    while (done < bytes) {
      auto got = next(std::span(chunk).first(std::min<std::uint64_t>(chunk.size(), bytes - done)));
      if (!got) return got;
      done += *got;
      if (*got == 0) break;
    }
    return done;
  }
  // zlib compares the checksum when it meets the end, which it has not looked for yet if the samples end with the data.
  Result<void> look_for_end() {
    if (auto rest = discard(kChunk); !rest) return tl::unexpected<Error>(rest.error());
    return {};
  }

 private:
  Result<void> refill() {
    if (input_.empty()) {
      const auto got = file_.read_some(offset_, buffer_);
      if (!got) return tl::unexpected<Error>(got.error());
      offset_ += *got;
      input_ = std::span(buffer_).first(*got);
      if (*got == 0 && is_within_member_) return fail(where() + "the " + codec_->name() + " data ends too early; is the file cut short?");
      is_ended_ = *got == 0;
    }
    // Some tools pad gzip files, with zeros as a rule: whatever follows a whole member and is not another one is not
    // data.
    if (!is_within_member_ && !is_ended_ && input_[0] != codec_->first_byte()) is_ended_ = true;
    return {};
  }
  [[nodiscard]] std::string where() const { return in_quotes(file_.path()) + ": "; }

  const InputFile& file_;
  std::uint64_t offset_;
  std::unique_ptr<Codec> codec_;
  bool is_ended_ = false;
  bool is_within_member_ = true;  // a file that holds nothing is cut short, too
  std::array<std::byte, kChunk> buffer_;
  std::span<std::byte> input_;  // what is left of it
};

}  // namespace

Result<std::uint64_t> decode(const InputFile& file, Encoding encoding, std::uint64_t offset, std::uint64_t skip, std::span<std::byte> out) {
  Decoder decoder(file, encoding, offset);
  if (auto skipped = decoder.discard(skip); !skipped) return skipped;
  auto got = decoder.next(out);
  if (got && *got == out.size())
    if (auto end = decoder.look_for_end(); !end) return tl::unexpected<Error>(end.error());
  return got;
}

Result<void> decode_growing(const InputFile& file, Encoding encoding, std::uint64_t offset, std::uint64_t skip, std::uint64_t size,
                            std::vector<std::byte>& out) {
  constexpr std::uint64_t kFirst = 1 << 20;
  Decoder decoder(file, encoding, offset);
  out.clear();
  if (auto skipped = decoder.discard(skip); !skipped) return tl::unexpected<Error>(skipped.error());
  while (out.size() < size) {
    const std::size_t before = out.size();
    out.resize(std::min(size, std::max<std::uint64_t>(kFirst, 2 * before)));
    const auto got = decoder.next(std::span(out).subspan(before));
    if (!got) return tl::unexpected<Error>(got.error());
    if (before + *got == out.size()) continue;
    out.resize(before + *got);
    return {};
  }
  return decoder.look_for_end();
}

Result<std::uint64_t> decoded_length(const InputFile& file, Encoding encoding, std::uint64_t offset) {
  return Decoder(file, encoding, offset).discard(std::numeric_limits<std::uint64_t>::max());
}

}  // namespace intervale

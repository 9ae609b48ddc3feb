#include "server/volume/gzip_decoder.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>

namespace intervale {
namespace {

constexpr std::size_t kGzipChunk = 1 << 16;
constexpr Bytef kMemberMagic = 0x1f;  // first byte of every member
constexpr int kGzipOnly = 15 + 16;    // zlib's windowBits: 32 KiB window, gzip wrapping

class Inflater {
 public:
  Inflater(const InputFile& file, std::uint64_t offset) : file_(file), offset_(offset) { ready_ = inflateInit2(&stream_, kGzipOnly) == Z_OK; }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() {
    if (ready_) inflateEnd(&stream_);
  }

  // Fills `out`; fewer bytes only at the end of the data.
  Result<std::uint64_t> next(std::span<std::byte> out) {
    if (!ready_) return fail("no memory left to decode '" + file_.path().string() + "'");
    std::uint64_t done = 0;
    while (done < out.size() && !ended_) {
      if (auto filled = refill(); !filled) return tl::unexpected<Error>(filled.error());
      if (ended_) break;
      const auto wanted = static_cast<uInt>(std::min<std::uint64_t>(out.size() - done, std::numeric_limits<uInt>::max()));
      stream_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
      stream_.avail_out = wanted;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      done += wanted - stream_.avail_out;
      within_member_ = code != Z_STREAM_END;
      if (code == Z_STREAM_END)
        inflateReset(&stream_);  // keeps the input that is left: the next member, if there is one
      else if (code != Z_OK && code != Z_BUF_ERROR)
        return fail(where() + "damaged gzip data (" + (stream_.msg ? stream_.msg : "not gzip") + ")");
    }
    return done;
  }

 private:
  Result<void> refill() {
    if (stream_.avail_in == 0) {
      const auto got = file_.read_some(offset_, input_);
      if (!got) return tl::unexpected<Error>(got.error());
      offset_ += *got;
      stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
      stream_.avail_in = static_cast<uInt>(*got);
      if (*got == 0 && within_member_) return fail(where() + "the gzip data ends too early; is the file cut short?");
      ended_ = *got == 0;
    }
    // Some tools pad gzip files, with zeros as a rule: whatever follows a whole member and is not another one is not
    // data.
    if (!within_member_ && !ended_ && stream_.next_in[0] != kMemberMagic) ended_ = true;
    return {};
  }
  [[nodiscard]] std::string where() const { return in_quotes(file_.path()) + ": "; }

  const InputFile& file_;
  std::uint64_t offset_;
  z_stream stream_{};
  bool ready_ = false, ended_ = false;
  bool within_member_ = true;  // a file that holds nothing is cut short, too
  std::array<std::byte, kGzipChunk> input_;
};

Result<std::uint64_t> discard(Inflater& inflater, std::uint64_t bytes) {
  std::array<std::byte, kGzipChunk> chunk;
  std::uint64_t done = 0;
  while (done < bytes) {
    auto got = inflater.next(std::span(chunk).first(std::min<std::uint64_t>(chunk.size(), bytes - done)));
    if (!got) return got;
    done += *got;
    if (*got == 0) break;
  }
  return done;
}

}  // namespace

Result<std::uint64_t> gzip_decode(const InputFile& file, std::uint64_t offset, std::uint64_t skip, std::span<std::byte> out) {
  Inflater inflater(file, offset);
  if (auto skipped = discard(inflater, skip); !skipped) return skipped;
  auto got = inflater.next(out);
  // zlib compares the checksum when it meets the end, which it has not looked for yet if the samples end with the data.
  if (got && *got == out.size())
    if (auto rest = discard(inflater, kGzipChunk); !rest) return rest;
  return got;
}

Result<std::uint64_t> gzip_length(const InputFile& file, std::uint64_t offset) {
  Inflater inflater(file, offset);
  return discard(inflater, std::numeric_limits<std::uint64_t>::max());
}

}  // namespace intervale

#include "server/readers/zarr_chunks.h"

#include <blosc.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>

#include "server/volume/input_file.h"

namespace intervale {
namespace {

// A chunk from its file's bytes. False if they are damaged.
bool decode_chunk(const std::string& codec, std::span<const std::byte> coded, std::span<std::byte> out) {
  if (codec.empty()) {
    if (coded.size() != out.size()) return false;
    std::copy(coded.begin(), coded.end(), out.begin());
    return true;
  }
  if (codec == "blosc") {
    std::size_t size = 0;
    return blosc_cbuffer_validate(coded.data(), coded.size(), &size) == 0 && size == out.size() &&
           blosc_decompress_ctx(coded.data(), out.data(), out.size(), 1) == int(out.size());
  }
  if (codec == "zstd") return ZSTD_decompress(out.data(), out.size(), coded.data(), coded.size()) == out.size();
  z_stream stream{};
  constexpr int kZlibOrGzip = 15 + 32;
  if (inflateInit2(&stream, kZlibOrGzip) != Z_OK) return false;
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(coded.data()));
  stream.avail_in = uInt(coded.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  const int status = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return status == Z_STREAM_END && stream.avail_out == 0;
}

// Reads an array, a layer of chunks at a time.

}  // namespace

ZarrChunkReader::ZarrChunkReader(const ZarrArray& array, std::uint64_t time_point)
    : array_(array), chunk_(array.samples_of_chunk() * size_of(array.type)) {
  at_.assign(array.axes.size(), 0);
  if (array.axis(ZarrAxis::time) < at_.size()) at_[array.axis(ZarrAxis::time)] = time_point;
  if (array.axis(ZarrAxis::channel) < at_.size()) at_[array.axis(ZarrAxis::channel)] = array.channel;
  stride_.assign(at_.size(), 1);
  for (std::size_t k = 1; k < at_.size(); ++k) {
    const std::size_t axis = array.is_fortran ? k : at_.size() - 1 - k, before = array.is_fortran ? axis - 1 : axis + 1;
    stride_[axis] = stride_[before] * array.chunk[before];
  }
}

Result<std::vector<std::byte>> ZarrChunkReader::layer(std::uint64_t z) {
  const std::size_t az = array_.axis(ZarrAxis::z), ay = array_.axis(ZarrAxis::y), ax = array_.axis(ZarrAxis::x);
  at_[az] = z;
  const std::uint64_t slices = std::min(array_.chunk[az], array_.shape[az] - z), width = size_of(array_.type);
  std::vector<std::byte> out(slices * array_.shape[ay] * array_.shape[ax] * width);
  for (at_[ay] = 0; at_[ay] < array_.shape[ay]; at_[ay] += array_.chunk[ay]) {
    for (at_[ax] = 0; at_[ax] < array_.shape[ax]; at_[ax] += array_.chunk[ax]) {
      if (auto read = read_chunk(); !read) return tl::unexpected<Error>(read.error());
      const std::uint64_t rows = std::min(array_.chunk[ay], array_.shape[ay] - at_[ay]),
                          across = std::min(array_.chunk[ax], array_.shape[ax] - at_[ax]);
      std::uint64_t first = 0;  // of other axes
      for (std::size_t k = 0; k < at_.size(); ++k) {
        if (k != az && k != ay && k != ax) first += at_[k] % array_.chunk[k] * stride_[k];
      }
      for (std::uint64_t k = 0; k < slices; ++k) {
        for (std::uint64_t j = 0; j < rows; ++j) {
          const std::byte* from = chunk_.data() + (first + k * stride_[az] + j * stride_[ay]) * width;
          std::byte* to = out.data() + ((k * array_.shape[ay] + at_[ay] + j) * array_.shape[ax] + at_[ax]) * width;
          if (stride_[ax] == 1) std::memcpy(to, from, across * width);
          for (std::uint64_t i = 0; stride_[ax] != 1 && i < across; ++i) std::memcpy(to + i * width, from + i * stride_[ax] * width, width);
        }
      }
    }
  }
  return out;
}

Result<void> ZarrChunkReader::read_chunk() {
  std::string name;
  for (std::size_t k = 0; k < at_.size(); ++k) name += (k == 0 ? "" : std::string(1, array_.separator)) + std::to_string(at_[k] / array_.chunk[k]);
  const auto path = array_.folder / name;
  std::error_code none;
  if (!std::filesystem::exists(path, none)) {
    for (std::size_t i = 0; i < chunk_.size(); i += array_.fill.size())
      std::copy(array_.fill.begin(), array_.fill.end(), chunk_.begin() + std::ptrdiff_t(i));
    return {};
  }
  const auto file = InputFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  if (file->size() > 2 * kMostChunk) return fail(in_quotes(path) + " is larger than a chunk can be");
  std::vector<std::byte> coded(file->size());
  if (auto read = file->read(0, coded); !read) return read;
  if (!decode_chunk(array_.codec, coded, chunk_))
    return fail(in_quotes(path) + " is damaged: it is no chunk of " + std::to_string(chunk_.size()) + " bytes");
  if (array_.big_endian) swap_bytes(chunk_, array_.type);
  return {};
}

}  // namespace intervale

// The samples of a Zarr array, from its chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/util/result.h"
#include "server/readers/zarr_array.h"

namespace intervale {

// Reads a layer of chunks at a time.
class ZarrChunkReader {
 public:
  // The array must outlive it, and have the time point.
  ZarrChunkReader(const ZarrArray& array, std::uint64_t time_point);

  // The slices from z on that are in one layer of chunks: z is a multiple of their height. In the machine's byte order.
  [[nodiscard]] Result<std::vector<std::byte>> layer(std::uint64_t z);

 private:
  // The chunk that begins at at_, or has it.
  Result<void> read_chunk();

  const ZarrArray& array_;
  std::vector<std::byte> chunk_;
  std::vector<std::uint64_t> at_, stride_;  // by axis, in samples
};

}  // namespace intervale

// The samples that one rank has of a volume: those of some cells, in an array for all.
//
// The array takes addresses for the whole volume, also for one that is larger than the machine's memory, and memory for
// the pages in which something was written. So all that computes with a volume computes with it, as long as it reads no
// other samples.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/cluster/ranks.h"
#include "server/volume/volume_header.h"
#include "server/volume/volume_reader.h"

namespace intervale {

// A volume that all ranks read. It is opened for each pass; then its header must be like the first one (is_alike()).
struct RankInput {
  std::string name;  // in complaints
  VolumeHeader header;
  std::function<Result<std::unique_ptr<VolumeReader>>()> open;  // from its beginning
  std::optional<SampleBox> crop = {};                           // what is kept of it; nothing: all
  std::optional<double> nan = {};                               // as of check_finite()
};

// Frees an array; one that was mapped, if `mapped` bytes are not 0.
struct FreeSamples {
  std::size_t mapped = 0;
  void operator()(std::byte* bytes) const;
};

class RankSamples {
 public:
  RankSamples(const Domain& domain, SampleType type);

  // Calls visit with the samples of these cells, side by side, a layer of cells after the other. The dims of those
  // volumes say nothing. changes: what it did to them is kept.
  void for_each_layer(const std::vector<bool>& cells, bool changes, const std::function<void(Volume&)>& visit);

  [[nodiscard]] std::span<std::byte> bytes() { return {bytes_.get(), count_ * size_of(type_)}; }  // of all samples
  [[nodiscard]] std::span<const std::byte> bytes() const { return {bytes_.get(), count_ * size_of(type_)}; }
  [[nodiscard]] SampleType type() const { return type_; }
  [[nodiscard]] std::byte* at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return bytes_.get() + ((std::size_t(z) * std::size_t(last_.y + 1) + std::size_t(y)) * std::size_t(last_.x + 1) + std::size_t(x)) * size_of(type_);
  }

 private:
  Vertex last_;
  SampleType type_;
  std::size_t count_;
  std::unique_ptr<std::byte[], FreeSamples> bytes_;
};

// Reads these cells of a volume, which has the domain's dims once it is cropped: an array for each component. Slope and
// intercept are applied, and samples that are not finite replaced. Fails on all ranks if on one. Reads a layer of cells
// after the other, in one pass; in two with slope or intercept, since the type of the values depends on all of them.
[[nodiscard]] Result<std::vector<RankSamples>> read_on_ranks(Ranks& ranks, const RankInput& input, const Domain& domain,
                                                             const std::vector<bool>& cells);

}  // namespace intervale

// The samples that one rank has of a volume: those of some cells, in an array for all.
//
// The array takes addresses for the whole volume, and memory for the pages in which something was written. So all that
// computes with a volume computes with it, as long as it reads no other samples.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/diamond/domain.h"
#include "common/patch/volume.h"
#include "common/util/result.h"

namespace intervale {

// Samples of a box of a volume, finite.
using ReadBox = std::function<Result<Volume>(const SampleBox&)>;

class RankSamples {
 public:
  RankSamples(const Domain& domain, SampleType type);

  // Reads the samples of these cells, a layer of cells after the other. seen: called with each layer that is read, which
  // may have more samples than those of the cells.
  [[nodiscard]] Result<void> read(const std::vector<bool>& cells, const ReadBox& read_box, const std::function<void(const Volume&)>& seen);

  // Calls visit with the samples of these cells, side by side, a layer of cells after the other. The dims of those
  // volumes say nothing. changes: what it did to them is kept.
  void for_each_layer(const std::vector<bool>& cells, bool changes, const std::function<void(Volume&)>& visit);

  [[nodiscard]] std::span<std::byte> bytes() { return {bytes_.get(), count_ * size_of(type_)}; }  // of all samples
  [[nodiscard]] std::span<const std::byte> bytes() const { return {bytes_.get(), count_ * size_of(type_)}; }
  [[nodiscard]] SampleType type() const { return type_; }

 private:
  [[nodiscard]] std::byte* at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return bytes_.get() + ((std::size_t(z) * std::size_t(last_.y + 1) + std::size_t(y)) * std::size_t(last_.x + 1) + std::size_t(x)) * size_of(type_);
  }
  Vertex last_;
  SampleType type_;
  std::size_t count_;
  std::unique_ptr<std::byte[]> bytes_;
};

}  // namespace intervale

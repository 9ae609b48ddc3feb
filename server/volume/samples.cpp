#include "server/volume/samples.h"

#include <string>
#include <vector>

#include "server/volume/sample_field.h"

namespace intervale {

std::span<const std::string_view> sample_names() {
  static const auto names = [] {
    std::vector<std::string_view> all;
    for (const auto& formula : sample_formulas()) all.push_back(formula.name);
    return all;
  }();
  return names;
}

Result<Volume> make_sample(std::string_view name, int size) {
  const auto field = SampleField::create(name, size, SampleType::f32);
  if (!field) return tl::unexpected(field.error());
  if (size > kMaxSampleSize)
    return misuse("a sample of " + std::to_string(size) + " a side cannot be made in memory: sizes go from " + std::to_string(kMinSampleSize) +
                  " to " + std::to_string(kMaxSampleSize));
  Volume volume = field->header();
  volume.bytes.resize(field->rows() * field->row_bytes());
  field->fill(0, volume.bytes);
  return volume;
}

}  // namespace intervale

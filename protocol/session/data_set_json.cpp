#include "protocol/session/data_set_json.h"

#include <nlohmann/json.hpp>

#include "common/program/describe.h"

namespace intervale {

std::string data_set_json(const IntervalVolume& volume) {
  nlohmann::ordered_json json = to_json(volume.description());
  if (const FieldStatistics* statistics = volume.statistics()) {
    json["histogram"] = statistics->histogram.count;
    json["histogram_width"] = statistics->histogram.width;
    const VolumeTable& volumes = statistics->volumes;
    json["volumes"] = {{"values", volumes.position}, {"below", volumes.below}, {"not_above", volumes.not_above}};
  }
  return json.dump() + "\n";
}

}  // namespace intervale

#include "common/program/describe.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace intervale {
namespace {

nlohmann::ordered_json number(double value) {
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  return value;
}

}  // namespace

nlohmann::ordered_json to_json(const Description& description) {
  const Grid& grid = description.grid;
  const FullMesh& full = description.full;
  const bool has_one = !description.has_every_range;
  nlohmann::ordered_json json{
      {"name", description.name},
      {"scope", has_one ? "one" : "every"},
      {"dims", grid.dims},
      {"spacing", grid.spacing},
      {"origin", grid.origin},
      {"values", {{"least", description.format.least()}, {"greatest", description.format.greatest()}}},
      {"step", description.is_exact ? 0.0 : description.format.step},
      {"max_error", number(description.max_error)},
      {"updates", description.updates},
  };
  if (has_one) {
    json["range"] = nlohmann::ordered_json::array({number(description.range.alpha), number(description.range.beta)});
    json["refine"] = description.refine == Refine::uniform ? "uniform" : "boundary";
    json["coefficients"] = description.coefficients;
    json["full"] = {{"vertices", full.vertices}, {"tets", full.tets}, {"indexed_bytes", full.indexed_bytes()}};
  }
  return json;
}

}  // namespace intervale

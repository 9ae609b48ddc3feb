#include "common/program/describe.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/patch/channel_bounds.h"

namespace intervale {
namespace {

nlohmann::ordered_json number(double value) {
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  return value;
}

}  // namespace

nlohmann::ordered_json to_json(const Range& range) { return nlohmann::ordered_json::array({number(range.alpha), number(range.beta)}); }

nlohmann::ordered_json to_json(std::span<const Channel> channels) {
  auto list = nlohmann::ordered_json::array();
  for (const Channel& channel : channels) {
    auto steps = nlohmann::ordered_json::array();
    for (const ChannelComponent& component : channel.components) steps.push_back(component.is_exact ? 0.0 : component.format.step);
    const bool is_scalar = channel.components.size() == 1;
    const auto [least, greatest] = bounds_of(channel);
    const nlohmann::ordered_json values{{"least", least}, {"greatest", greatest}};
    list.push_back({{"name", channel.name}, {"kind", is_scalar ? "scalar" : "vector"}, {"unit", channel.unit}, {"values", values}, {"steps", steps}});
  }
  return list;
}

void add_grid(nlohmann::ordered_json& json, const Grid& grid, const Labels& labels) {
  json["dims"] = grid.dims;
  json["spacing"] = grid.affine.spacing();
  json["origin"] = grid.affine.origin();
  json["affine"] = grid.affine.rows;
  json["unit"] = labels.unit;
  json["field"] = labels.field;
  json["field_unit"] = labels.field_unit;
  json["space"] = labels.space;
}

nlohmann::ordered_json to_json(const Description& description) {
  const FullMesh& full = description.full;
  const bool has_one = !description.has_every_range;
  nlohmann::ordered_json json{
      {"name", description.name},
      {"scope", has_one ? "one" : "every"},
  };
  add_grid(json, description.grid, description.labels);
  json["channels"] = to_json(description.channels);
  json["values"] = {{"least", description.format.least()}, {"greatest", description.format.greatest()}};
  json["step"] = description.is_exact ? 0.0 : description.format.step;
  json["max_error"] = number(description.max_error);
  json["updates"] = description.updates;
  if (has_one) {
    json["range"] = to_json(description.range);
    json["refine"] = description.refine == Refine::uniform ? "uniform" : "boundary";
    json["coefficients"] = description.coefficients;
    json["full"] = {{"vertices", full.vertices}, {"tets", full.tets}, {"indexed_bytes", full.indexed_bytes()}};
  }
  return json;
}

}  // namespace intervale

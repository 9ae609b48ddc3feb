#include "server/volume/header_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/volume/raw_reader.h"

namespace intervale {
namespace {

using Json = nlohmann::json;

std::string text_at(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string label_at(const Json& line, const char* key) {
  std::string text = text_at(line, key);
  return is_label(text) ? text : std::string();
}

}  // namespace

std::string header_line(const VolumeHeader& header) {
  Json parts = Json::array();
  for (const VolumePart& part : header.parts) parts.push_back({{"name", part.name}, {"about", part.about}});
  const Json line{{"dims", header.grid.dims},      {"affine", header.grid.affine.rows}, {"type", name_of(header.type)},
                  {"unit", header.labels.unit},    {"field", header.labels.field},      {"field_unit", header.labels.field_unit},
                  {"space", header.labels.space},  {"time_points", header.time_points}, {"slope", header.slope},
                  {"intercept", header.intercept}, {"parts_are", header.parts_are},     {"parts", parts}};
  return line.dump(-1, ' ', true, Json::error_handler_t::replace);  // texts of files may be no UTF-8
}

Result<VolumeHeader> parse_header_line(std::string_view text, const std::string& where) try {
  const Json line = Json::parse(text);
  VolumeHeader header;
  const auto type = parse_sample_type(line.at("type").get<std::string>());
  if (!type) return tl::unexpected<Error>(type.error());
  header.type = *type;
  const auto grid = make_grid(line.at("dims").get<std::array<std::int64_t, 3>>(), Affine{line.at("affine").get<std::array<double, 12>>()}, where);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  header.labels = {label_at(line, "unit"), label_at(line, "field"), label_at(line, "field_unit"), label_at(line, "space")};
  header.time_points = line.at("time_points").get<std::uint64_t>();
  header.slope = line.at("slope").get<double>();
  header.intercept = line.at("intercept").get<double>();
  if (!std::isfinite(header.slope) || !std::isfinite(header.intercept) || header.slope == 0)
    return fail(where + ": values are no multiples of its stored numbers");
  header.parts_are = text_at(line, "parts_are");
  for (const Json& part : line.at("parts")) header.parts.push_back({text_at(part, "name"), text_at(part, "about")});
  if (auto size = check_size(header, where); !size) return tl::unexpected<Error>(size.error());
  return header;
} catch (const Json::exception&) {
  return fail(where + ": its reader says what is no header");
}

}  // namespace intervale

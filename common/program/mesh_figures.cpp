#include "common/program/mesh_figures.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "common/mesh/mesh_digest.h"
#include "common/program/describe.h"

namespace intervale {

MeshFigures figures_of(const Mesh& mesh, std::uint64_t updates, bool has_digest, const std::optional<Range>& range) {
  MeshFigures figures{updates, mesh.points.size(), mesh.tets.size(), volume_of(mesh), {}, range};
  if (has_digest) figures.digest = mesh_digest(mesh);
  return figures;
}

nlohmann::ordered_json to_json(const MeshFigures& figures) {
  nlohmann::ordered_json json;
  if (figures.range) json["range"] = to_json(*figures.range);
  json["updates"] = figures.updates;
  json["vertices"] = figures.vertices;
  json["tets"] = figures.tets;
  json["volume"] = figures.volume;
  if (figures.digest) json["digest"] = *figures.digest;
  return json;
}

nlohmann::ordered_json to_json(std::span<const MeshFigures> each) {
  auto list = nlohmann::ordered_json::array();
  for (const MeshFigures& one : each) list.push_back(to_json(one));
  return list;
}

std::string to_text(const MeshFigures& figures) {
  return fmt::format("{} updates, {} vertices, {} tetrahedra, volume {:.6g}", figures.updates, figures.vertices, figures.tets, figures.volume);
}

std::string to_text(std::span<const MeshFigures> each) {
  std::string text;
  for (const MeshFigures& one : each) {
    if (one.range) text += fmt::format("[{:g}, {:g}]: ", one.range->alpha, one.range->beta);
    text += to_text(one) + (one.digest ? ", digest " + *one.digest : std::string()) + "\n";
  }
  return text;
}

}  // namespace intervale

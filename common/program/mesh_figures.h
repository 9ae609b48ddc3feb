// What programs report of the meshes that they make.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/patch/description.h"

namespace intervale {

struct MeshFigures {
  std::uint64_t updates = 0, vertices = 0, tets = 0;
  double volume = 0;                  // world units cubed
  std::optional<std::string> digest;  // if asked for
  std::optional<Range> range;         // of one of several meshes
};

// range: empty for the mesh of all ranges. O(tetrahedra).
[[nodiscard]] MeshFigures figures_of(const Mesh& mesh, std::uint64_t updates, bool has_digest, const std::optional<Range>& range = {});

// range (of one of several), updates, vertices, tets, volume, digest (if there is one).
[[nodiscard]] nlohmann::ordered_json to_json(const MeshFigures& figures);
[[nodiscard]] nlohmann::ordered_json to_json(std::span<const MeshFigures> each);  // a list
// One line: "1 updates, 2 vertices, 3 tetrahedra, volume 4".
[[nodiscard]] std::string to_text(const MeshFigures& figures);
// A line for each range, with its digest if there is one.
[[nodiscard]] std::string to_text(std::span<const MeshFigures> each);

}  // namespace intervale

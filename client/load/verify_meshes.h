// Whether clients have the right meshes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "client/core/stream_client.h"
#include "common/front/front.h"
#include "common/mesh/mesh.h"
#include "common/view/lod.h"

namespace intervale {

// What a client has at its end.
struct LoadedMesh {
  StreamClient client;
  Lod view;                  // the last that it asked for
  bool is_complete = false;  // and received all of
};

struct Verified {
  std::uint64_t compared = 0;   // all meshes that are there
  std::uint64_t differing = 0;  // of those
};

// Compares with the meshes of the whole stream, one for each range. A mesh depends only on which diamonds are split, so a
// client's is right if the reference has all of its splits. For up to four clients, chosen by the seed, this is not
// taken for granted: the reference is coarsened to the client's splits, and the meshes themselves are compared. O(splits)
// for each client and range, and a copy of the reference for each of the four.
[[nodiscard]] Verified verify_meshes(std::span<const Front> reference, std::span<const std::optional<LoadedMesh>> clients, std::uint64_t seed);

// Whether the mesh of a client that has seen other ranges, too, is right for the range that it shows now. whole: the mesh
// of the whole stream of this range. fresh: what a client has that asked for this range alone, with the same view; null
// if that view was not served to the end. The client may have more than that, of which earlier ranges needed more: its
// mesh is that of the whole stream, coarsened to the client's splits, and it has all splits that the fresh one has.
[[nodiscard]] bool is_mesh_of_range(Front whole, const Front* fresh, const Front& front);

// Whether two meshes have the same points and tetrahedra, in any order. O(n log n).
[[nodiscard]] bool are_equal(const Mesh& a, const Mesh& b);

}  // namespace intervale

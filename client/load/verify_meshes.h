// Whether clients have the meshes that they should.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "client/core/stream_client.h"
#include "common/front/front.h"
#include "common/mesh/mesh.h"

namespace intervale {

struct Verified {
  std::uint64_t compared = 0;   // all that are there
  std::uint64_t differing = 0;  // of those
};

// Compares with the mesh of the whole stream. A mesh depends only on which diamonds are split, so a client's is right if all of its splits are the
// reference's. That law is not taken on trust: for up to four of the clients, chosen by seed, the reference is coarsened to what the client has
// split, and the meshes are compared themselves. O(splits) for each client, and a copy of the reference for each of the four.
[[nodiscard]] Verified verify_meshes(const Front& reference, std::span<const std::optional<StreamClient>> clients, std::uint64_t seed);

// Whether two meshes have the same points and tetrahedra, in any order. O(n log n).
[[nodiscard]] bool are_equal(const Mesh& a, const Mesh& b);

}  // namespace intervale

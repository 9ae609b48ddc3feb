// Whether clients have the right meshes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "client/core/stream_client.h"
#include "common/front/front.h"
#include "common/mesh/mesh.h"

namespace intervale {

struct Verified {
  std::uint64_t compared = 0;   // all meshes that are there
  std::uint64_t differing = 0;  // of those
};

// Compares with the meshes of the whole stream, one for each range. A mesh depends only on which diamonds are split, so a
// client's is right if the reference has all of its splits. For up to four clients, chosen by the seed, this is not
// taken for granted: the reference is coarsened to the client's splits, and the meshes themselves are compared. O(splits)
// for each client and range, and a copy of the reference for each of the four.
[[nodiscard]] Verified verify_meshes(std::span<const Front> reference, std::span<const std::optional<StreamClient>> clients, std::uint64_t seed);

// Whether two meshes have the same points and tetrahedra, in any order. O(n log n).
[[nodiscard]] bool are_equal(const Mesh& a, const Mesh& b);

}  // namespace intervale

// What a client tells its server about what its mesh hides: see ClientSession::wants_depth_map().
#pragma once

#include <cstdint>
#include <optional>

#include "client/core/stream_client.h"
#include "common/view/depth_map.h"
#include "common/view/lod.h"

namespace intervale {

inline constexpr std::uint64_t kMostUpdatesOfMap = 250'000;  // of a mesh that is drawn: a fifth of a second

// What this camera, which check_lod lets pass, sees of the surfaces of a client's mesh. None if that would take too long.
// O(mesh).
[[nodiscard]] std::optional<DepthMap> draw_depth_map(const StreamClient& client, const Camera& camera);

}  // namespace intervale

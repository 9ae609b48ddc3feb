// A mesh from a server, by one call that ends when all of it is here.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "client/net/url.h"
#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/mesh/mesh.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

struct FetchProgress {
  std::uint64_t updates = 0;        // applied
  std::uint64_t updates_to_go = 0;  // at most
  std::uint64_t tets = 0;           // of the mesh
  std::uint64_t bytes = 0;          // received
  double remaining_error = 0;       // of what is wanted and not here yet, in the field's units
};

struct FetchMeshOptions {
  Access access = {};
  // The most bytes of messages that are received; the mesh is then as fine as they allow. Only the first message, the
  // data set's description, may exceed it.
  std::optional<std::uint64_t> max_bytes = {};
  std::chrono::seconds reconnect{30};  // how long to try to reach a lost server again; 0: not at all
  // After each batch, on the calling thread.
  std::function<void(const FetchProgress&)> on_progress = {};
  // One line that the user should read; the stream goes on.
  std::function<void(const std::string&)> on_notice = {};
};

struct FetchedMesh {
  Mesh mesh;
  DataSetInfo info;
  bool is_complete = false;  // false: a budget ended it
  std::uint64_t updates = 0;
  std::uint64_t bytes = 0;        // of messages, without WebSocket framing
  double seconds_first_mesh = 0;  // from the start until there was a tetrahedron
  double seconds = 0;
};

// url: ws://HOST:PORT/NAME, or wss://. Blocks until all that is wanted has arrived, or a budget is spent. When the server
// is lost, it connects again and receives nothing twice. Errors are one line.
[[nodiscard]] INTERVALE_EXPORT Result<FetchedMesh> fetch_mesh(std::string_view url, const MeshRequest& request, const FetchMeshOptions& options = {});

// The answer to GET /api/datasets: the server's data sets, as JSON.
[[nodiscard]] INTERVALE_EXPORT Result<std::string> list_data_sets(std::string_view url, const Access& access = {});

}  // namespace intervale

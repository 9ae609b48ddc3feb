// A mesh that refines while one looks at it, received on a thread of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "client/net/url.h"
#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/mesh/mesh.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

struct LiveMeshOptions {
  Access access = {};
  std::chrono::seconds reconnect{30};  // how long to try to reach a lost server again; 0: not at all
  // Once a view is complete, ask for every other range at 10 % of the largest error, too, so that a change of the range
  // finds something at once.
  bool prefetch_ranges = false;
};

// The mesh at one moment: conforming, without cracks.
struct MeshState {
  std::shared_ptr<const Mesh> mesh;  // never null; nobody changes it
  bool is_done = false;              // all that the last look() wants is here, or all that there is room for
  double remaining_error = 0;        // of what is wanted and not here yet, in the field's units
  double remaining_pixels = 0;       // the same on the camera's screen; 0 without one
  std::uint64_t updates = 0;         // received
  std::uint64_t bytes = 0;           // of messages received
};

// All functions may be called from any thread.
class INTERVALE_EXPORT LiveMesh {
 public:
  // url: as of fetch_mesh(). Waits until the server has described the data set, for seconds at most.
  [[nodiscard]] static Result<LiveMesh> connect(std::string_view url, const MeshRequest& request, const LiveMeshOptions& options = {});
  LiveMesh(LiveMesh&&) noexcept;
  LiveMesh& operator=(LiveMesh&&) noexcept;
  ~LiveMesh();  // closes the connection, which takes seconds at most

  [[nodiscard]] DataSetInfo info() const;

  // What is wanted from now on: another camera, range, error. The mesh changes to it with what is here; the server sends
  // what is missing, and nothing twice. Fails, and changes nothing, if the data set has not all of it.
  [[nodiscard]] Result<void> look(const MeshRequest& request);

  // The mesh as it is now, if it changed since the last call; does not wait. Making it takes time linear in its size, on
  // the other thread; while updates arrive, at most a tenth of that thread's time: so it may lag behind. Once none has
  // arrived for as long as the last one took, it is made. Fails once the stream has ended with an error, and every time
  // then.
  [[nodiscard]] Result<std::optional<MeshState>> poll();
  // The same, but waits for a change, up to that long.
  [[nodiscard]] Result<std::optional<MeshState>> wait(std::chrono::milliseconds time);

 private:
  class Worker;
  explicit LiveMesh(std::unique_ptr<Worker> worker);
  std::unique_ptr<Worker> worker_;
};

}  // namespace intervale

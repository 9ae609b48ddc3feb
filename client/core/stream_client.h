// The client's side of a stream, without I/O: descriptions and batches in, a mesh out. It never sees the field.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/core/budget.h"
#include "common/description.h"
#include "common/front.h"
#include "common/mesh.h"
#include "common/result.h"

namespace intervale {

class StreamClient {
 public:
  // Takes a description from outside: everything in it is checked. The mesh is then the root's patch.
  static Result<StreamClient> start(Description description, std::optional<std::uint64_t> max_tets = {});

  // Applies one batch (the payload of a Batch). After every successful call the mesh is conforming. A payload that is damaged,
  // or does not fit what came so far, is an error, and this object must not be used again. Where the mesh has no room for more below max_tets, what
  // comes is kept; in the mesh stays what came first, or once look() was called, what matters most.
  Result<void> apply(std::span<const std::uint8_t> payload);

  // Where the mesh is seen from, from now on. camera: one that check_lod lets pass.
  void look(const Camera& camera);

  [[nodiscard]] bool over_budget() const;       // not all that came is in the mesh
  [[nodiscard]] std::uint64_t updates() const;  // that came so far
  [[nodiscard]] std::uint64_t updates_in_mesh() const;
  [[nodiscard]] std::uint64_t tet_count() const;  // of the mesh now; O(1)
  [[nodiscard]] const Description& description() const;
  [[nodiscard]] std::vector<SlotGroup> splits() const { return front_.splits(); }  // what to resume with; see Front::splits
  [[nodiscard]] const Front& front() const;
  [[nodiscard]] Mesh mesh() const;  // linear in the size of the mesh

 private:
  explicit StreamClient(Description description, Front front);
  Description description_;
  Front front_;
  std::uint64_t max_tets_ = ~std::uint64_t(0);
  Importance importance_;  // of what is looked at; none before
};

}  // namespace intervale

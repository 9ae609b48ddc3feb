// The client's side of a stream, without I/O: descriptions and batches in, a mesh out. It never sees the field.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

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
  // or does not fit the mesh so far, is an error, and this object must not be used again. Stops applying (see over_budget) when max_tets would be
  // passed.
  Result<void> apply(std::span<const std::uint8_t> payload);

  [[nodiscard]] bool over_budget() const;         // an update was left out for max_tets: nothing more will be applied
  [[nodiscard]] std::uint64_t updates() const;    // applied so far
  [[nodiscard]] std::uint64_t tet_count() const;  // of the mesh now; O(1)
  [[nodiscard]] const Description& description() const;
  [[nodiscard]] std::vector<SlotGroup> splits() const { return front_.splits(); }  // what to resume with; see Front::splits
  [[nodiscard]] const Front& front() const;
  [[nodiscard]] Mesh mesh() const;  // linear in the size of the mesh

 private:
  explicit StreamClient(Description description, Front front);
  Description description_;
  Front front_;
  std::optional<std::uint64_t> max_tets_;
  std::uint64_t updates_ = 0;
  bool over_budget_ = false;
};

}  // namespace intervale

// The client's side of a stream, without I/O: descriptions and batches in, a mesh out. It never sees the field.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/core/budget.h"
#include "common/front/front.h"
#include "common/mesh/mesh.h"
#include "common/patch/description.h"
#include "common/util/result.h"

namespace intervale {

// What a client keeps at most.
struct Budget {
  std::uint64_t max_tets = ~std::uint64_t(0);     // in its mesh
  std::uint64_t max_updates = ~std::uint64_t(0);  // in the mesh and beside it; some 30 bytes each. The server is to be told, as View::room.
  friend bool operator==(const Budget&, const Budget&) = default;
};

class StreamClient {
 public:
  // Takes a description from outside: everything in it is checked. The mesh is then the root's patch.
  static Result<StreamClient> start(Description description, const Budget& budget = {});

  // Applies one batch: the payload of a Batch, and the epoch of the view that it is for. After every successful call the mesh is conforming. A
  // payload that is damaged, or does not fit what came so far, is an error, and this object must not be used again. Where the mesh has no room for
  // more below max_tets, what comes is kept; in the mesh stays what came first, or once look() was called, what matters most.
  Result<void> apply(std::span<const std::uint8_t> payload, std::uint64_t epoch = 0);

  // Where the mesh is seen from, from now on. camera: one that check_lod lets pass.
  void look(const Camera& camera);

  // From now on, max_tets; from the first answer to the view of this epoch on, max_updates too if that is fewer than before.
  void set_budget(const Budget& budget, std::uint64_t epoch);

  // What the View of this epoch is to forget, so that a quarter of max_updates is free for what it wants: what matters least, of no more than
  // max_supercubes. Nothing while so much is free, or while the answer to an earlier one has not come, or before look(). It is kept until
  // arrived(epoch): what is on its way was made for a client that has it.
  [[nodiscard]] std::vector<SlotGroup> give_up(std::uint64_t epoch, std::size_t max_supercubes);
  // A Done of this epoch has come, or a Batch: apply() does the same.
  void arrived(std::uint64_t epoch);

  [[nodiscard]] bool over_budget() const;       // not all that came is in the mesh
  [[nodiscard]] std::uint64_t updates() const;  // that came so far
  [[nodiscard]] std::uint64_t updates_in_mesh() const;
  [[nodiscard]] std::uint64_t tet_count() const;  // of the mesh now; O(1)
  [[nodiscard]] const Description& description() const;
  // What another session is to resume with; see Front::splits. What was to be given up in the last one stays.
  [[nodiscard]] std::vector<SlotGroup> resume() {
    forget_.clear();
    return front_.splits();
  }
  [[nodiscard]] const Front& front() const;
  [[nodiscard]] Mesh mesh() const;  // linear in the size of the mesh

 private:
  explicit StreamClient(Description description, Front front);
  void rebalance();
  bool forget(std::uint64_t epoch);
  void keep_to_budget(std::uint64_t epoch);
  Description description_;
  Front front_;
  Budget budget_;
  struct LessRoom {
    std::uint64_t epoch = 0, max_updates = 0;
  };
  std::optional<LessRoom> less_room_;
  Importance importance_;          // of what is looked at; none before
  std::vector<SlotGroup> forget_;  // with the first answer to the view of this epoch
  std::uint64_t forget_epoch_ = 0;
};

}  // namespace intervale

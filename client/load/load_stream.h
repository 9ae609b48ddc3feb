// What a client of a load receives: judged, counted and, if the plan says so, applied. No I/O.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "client/core/grants.h"
#include "client/core/stream_client.h"
#include "client/load/figures.h"
#include "client/load/load_plan.h"
#include "common/util/result.h"
#include "protocol/messages.h"

namespace intervale {

// Of one client, in one session after the other. Once something that came was an error, the client has failed; only take_mesh() and
// repeated_updates() make sense then.
class LoadStream {
 public:
  // Both outlive this; figures are added to.
  LoadStream(const LoadPlan& plan, LoadFigures& figures) : plan_(plan), figures_(figures), grants_(UINT64_MAX, plan.window) {}

  void begin_again();  // another session, with what there is

  // What a session begins with: Open, with the first grant, and what the client has, if it resumes.
  [[nodiscard]] std::vector<protocol::ClientMessage> greeting();
  // The message that asks for a view, to be sent before this is called again.
  [[nodiscard]] protocol::View ask(std::uint64_t epoch, const Lod& lod);
  // A mesh with a budget keeps what matters most from where it is seen.
  void look(const std::optional<Camera>& camera);

  // What comes. round_trip: from Open. size: of the whole message. newest: the epoch of the last view that was due.
  Result<void> take(protocol::Opened opened, std::size_t size, LoadClock::duration round_trip);
  Result<void> take(const protocol::Batch& batch, std::uint64_t newest);  // checked and counted
  Result<void> apply(const protocol::Batch& batch);                       // ... then applied
  Result<void> take(const protocol::Done& done, std::uint64_t newest);

  // What to grant more, 0 for nothing, now that a batch is applied.
  [[nodiscard]] std::uint64_t grant(const protocol::Batch& batch, LoadClock::time_point now);

  [[nodiscard]] bool shows_nothing() const { return mesh_ && mesh_->tet_count() == 0; }
  [[nodiscard]] std::uint64_t repeated_updates() const;                 // that came though the client had them, if it applies any
  std::optional<StreamClient> take_mesh() { return std::move(mesh_); }  // nothing if the plan wants none, or a batch did not apply

 private:
  void arrived(std::uint64_t epoch);

  const LoadPlan& plan_;
  LoadFigures& figures_;
  Grants grants_;
  std::optional<StreamClient> mesh_;
  std::optional<Camera> camera_;
  std::uint64_t least_tets_ = 0;  // of the mesh without any update: no budget makes it smaller
  bool opened_ = false;
  std::uint64_t sequence_ = 0;   // of the next batch
  std::uint64_t epoch_ = 0;      // of the last message
  std::uint64_t updates_ = 0;    // that the client has
  std::uint64_t received_ = 0;   // in all sessions
  std::uint64_t forgotten_ = 0;  // of those
};

}  // namespace intervale

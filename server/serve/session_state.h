// A streaming session without its socket: messages in, messages out, by PROTOCOL.md. No I/O.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/selection/stream_plan.h"
#include "protocol/limits.h"
#include "protocol/messages.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/catalogue.h"

namespace intervale {

// One thread at a time. `catalogue` must outlive it; what was opened stays, whatever becomes of that.
class SessionState {
 public:
  // scope: what may be opened; nullptr: nothing.
  SessionState(const AtomicSharedPtr<Catalogue>& catalogue, std::shared_ptr<const Scope> scope) : catalogue_(catalogue), scope_(std::move(scope)) {}

  // Takes a client's message. A fault ends the session: nothing else may be called after.
  [[nodiscard]] std::optional<protocol::Fault> receive(const protocol::ClientMessage& message);

  // The next message to send, or nothing for now; has_work() tells whether to ask again. While it does, this takes a few milliseconds: about one for
  // each 16 KiB of max_payload, which bounds the size of a batch. A view with a budget of updates takes time linear in the data set's updates first.
  [[nodiscard]] std::optional<protocol::ServerMessage> next(std::size_t max_payload = protocol::kMaxBatchPayload);

  // There is a batch to choose and pack, or to be looked for further.
  [[nodiscard]] bool has_work() const { return announced_ && viewing_ && !done_ && !needs_credit(); }
  // Nothing was sent yet in answer to the last view.
  [[nodiscard]] bool view_is_unanswered() const { return fresh_; }
  [[nodiscard]] bool opened() const { return volume_ != nullptr; }
  [[nodiscard]] bool needs_credit() const { return viewing_ && !done_ && credit_ < protocol::kMinCredit; }  // sends only once there is more credit
  [[nodiscard]] const std::string& dataset() const { return dataset_; }
  [[nodiscard]] std::uint64_t updates_sent() const { return plan_ ? plan_->sent() : 0; }

 private:
  std::optional<protocol::Fault> on(const protocol::Open& open);
  std::optional<protocol::Fault> on(const protocol::View& view);
  std::optional<protocol::Fault> on(const protocol::Credit& credit);
  std::optional<protocol::Fault> on(const protocol::Have& have);
  std::optional<protocol::Fault> grant(std::uint64_t bytes);
  std::optional<protocol::ServerMessage> next_batch_or_done(std::size_t max_payload);

  const AtomicSharedPtr<Catalogue>& catalogue_;
  std::shared_ptr<const Scope> scope_;
  Catalogue::Volume volume_;
  std::string dataset_;
  std::optional<StreamPlan> plan_;
  std::optional<Lod> asked_;  // a view that the plan has not taken up yet
  std::uint64_t epoch_ = 0;
  std::uint64_t credit_ = 0;  // outstanding
  std::uint64_t last_grant_ = 0;
  std::uint64_t sequence_ = 0;  // of the next batch
  std::size_t target_ = 0;      // payload of the next batch, if credit allows
  bool resumed_ = false;        // the client has updates of this very data
  bool announced_ = false;      // Opened was sent
  bool viewing_ = false;        // a View came
  bool fresh_ = false;          // nothing was sent yet for epoch_
  bool done_ = false;           // Done was sent for epoch_
};

}  // namespace intervale

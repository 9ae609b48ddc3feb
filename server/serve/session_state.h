// The state of a streaming session: messages in, messages out, as PROTOCOL.md says. No I/O.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/selection/stream_plan.h"
#include "protocol/limits.h"
#include "protocol/messages.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/background.h"
#include "server/serve/catalogue.h"
#include "server/serve/range_cache.h"

namespace intervale {

// One thread at a time. `catalogue` must outlive the session, which keeps the data set that it opened when the
// catalogue changes.
class SessionState {
 public:
  // scope: the data sets that may be opened; nullptr: none. payer: of what ranges and background do for it; both must
  // outlive the session, too.
  SessionState(const AtomicSharedPtr<Catalogue>& catalogue, RangeCache& ranges, Background& background, std::shared_ptr<const Scope> scope,
               Background::Payer payer)
      : catalogue_(catalogue), ranges_(ranges), background_(background), scope_(std::move(scope)), payer_(std::move(payer)) {}

  // Before the first message. wake: called on another thread when a session that waits() should go on; perhaps also
  // later, even after the session.
  void set_wake(std::function<void()> wake) { wake_ = std::move(wake); }

  // Handles a client's message. A fault ends the session: call nothing afterwards.
  [[nodiscard]] std::optional<protocol::Fault> receive(const protocol::ClientMessage& message);

  // The next message to send. nullopt: none now; call again if has_work(). max_payload bounds a batch's payload. With
  // has_work() a call takes about a millisecond, and another one for each 16 KiB of max_payload.
  [[nodiscard]] std::optional<protocol::ServerMessage> next(std::size_t max_payload = protocol::kMaxBatchPayload);

  // There may be a batch to select and encode.
  [[nodiscard]] bool has_work() const { return opened_was_sent_ && is_streaming() && !needs_credit() && !waits(); }
  // Until it is known what new ranges need, how far their surfaces move, or what is within a budget.
  [[nodiscard]] bool waits() const {
    return waits_ && !(estimate_ && estimate_->is_ready()) && !(measurement_ && measurement_->is_ready()) && !(search_ && search_->is_done());
  }
  // Nothing was sent yet for the last view.
  [[nodiscard]] bool view_is_unanswered() const { return view_ == ViewState::unanswered; }
  [[nodiscard]] bool opened() const { return volume_ != nullptr; }
  // Sends nothing until the client grants more credit.
  [[nodiscard]] bool needs_credit() const { return is_streaming() && credit_ < protocol::kMinCredit; }
  [[nodiscard]] const std::string& dataset() const { return dataset_; }
  [[nodiscard]] std::uint64_t memory_bytes() const { return plan_ ? plan_->memory_bytes() : 0; }  // besides what is shared
  [[nodiscard]] std::uint64_t updates_sent() const { return plan_ ? plan_->sent() : 0; }

 private:
  // Of the last view: there is none yet; nothing, or something, was sent for it; Done was sent, and coarse updates of
  // every range follow; nothing more follows.
  enum class ViewState { none, unanswered, streaming, ahead, done };

  [[nodiscard]] bool is_streaming() const { return view_ != ViewState::none && view_ != ViewState::done; }
  std::optional<protocol::Fault> on(const protocol::Open& open);
  std::optional<protocol::Fault> on(const protocol::View& view);
  std::optional<protocol::Fault> on(const protocol::Credit& credit);
  std::optional<protocol::Fault> on(const protocol::Have& have);
  std::optional<protocol::Fault> grant(std::uint64_t bytes);
  bool begin_view();
  [[nodiscard]] bool is_searching();
  bool estimate();
  bool measure();
  [[nodiscard]] bool goes_ahead() const;
  void begin_ahead();
  void set_relevant(const RangeCache::Relevant& relevant, bool is_measured);

  const AtomicSharedPtr<Catalogue>& catalogue_;
  RangeCache& ranges_;
  Background& background_;
  std::shared_ptr<const Scope> scope_;
  Background::Payer payer_;
  Catalogue::Volume volume_;
  std::string dataset_;
  std::optional<StreamPlan> plan_;
  Lod lod_;                                                           // of the last view
  ShownRanges shown_;                                                 // of the last view, as distinct() gives them
  std::uint64_t may_have_ = 0;                                        // updates, and values of channels, that Have may still name
  std::uint64_t room_ = 0;                                            // of the last view
  std::optional<double> coarse_percent_;                              // likewise
  std::optional<double> ahead_percent_;                               // the client has every range down to this error
  bool is_early_ = false;                                             // the last view takes estimates
  bool is_new_ = false;                                               // the plan does not have the last view yet, or what goes ahead
  ShownRanges planned_;                                               // that the plan has; none while it goes ahead
  bool is_measured_ = true;                                           // how far surfaces move, of those
  std::shared_ptr<const RangeCache::Answer> estimate_, measurement_;  // of shown_; nullptr if there is no need
  std::shared_ptr<BudgetSearch> search_;                              // of the plan; nullptr: none is under way
  bool waits_ = false;                                                // nothing more can be sent before one of them is ready
  std::function<void()> wake_ = [] {};
  std::uint64_t epoch_ = 0;
  std::uint64_t credit_ = 0;  // outstanding
  std::uint64_t last_grant_ = 0;
  std::uint64_t sequence_ = 0;  // of the next batch
  std::size_t target_ = 0;      // payload of the next batch, if credit allows
  bool resumed_ = false;        // the client has updates of this data set, with the same contents
  bool opened_was_sent_ = false;
  ViewState view_ = ViewState::none;
};

}  // namespace intervale

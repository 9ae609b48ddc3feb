// The sending side of a streaming session: messages in, messages out, as PROTOCOL.md says. No I/O. A server has one for
// each connection; where a data set is read from a file and shown in the same place, the client's side is connected to it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/selection/stream_plan.h"
#include "protocol/limits.h"
#include "protocol/messages.h"
#include "protocol/session/session_worker.h"

namespace intervale {

// One thread at a time.
class SessionState {
 public:
  using Volume = std::shared_ptr<const IntervalVolume>;
  // The data set of a name, or why the client does not get it. The session keeps what it opened; but one that is not whole
  // (IntervalVolume::is_whole()) is asked for again, until more of the same contents is found.
  using Find = std::function<tl::expected<Volume, protocol::Fault>(const std::string& name)>;

  // Of a data set that is not whole: it grows by itself, and a view is complete once it is whole; or it grows where
  // lacks_scales() says so, and a view is complete with the scales that it wants by estimates (estimates_want_finer()).
  enum class Growth { by_itself, on_demand };

  // worker: must outlive the session. Where waits() says so, it must be called again when the worker has done something.
  SessionState(Find find, SessionWorker& worker, Growth growth = Growth::by_itself) : find_(std::move(find)), worker_(worker), growth_(growth) {}

  // Handles a client's message. A fault ends the session: call nothing afterwards. A Have that names updates of a data set
  // that is not whole, and has not all of them yet, waits until it has grown, as do the views after it.
  [[nodiscard]] std::optional<protocol::Fault> receive(const protocol::ClientMessage& message);

  // The next message to send. nullopt: none now; call again if has_work(). A fault ends the session, as that of receive():
  // the rest of a data set that was not whole is not to be had. max_payload bounds a batch's payload. With
  // has_work() a call takes some milliseconds at most; with less than the default, a third of a millisecond and what it
  // takes to code the batch, or a millisecond that finds nothing.
  [[nodiscard]] std::optional<protocol::ServerMessage> next(std::size_t max_payload = protocol::kMaxBatchPayload);

  // Nothing that is still to come of the data set is wanted by the last view (wants_finer()), or nothing more comes:
  // the view is done with what is there. With a camera, how far surfaces move is estimated.
  void end_growth() {
    is_grown_ = true;
    waits_ = false;
  }

  // Keeps little but what the client holds until the next view, if the last one's answer is complete (may_rest()). That
  // view takes some time more.
  void rest();
  [[nodiscard]] bool may_rest() const { return view_ == ViewState::done && !plan_->rests(); }

  // There may be a batch to select and encode, or a message that waited can be handled.
  [[nodiscard]] bool has_work() const { return opened_was_sent_ && (handles_held_ || (is_streaming() && !needs_credit() && !waits())); }
  // Until it is known what new ranges need, how far their surfaces move, or what is within a budget; or until the data set
  // grows, which whoever calls next() has to find out.
  [[nodiscard]] bool waits() const {
    return waits_ && !(estimate_ && estimate_->is_ready()) && !(measurement_ && measurement_->is_ready()) && !(search_ && search_->is_done());
  }
  // Nothing was sent yet for the last view.
  [[nodiscard]] bool view_is_unanswered() const { return view_ == ViewState::unanswered; }
  // The last view cannot be completed, or the client cannot resume, before the data set grows. Of Growth::on_demand.
  [[nodiscard]] bool lacks_scales() const {
    return growth_ == Growth::on_demand && opened() && !volume_->is_whole() && (!held_.empty() || (is_streaming() && !is_grown_));
  }
  [[nodiscard]] bool opened() const { return volume_ != nullptr; }
  // What is there of the data set. nullptr before Open.
  [[nodiscard]] const Volume& volume() const { return volume_; }
  // Sends nothing until the client grants more credit.
  [[nodiscard]] bool needs_credit() const { return is_streaming() && credit_ < protocol::kMinCredit; }
  [[nodiscard]] const std::string& dataset() const { return dataset_; }
  // Besides what is shared.
  [[nodiscard]] std::uint64_t memory_bytes() const { return (plan_ ? plan_->memory_bytes() : 0) + held_bytes_; }
  [[nodiscard]] std::uint64_t updates_sent() const { return plan_ ? plan_->sent() : 0; }

 private:
  // Of the last view: there is none yet; nothing, or something, was sent for it; all that it wants at kCoarsePixels was, and
  // the coarsest updates of every range go before the rest of it; Done was sent, and coarse updates of every range follow;
  // nothing more follows.
  enum class ViewState { none, unanswered, streaming, ahead_of_rest, ahead, done };

  [[nodiscard]] bool is_streaming() const { return view_ != ViewState::none && view_ != ViewState::done; }
  std::optional<protocol::Fault> handle(const protocol::ClientMessage& message);
  [[nodiscard]] bool lacks_updates_of(const protocol::ClientMessage& message) const;
  std::optional<protocol::Fault> hold(const protocol::ClientMessage& message);
  std::optional<protocol::Fault> handle_held();
  std::optional<protocol::Fault> on(const protocol::Open& open);
  std::optional<protocol::Fault> on(const protocol::View& view);
  std::optional<protocol::Fault> on(const protocol::Credit& credit);
  std::optional<protocol::Fault> on(const protocol::Have& have);
  std::optional<protocol::Fault> grant(std::uint64_t bytes);
  tl::expected<bool, protocol::Fault> grow();
  bool begin_view();
  [[nodiscard]] bool is_searching();
  bool estimate();
  bool measure();
  [[nodiscard]] bool is_ahead() const { return view_ == ViewState::ahead || view_ == ViewState::ahead_of_rest; }
  [[nodiscard]] double percent_ahead(ViewState state) const;
  [[nodiscard]] bool lacks_ahead(ViewState state) const;
  [[nodiscard]] bool goes_ahead_of_rest() const;
  void begin_ahead();
  void end_ahead();
  protocol::Batch message_of(Batch batch);
  void set_relevant(const RangeAnswer::Relevant& relevant, bool is_measured);

  void find_growth();

  Find find_;
  SessionWorker& worker_;
  Growth growth_;
  Volume volume_;
  std::string dataset_;
  std::optional<StreamPlan> plan_;                             // none before Open
  Lod lod_;                                                    // of the last view
  std::optional<DepthMap> depth_;                              // likewise
  std::optional<Camera> ahead_;                                // likewise
  ShownRanges shown_;                                          // of the last view, as distinct() gives them
  std::uint64_t may_have_ = 0;                                 // updates, and values of channels, that Have may still name
  std::uint64_t room_ = 0;                                     // of the last view
  std::optional<double> coarse_percent_;                       // likewise
  std::optional<double> ahead_percent_;                        // the client has every range down to this error
  bool is_early_ = false;                                      // the last view takes estimates
  bool is_new_ = false;                                        // the plan does not have the last view yet, or what goes ahead
  StreamPlan::Remaining left_of_view_;                         // while something goes ahead of the rest of it; 0 after Done
  ShownRanges planned_;                                        // that the plan has; none while it goes ahead
  bool is_measured_ = true;                                    // how far surfaces move, of those
  std::shared_ptr<const RangeAnswer> estimate_, measurement_;  // of shown_; nullptr if there is no need
  std::shared_ptr<BudgetSearch> search_;                       // of the plan; nullptr: none is under way
  bool is_grown_ = false;                                      // the last view waits for no more growth
  bool waits_ = false;                                         // nothing more can be sent before one of them is ready
  std::uint64_t epoch_ = 0;
  std::uint64_t credit_ = 0;  // outstanding
  std::uint64_t last_grant_ = 0;
  std::uint64_t sequence_ = 0;                 // of the next batch
  std::size_t view_bytes_ = 0;                 // payloads of the view's batches; while other sessions wait, what these might have been
  std::size_t first_payload_ = kFirstPayload;  // of the view
  bool resumed_ = false;                       // the client has updates of this data set, with the same contents
  bool opened_was_sent_ = false;
  std::vector<protocol::ClientMessage> held_;  // Haves and Views that wait for the data set to grow, oldest first
  std::uint64_t held_bytes_ = 0;
  bool handles_held_ = false;  // it has grown since
  ViewState view_ = ViewState::none;
};

}  // namespace intervale

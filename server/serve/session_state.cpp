#include "server/serve/session_state.h"

#include <algorithm>
#include <utility>

namespace intervale {
namespace {

using protocol::CloseCode;
using protocol::Fault;

Fault fault(CloseCode code, std::string text) { return {code, std::move(text)}; }

}  // namespace

std::optional<Fault> SessionState::receive(const protocol::ClientMessage& message) {
  return std::visit([this](const auto& m) { return on(m); }, message);
}

std::optional<Fault> SessionState::on(const protocol::Open& open) {
  if (opened()) return fault(CloseCode::out_of_order, "Open came twice");
  // Before it is looked for: what is there is no one's business who may not see it.
  if (!scope_ || !scope_->allows(open.dataset)) return fault(CloseCode::forbidden, "this token does not open that data set");
  const auto catalogue = catalogue_.load();
  if (catalogue) volume_ = catalogue->find(open.dataset);
  if (!volume_) return fault(CloseCode::no_such_dataset, "no such data set; see /api/datasets");
  dataset_ = open.dataset;
  plan_.emplace(volume_);
  resumed_ = open.resume && *open.resume == volume_->description().content_hash;
  return grant(open.credit);
}

std::optional<Fault> SessionState::on(const protocol::Have& have) {
  if (!opened() || viewing_) return fault(CloseCode::out_of_order, "Have comes after Open and before the first View");
  if (!resumed_) return {};
  for (const SlotGroup& g : have.splits) {
    if (!plan_->resume(g.key, g.slots)) return fault(CloseCode::malformed, "the client has what the data set has not");
  }
  return {};
}

std::optional<Fault> SessionState::on(const protocol::View& view) {
  if (!opened()) return fault(CloseCode::out_of_order, "View before Open");
  if (viewing_ && view.epoch <= epoch_) return fault(CloseCode::out_of_order, "a View's epoch must be greater than the last one's");
  if (!plan_->forget(view.forget)) return fault(CloseCode::malformed, "the client gives up what the data set has not");
  plan_->set_room(view.room.value_or(UINT64_MAX));
  epoch_ = view.epoch;
  asked_ = view.lod;
  viewing_ = fresh_ = true;
  done_ = false;
  target_ = kFirstPayload;
  return {};
}

std::optional<Fault> SessionState::on(const protocol::Credit& credit) {
  if (!opened()) return fault(CloseCode::out_of_order, "Credit before Open");
  return grant(credit.bytes);
}

std::optional<Fault> SessionState::grant(std::uint64_t bytes) {
  if (bytes > protocol::kMaxWindow - credit_) return fault(CloseCode::too_large, "more credit than the largest window");
  credit_ += bytes;
  last_grant_ = bytes;
  return {};
}

std::optional<protocol::ServerMessage> SessionState::next(std::size_t max_payload) {
  if (!opened()) return {};
  if (!std::exchange(announced_, true)) return protocol::Opened{volume_->description(), {}, resumed_};
  if (!has_work()) return {};
  if (asked_) plan_->set_lod(*std::exchange(asked_, std::nullopt));
  auto message = next_batch_or_done(max_payload);
  if (message) fresh_ = false;
  return message;
}

std::optional<protocol::ServerMessage> SessionState::next_batch_or_done(std::size_t max_payload) {
  // Not all the credit at once: a line would run dry while the client's next grant is under way. Clients grant a quarter of their window or more, and
  // a batch takes half of its bound.
  const std::uint64_t bound =
      std::min({std::uint64_t(target_), std::uint64_t(max_payload), std::max<std::uint64_t>(protocol::kMinPayload, 2 * last_grant_)});
  const std::uint64_t size = std::min(bound, credit_ - protocol::kBatchEnvelope);  // credit_ >= kMinCredit
  auto batch = plan_->next(size);
  if (!batch) {
    if (!plan_->done()) return {};
    done_ = true;
    return protocol::Done{epoch_, plan_->sent(), plan_->is_full()};
  }
  target_ = std::min(2 * target_, protocol::kMaxBatchPayload);
  const StreamPlan::Remaining remaining = plan_->remaining();
  protocol::Batch message{epoch_, sequence_++, batch->updates, remaining.error, remaining.pixels, remaining.updates, std::move(batch->payload)};
  credit_ -= protocol::cost_of(message);  // at most what there was: next() keeps to size
  return message;
}

}  // namespace intervale

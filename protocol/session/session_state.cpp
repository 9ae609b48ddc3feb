#include "protocol/session/session_state.h"

#include <algorithm>
#include <bit>

#include "common/ivm/coarse_scales.h"

namespace intervale {

using protocol::CloseCode;
using protocol::Fault;

namespace {

// A client that reads batches of another version.
Fault other_version(std::uint32_t payload) {
  const std::uint32_t theirs = std::max(payload, 1u);  // 0: a client that does not say it, of version 1
  return {CloseCode::other_version, "the client reads batches of version " + std::to_string(theirs) + ", and this server sends version " +
                                        std::to_string(protocol::kPayloadVersion) +
                                        (theirs < protocol::kPayloadVersion ? ": update the client" : ": update the server")};
}

// Most memory of messages that wait for a data set to grow: Haves of some five million updates.
constexpr std::uint64_t kMostHeld = 4 << 20;

// Of a Have or a View.
std::uint64_t held_size(const protocol::ClientMessage& message) {
  if (const auto* const have = std::get_if<protocol::Have>(&message)) return sizeof(message) + have->splits.size() * sizeof(SlotGroup);
  const auto& view = std::get<protocol::View>(message);
  std::uint64_t bytes = sizeof(message) + view.forget.size() * sizeof(SlotGroup) + view.shown.ranges.size() * sizeof(Range);
  for (const std::string& name : view.channels) bytes += sizeof(std::string) + name.size();
  return bytes + (view.depth ? view.depth->codes.size() : 0);
}

// Once a view is so exact, updates of every range with at least such errors go ahead of the rest of it: few, so that it is
// not put off for long.
constexpr double kCoarsePixels = 16, kAheadOfRestPercent = 40;
constexpr std::uint64_t kAmpleRoom = 1 << 16;        // updates; in less room, most may be ancestors
constexpr std::uint32_t kContendedVisits = 8 << 10;  // while other sessions wait: a third of a millisecond

}  // namespace

std::optional<Fault> SessionState::receive(const protocol::ClientMessage& message) {
  const bool may_wait = std::holds_alternative<protocol::Have>(message) || std::holds_alternative<protocol::View>(message);
  return may_wait && (!held_.empty() || lacks_updates_of(message)) ? hold(message) : handle(message);
}

std::optional<Fault> SessionState::handle(const protocol::ClientMessage& message) {
  return std::visit([this](const auto& m) { return on(m); }, message);
}

// Whether it is a Have of updates that may be among those that are still to come.
bool SessionState::lacks_updates_of(const protocol::ClientMessage& message) const {
  const auto* const have = std::get_if<protocol::Have>(&message);
  if (have == nullptr || !resumed_ || volume_->is_whole()) return false;
  return !std::all_of(have->splits.begin(), have->splits.end(), [this](const SlotGroup& g) { return plan_->has(g); });
}

std::optional<Fault> SessionState::hold(const protocol::ClientMessage& message) {
  // A view that gives nothing up is over with the next one.
  if (std::holds_alternative<protocol::View>(message) && !held_.empty()) {
    const auto* const last = std::get_if<protocol::View>(&held_.back());
    if (last != nullptr && last->forget.empty()) {
      held_bytes_ -= held_size(held_.back());
      held_.pop_back();
    }
  }
  held_bytes_ += held_size(message);
  if (held_bytes_ > kMostHeld) return Fault{CloseCode::going_away, "the data set is being read"};
  held_.push_back(message);
  return {};
}

// The first that waits, if it need not wait any longer.
std::optional<Fault> SessionState::handle_held() {
  handles_held_ = !lacks_updates_of(held_.front());
  if (!handles_held_) return {};
  const protocol::ClientMessage message = std::move(held_.front());
  held_.erase(held_.begin());
  held_bytes_ -= held_size(message);
  handles_held_ = !held_.empty();
  return handle(message);
}

std::optional<Fault> SessionState::on(const protocol::Open& open) {
  if (opened()) return Fault{CloseCode::out_of_order, "a second Open"};
  if (open.payload != protocol::kPayloadVersion) return other_version(open.payload);
  auto found = find_(open.dataset);
  if (!found) return std::move(found).error();
  volume_ = *std::move(found);
  dataset_ = open.dataset;
  plan_.emplace(volume_);
  planned_ = {volume_->description().whole()};
  may_have_ = volume_->size() * (1 + std::uint64_t(volume_->description().channels.size()));
  resumed_ = open.resume && *open.resume == volume_->description().content_hash;
  return grant(open.credit);
}

// Whether there is more of a data set that was not whole. The description, which has a hash of the contents, stays: what
// is found under the name with another one, or not at all, has not the rest.
tl::expected<bool, Fault> SessionState::grow() {
  if (volume_->is_whole()) return false;
  const auto found = find_(dataset_);
  const bool has_more = found && (*found)->description() == volume_->description();
  if (!has_more && growth_ == Growth::on_demand && !lacks_scales()) return false;  // it keeps what it has
  if (!has_more) return tl::unexpected(Fault{CloseCode::going_away, "the rest of the data set could not be read"});
  if ((*found)->size() <= volume_->size()) return false;
  may_have_ += ((*found)->size() - volume_->size()) * (1 + std::uint64_t(volume_->description().channels.size()));
  const StreamPlan before(std::move(*plan_));
  volume_ = *found;
  plan_.emplace(volume_);
  plan_->resume(before);
  plan_->set_room(room_);
  planned_ = {volume_->description().whole()};
  is_measured_ = true;
  estimate_.reset();
  measurement_.reset();
  search_.reset();
  is_new_ = true;
  waits_ = false;
  handles_held_ = !held_.empty();
  find_growth();
  return true;
}

// Whether the last view wants what is still to come.
void SessionState::find_growth() {
  if (growth_ == Growth::on_demand) is_grown_ = !estimates_want_finer(*volume_, lod_);
}

void SessionState::rest() {
  if (!may_rest()) return;
  plan_->rest();
  search_.reset();
  depth_.reset();
}

std::optional<Fault> SessionState::on(const protocol::Have& have) {
  if (!opened() || view_ != ViewState::none) return Fault{CloseCode::out_of_order, "Have is allowed between Open and the first View only"};
  if (!resumed_) return {};
  if (have.channel && *have.channel >= volume_->description().channels.size())
    return Fault{CloseCode::malformed, "Have names a channel that the data set does not contain"};
  for (const SlotGroup& g : have.splits) {
    // Each update is named once, and each value of a channel: naming them again would be work for nothing.
    const auto named = std::uint64_t(std::popcount(g.slots));
    if (named > may_have_) return Fault{CloseCode::too_large, "Have names more updates than the data set contains"};
    may_have_ -= named;
    if (have.channel ? !plan_->resume(*have.channel, g.key, g.slots) : !plan_->resume(g.key, g.slots))
      return Fault{CloseCode::malformed, "Have names updates that the data set does not contain"};
  }
  plan_->settle();
  return {};
}

std::optional<Fault> SessionState::on(const protocol::View& view) {
  if (!opened()) return Fault{CloseCode::out_of_order, "View before Open"};
  if (view_ != ViewState::none && view.epoch <= epoch_)
    return Fault{CloseCode::out_of_order, "the epoch of a View must be greater than the last one"};
  ShownRanges shown = distinct(resolve(volume_->description(), view.shown));
  if (auto held = check_held(volume_->description(), shown); !held) return Fault{CloseCode::no_such_range, held.error().message};
  const auto channels = find_channels(volume_->description().channels, view.channels);
  if (!channels) return Fault{CloseCode::no_such_range, channels.error().message.substr(0, protocol::kMaxText)};
  if (!plan_->forget(view.forget)) return Fault{CloseCode::malformed, "View forgets updates that the data set does not contain"};
  if (!view.forget.empty()) ahead_percent_.reset();
  room_ = view.room.value_or(UINT64_MAX);
  plan_->set_room(room_);
  plan_->set_channels(*channels);
  coarse_percent_ = view.coarse_error_percent;
  epoch_ = view.epoch;
  const bool is_other_range = shown_ != shown, is_other_view = lod_ != view.lod || is_other_range;
  lod_ = view.lod;
  depth_ = view.depth;
  ahead_ = view.ahead;
  if (is_other_range || !lod_.camera) measurement_.reset();
  if (is_other_range) estimate_.reset();
  if (is_other_view) search_.reset();  // if it is done, it would say that nothing is waited for
  shown_ = std::move(shown);
  is_early_ = view.early;
  is_grown_ = false;
  find_growth();
  is_new_ = true;
  waits_ = false;
  if (is_other_view || view_ == ViewState::none) {
    view_bytes_ = 0;
    first_payload_ = is_other_range && plan_->sent() != 0 ? kFirstPayloadOfRange : kFirstPayload;
  }
  view_ = ViewState::unanswered;
  return {};
}

std::optional<Fault> SessionState::on(const protocol::Credit& credit) {
  if (!opened()) return Fault{CloseCode::out_of_order, "Credit before Open"};
  return grant(credit.bytes);
}

std::optional<Fault> SessionState::grant(std::uint64_t bytes) {
  if (bytes > protocol::kMaxWindow - credit_) return Fault{CloseCode::too_large, "the credit exceeds the largest window"};
  credit_ += bytes;
  last_grant_ = bytes;
  return {};
}

void SessionState::set_relevant(const RangeAnswer::Relevant& relevant, bool is_measured) {
  plan_->set_relevant(relevant);
  planned_ = shown_;
  is_measured_ = is_measured;
}

// Without a camera distances do not matter. With one, a view that takes estimates begins with them, since the line would be
// idle until they are measured; then it is completed. Other views wait for that. False if this one does.
bool SessionState::begin_view() {
  const bool is_planned = planned_ == shown_;
  const bool has_needed = is_planned && (is_measured_ || !lod_.camera);
  if (!is_new_ && has_needed) return true;
  if (!has_needed && lod_.camera && measure()) {
    is_new_ = true;
  } else {
    const bool is_estimate = measurement_ || (!volume_->is_whole() && !is_grown_);
    const bool needs_measured = is_estimate && (!is_early_ || lod_.max_updates || (measurement_ && measurement_->is_soon()));
    if (needs_measured || (!is_planned && !estimate())) return false;
  }
  if (std::exchange(is_new_, false)) plan_->set_lod(lod_, depth_ ? &*depth_ : nullptr, ahead_ ? &*ahead_ : nullptr);
  return true;
}

// Whether distances of the view's ranges are estimated: the plan has them then.
bool SessionState::estimate() {
  if (!estimate_) estimate_ = worker_.ask(volume_, shown_, Distances::estimated);
  if (!estimate_->is_ready()) return false;
  set_relevant(std::exchange(estimate_, nullptr)->result(), shown_ == ShownRanges{volume_->description().whole()});
  return true;
}

// The same for measured distances.
bool SessionState::measure() {
  if (!volume_->is_whole()) return false;  // distances are those from the surfaces of the whole data set
  if (!measurement_) measurement_ = worker_.ask(volume_, shown_, Distances::measured);
  if (!measurement_->is_ready()) return false;
  estimate_.reset();
  set_relevant(std::exchange(measurement_, nullptr)->result(), true);
  return true;
}

// Down to which error updates of every range go ahead.
double SessionState::percent_ahead(ViewState state) const {
  return state == ViewState::ahead ? *coarse_percent_ : std::max(*coarse_percent_, kAheadOfRestPercent);
}

// Whether the client wants those, and may lack some.
bool SessionState::lacks_ahead(ViewState state) const {
  return coarse_percent_ && volume_->is_whole() && volume_->description().has_every_range && !plan_->is_full() &&
         !(ahead_percent_ && *ahead_percent_ <= percent_ahead(state));
}

// Whether all that the view wants at kCoarsePixels is sent, and something goes before the rest, which surely finds room
// afterwards.
bool SessionState::goes_ahead_of_rest() const {
  if (view_ != ViewState::streaming || !lod_.camera || lod_.camera->pixel_error >= kCoarsePixels || lod_.max_updates) return false;
  if (!lacks_ahead(ViewState::ahead_of_rest) || (plan_->done() && !measurement_)) return false;
  const StreamPlan::Remaining remaining = plan_->remaining();
  return remaining.pixels <= kCoarsePixels && room_ >= kAmpleRoom && plan_->sent() + remaining.updates <= room_ / 2;
}

// A client that keeps a quarter of its room free for the next view gives up nothing for what goes ahead.
void SessionState::begin_ahead() {
  if (!std::exchange(is_new_, false)) return;
  left_of_view_ = view_ == ViewState::ahead ? StreamPlan::Remaining() : plan_->remaining();
  plan_->set_relevant({volume_, &volume_->relevant()}, shown_);
  planned_.clear();  // no view's: not even one of every range has the same if other ranges are shown now
  Lod lod;
  lod.error_percent = percent_ahead(view_);
  plan_->set_lod(lod);
  const std::uint64_t room = view_ == ViewState::ahead ? room_ - room_ / 4 : plan_->sent() + room_ / 4;
  plan_->set_room(std::min(room, lod_.max_updates.value_or(UINT64_MAX)));
}

void SessionState::end_ahead() {
  if (!plan_->is_full()) ahead_percent_ = percent_ahead(view_);
  plan_->set_room(room_);
  is_new_ = view_ == ViewState::ahead_of_rest;
  view_ = is_new_ ? ViewState::streaming : ViewState::done;
}

// Whether it is not known yet what is within the view's budget.
bool SessionState::is_searching() {
  if (search_ != plan_->search()) {
    search_ = plan_->search();
    if (search_) worker_.search(search_);
  }
  return search_ && !search_->is_done();
}

std::optional<protocol::ServerMessage> SessionState::next(std::size_t max_payload) {
  if (!opened()) return {};
  if (!std::exchange(opened_was_sent_, true)) return protocol::Opened{volume_->description(), {}, resumed_};
  const auto has_grown = grow();
  if (!has_grown) return has_grown.error();
  if (*has_grown) return {};  // what follows is has_work()
  if (!has_work()) return {};
  if (handles_held_) {
    if (auto fault = handle_held()) return *std::move(fault);
    return {};
  }
  waits_ = false;
  if (is_ahead()) {
    begin_ahead();
  } else if (!begin_view()) {
    waits_ = true;
    return {};
  }
  if (is_searching()) {
    waits_ = true;
    return {};
  }
  // A batch does not use all the credit: the connection would be idle until the client's next grant arrives. Clients
  // grant a quarter of their window or more, and a batch takes about a third of its bound.
  const std::size_t bound = std::min<std::uint64_t>({next_payload(view_bytes_, protocol::kMaxBatchPayload, first_payload_), max_payload,
                                                     std::max<std::uint64_t>(protocol::kMinPayload, 2 * last_grant_)});
  const std::uint64_t size = std::min<std::uint64_t>(bound, credit_ - protocol::kBatchEnvelope);  // credit_ >= kMinCredit
  const bool others_wait = max_payload < protocol::kMaxBatchPayload;
  auto batch = plan_->next(size, others_wait ? kContendedVisits : StreamPlan::kMostVisits);
  if (!batch) {
    if (!plan_->done()) return {};
    if (is_ahead()) {
      end_ahead();
      return {};
    }
    const bool is_last = !measurement_ && (volume_->is_whole() || is_grown_);
    if (!is_last && view_ == ViewState::unanswered) return message_of(plan_->no_updates());  // nothing lacks, as far as is known
    waits_ = !is_last;
    if (!is_last) return {};
    is_new_ = lacks_ahead(ViewState::ahead);
    view_ = is_new_ ? ViewState::ahead : ViewState::done;
    return protocol::Done{epoch_, plan_->sent(), plan_->is_full()};
  }
  view_bytes_ += others_wait ? size : batch->payload.size();  // fewer and larger batches take less processor time
  auto message = message_of(*std::move(batch));
  if (goes_ahead_of_rest()) {
    view_ = ViewState::ahead_of_rest;
    is_new_ = true;
  }
  return message;
}

// The message of a batch that is within the credit.
protocol::Batch SessionState::message_of(Batch batch) {
  if (!is_ahead()) view_ = ViewState::streaming;
  StreamPlan::Remaining remaining = is_ahead() ? left_of_view_ : plan_->remaining();
  // What is not measured, or not there yet, may move as far.
  if (lod_.camera && (measurement_ || !volume_->is_whole())) remaining.pixels = std::max(remaining.pixels, lod_.camera->pixel_error);
  protocol::Batch message{
      epoch_, sequence_++, batch.updates, remaining.error, remaining.pixels, remaining.updates, std::move(batch.payload), std::move(batch.channels)};
  credit_ -= protocol::cost_of(message);
  return message;
}

}  // namespace intervale

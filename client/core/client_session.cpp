#include "client/core/client_session.h"

#include <algorithm>
#include <cstddef>
#include <variant>

#include "common/util/printable.h"
#include "protocol/codec.h"
#include "protocol/limits.h"

namespace intervale {
namespace {

constexpr std::uint64_t kDoneBytes = 128;  // more than a Done message takes

}  // namespace

bool may_reconnect(protocol::CloseCode code) { return code == protocol::CloseCode::going_away || code == protocol::CloseCode::internal; }

ClientSession::ClientSession(Options options) : options_(std::move(options)), credit_(options_.max_bytes ? 0 : UINT64_MAX, options_.window) {}

Result<void> ClientSession::look(ViewRequest request) {
  if (mesh_) {
    const auto channels = find_channels(description_->channels, request.channels);
    if (!channels) return tl::unexpected(channels.error());
    if (auto shown = mesh_->show(request.shown); !shown) return shown;
    mesh_->show_channels(*channels);
  }
  view_ = std::move(request);
  map_due_ = view_->depth ? std::max(kDepthMapUpdates, 2 * updates_) : kDepthMapUpdates;
  if (mesh_ && view_->camera) mesh_->look(*view_->camera, view_->within);
  if (state_ != State::connecting) send_view();
  return {};
}

bool ClientSession::wants_depth_map() const {
  return state_ == State::viewing && view_ && view_->is_opaque && view_->lod.camera && updates_ >= map_due_;
}

void ClientSession::send_depth_map(DepthMap map) {
  view_->depth = std::move(map);
  map_due_ = 2 * updates_;
  send_view(false);
}

// With max_bytes, Open grants nothing: first it must be known how many bytes Opened takes.
void ClientSession::connected(Clock::time_point now) {
  state_ = State::greeted;
  fault_.reset();
  messages_.clear();
  sequence_ = 0;
  answered_ = epoch_ + 1;
  greeted_at_ = now;
  ++stats_.connections;
  credit_.end_session();
  protocol::Open open{options_.dataset, options_.client, options_.max_bytes ? 0 : credit_.grant_window(), {}};
  if (mesh_) open.resume = description_->content_hash;
  send(open);
  if (mesh_) send_haves();
  if (view_) send_view();
}

void ClientSession::disconnected() {
  if (state_ != State::closed) state_ = State::connecting;
  if (view_) view_->ahead.reset();
  messages_.clear();
}

Result<ClientSession::Event> ClientSession::receive(std::span<const std::uint8_t> bytes, Clock::time_point now) {
  ++stats_.messages;
  stats_.bytes += bytes.size();
  auto message = protocol::decode_server_message(bytes);
  Result<Event> event = message ? std::visit([&](auto& m) { return take(m, now); }, *message) : violation(message.error().message);
  if (!event && state_ != State::connecting) state_ = State::closed;
  return event;
}

std::optional<StreamClient> ClientSession::take_mesh() && {
  if (state_ == State::closed && !fault_) return {};
  return std::exchange(mesh_, {});
}

Result<ClientSession::Event> ClientSession::take(protocol::Opened& opened, Clock::time_point now) {
  if (state_ != State::greeted) return violation("a second Opened");
  if (opened.payload != protocol::kPayloadVersion) return other_version(opened.payload);
  const bool resumes = mesh_ && opened.resumed;
  if (!resumes) {
    description_ = std::move(opened.description);
    if (auto started = start_mesh(); !started) return tl::unexpected(started.error());
  }
  state_ = view_ ? State::viewing : State::idle;
  if (options_.max_bytes) {
    const std::uint64_t spent = stats_.bytes + kDoneBytes;
    credit_ = CreditWindow(*options_.max_bytes > spent ? *options_.max_bytes - spent : 0, options_.window);
  }
  credit_.note_round_trip(now - greeted_at_);
  if (options_.max_bytes) send_credit();
  if (!resumes && view_) {
    map_due_ = kDepthMapUpdates;
    if (std::exchange(view_->depth, {})) send_view(false);  // it was of other data
  }
  return Event{.kind = Event::Kind::opened, .is_new_mesh = !resumes};
}

Result<ClientSession::Event> ClientSession::take(const protocol::Batch& batch, Clock::time_point now) {
  if (batch.sequence != sequence_++) return violation("a batch is missing");
  if (auto accepted = accept_answer(batch.epoch, true); !accepted) return tl::unexpected(accepted.error());
  if (!credit_.spend(protocol::cost_of(batch))) return violation("a batch exceeds the credit");
  if (auto applied = apply(batch); !applied) return tl::unexpected(applied.error());
  if (mesh_ && state_ == State::idle) mesh_->settle();  // it had coarse updates
  if (batch.epoch == epoch_) {
    stats_.remaining_error = batch.remaining_error;
    stats_.remaining_pixels = batch.remaining_pixels;
    stats_.updates_to_go = batch.updates_to_go;
  }
  credit_.note_batch(protocol::cost_of(batch), now);
  send_credit();
  end_motion(now);
  return Event{.kind = Event::Kind::batch, .epoch = batch.epoch, .updates = batch.updates};
}

Result<ClientSession::Event> ClientSession::take(const protocol::Done& done, Clock::time_point /*now*/) {
  if (auto accepted = accept_answer(done.epoch, false); !accepted) return tl::unexpected(accepted.error());
  if (done.updates_sent != updates_) return violation("Done, but updates are missing");
  credit_.note_pause();
  if (done.epoch == epoch_) {
    state_ = State::idle;
    if (mesh_) mesh_->settle();
    stats_.is_full = done.full;
    if (!done.full) stats_.remaining_error = stats_.remaining_pixels = 0, stats_.updates_to_go = 0;
  }
  return Event{.kind = Event::Kind::done, .epoch = done.epoch, .is_full = done.full};
}

Result<ClientSession::Event> ClientSession::take(const protocol::Fault& fault, Clock::time_point /*now*/) {
  fault_ = fault;
  if (may_reconnect(fault.code)) disconnected();
  if (fault.code == protocol::CloseCode::no_such_range) return misuse(printable(fault.text));
  return fail(options_.server + " ended the session: " + printable(fault.text) + " (code " + std::to_string(unsigned(fault.code)) + ")");
}

Result<void> ClientSession::start_mesh() {
  updates_ = stats_.updates = stats_.forgotten = 0;
  // Misuse is the user's: the server's description is in order.
  const auto invalid = [this](const Error& error) {
    return error.usage ? tl::unexpected(error) : violation("an invalid description: " + error.message);
  };
  if (!options_.has_mesh) {
    if (auto ok = check_description(*description_); !ok) return invalid(ok.error());
    return {};
  }
  auto mesh = view_ ? StreamClient::start(*description_, view_->budget, view_->shown) : StreamClient::start(*description_);
  if (!mesh) return invalid(mesh.error());
  mesh_ = std::move(*mesh);
  if (view_) {
    const auto channels = find_channels(description_->channels, view_->channels);
    if (!channels) return tl::unexpected(channels.error());
    mesh_->show_channels(*channels);
  }
  if (view_ && view_->camera) mesh_->look(*view_->camera, view_->within);
  return {};
}

// A Batch or a Done of that epoch. With the first one, the mesh forgets what that view gave up.
Result<void> ClientSession::accept_answer(std::uint64_t epoch, bool may_follow_done) {
  if (state_ == State::greeted) return violation("no Opened at first");
  const bool follows_done = may_follow_done && state_ == State::idle && view_ && view_->coarse_error_percent;
  if ((state_ != State::viewing && !follows_done) || epoch < answered_ || epoch > epoch_) return violation("an answer to a view that is not open");
  answered_ = epoch;
  while (shown_.size() > 1 && shown_[1].epoch <= epoch) shown_.pop_front();
  if (!mesh_) return {};
  mesh_->arrived(epoch);
  stats_.forgotten += updates_ - mesh_->updates();
  updates_ = mesh_->updates();
  return {};
}

Result<void> ClientSession::apply(const protocol::Batch& batch) {
  updates_ += batch.updates;
  stats_.updates += batch.updates;
  if (updates_ > description_->updates) return violation("more updates than the data set has");
  if (!mesh_) return {};
  const auto start = Clock::now();
  const ShownFrom& shown = shown_in(batch.epoch);
  const auto channels = find_channels(description_->channels, shown.channels);
  if (!channels) return violation("values of a channel that the data set has not");
  const auto applied = mesh_->apply(batch.payload, batch.epoch, shown.shown, {batch.channels, *channels});
  stats_.seconds_applying += std::chrono::duration<double>(Clock::now() - start).count();
  if (!applied) return violation(applied.error().message);
  if (mesh_->updates() != updates_) return violation("a batch has not as many updates as it says");
  return {};
}

void ClientSession::send(const protocol::ClientMessage& message) { messages_.push_back(protocol::encode(message)); }

void ClientSession::send_haves() {
  send_haves(mesh_->resume(), {});
  for (std::size_t i = 0; i < mesh_->channels().size(); ++i) send_haves(mesh_->channels()[i].groups(), i);
}

void ClientSession::send_haves(std::span<const SlotGroup> splits, std::optional<std::size_t> channel) {
  for (auto first = splits.begin(); first != splits.end();) {
    const auto last = first + std::min(std::ptrdiff_t(protocol::kMaxHave), splits.end() - first);
    send(protocol::Have{{first, last}, channel});
    stats_.have_bytes += messages_.back().size();
    first = last;
  }
}

// A view is sent before Opened has arrived. It gives nothing up then: the data may be other data than before.
void ClientSession::send_view(bool gives_up) {
  protocol::View view{++epoch_, view_->lod};
  view.shown = view_->shown;
  view.early = view_->early;
  view.coarse_error_percent = view_->coarse_error_percent;
  view.channels = view_->channels;
  view.depth = view_->depth;
  if (view_->ahead) view.ahead = view_->ahead->camera;
  if (shown_.empty() || shown_.back().shown != view.shown || shown_.back().channels != view.channels)
    shown_.push_back({epoch_, view.shown, view.channels});
  if (mesh_) {
    mesh_->set_budget(view_->budget, epoch_);
    if (is_open() && gives_up) view.forget = mesh_->give_up(epoch_, protocol::kMaxHave);
  }
  if (view_->budget.max_updates != UINT64_MAX) view.room = view_->budget.max_updates;
  if (state_ == State::idle) credit_.note_pause();  // also if coarse updates have followed Done
  if (is_open()) state_ = State::viewing;
  stats_.is_full = false;
  send(view);
}

// A camera that rests gets what is left of its view in the order of its own.
void ClientSession::end_motion(Clock::time_point now) {
  if (!view_ || !view_->ahead || now < view_->ahead->until) return;
  view_->ahead.reset();
  if (state_ == State::viewing) send_view(false);
}

// epoch: no earlier than the last answered.
const ClientSession::ShownFrom& ClientSession::shown_in(std::uint64_t epoch) const {
  auto at = shown_.begin();
  while (at + 1 != shown_.end() && (at + 1)->epoch <= epoch) ++at;
  return *at;
}

void ClientSession::send_credit() {
  while (const std::uint64_t bytes = credit_.grant_more()) send(protocol::Credit{bytes});
}

tl::unexpected<Error> ClientSession::other_version(std::uint32_t payload) const {
  const std::uint32_t theirs = std::max(payload, 1u);  // 0: a server that does not say it, of version 1
  return fail(options_.server + " sends batches of version " + std::to_string(theirs) + ", and this client reads version " +
              std::to_string(protocol::kPayloadVersion) + (theirs < protocol::kPayloadVersion ? ": update the server" : ": update the client"));
}

tl::unexpected<Error> ClientSession::violation(const std::string& what) const { return fail(options_.server + " violated the protocol: " + what); }

}  // namespace intervale

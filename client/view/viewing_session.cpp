#include "client/view/viewing_session.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "common/util/printable.h"
#include "protocol/codec.h"

namespace intervale {
namespace {

tl::unexpected<Error> nonsense(const std::string& what) { return fail("the server sent nonsense: " + what); }

}  // namespace

Lod ViewingSession::lod() const {
  Lod lod;
  if (view_->region) {
    lod.roi = view_->region;
  } else {
    lod.camera = view_->camera;
  }
  return lod;
}

Result<void> ViewingSession::look(const WantedView& view) {
  Lod lod;
  lod.roi = view.region;
  lod.camera = view.camera;
  if (auto ok = check_lod(lod); !ok) return ok;
  if (view.budget.max_updates < kLeastRoom) return fail("there must be room for " + std::to_string(kLeastRoom) + " updates at least");
  const bool is_new = view_ != view;
  view_ = view;
  if (!is_new) return {};
  gave_up_ = false;
  if (client_) client_->look(view.camera);
  if (has_line_) send_view();
  return {};
}

void ViewingSession::send(const protocol::ClientMessage& message) { messages_.push_back(protocol::encode(message)); }

void ViewingSession::send_view() {
  protocol::View view{++epoch_, lod()};
  if (client_) {
    client_->set_budget(view_->budget, epoch_);
    if (is_open_) view.forget = client_->give_up(epoch_, protocol::kMaxHave);
  }
  if (view_->budget.max_updates != UINT64_MAX) view.room = view_->budget.max_updates;
  figures_.done = figures_.full = false;
  send(view);
}

// Open, what the client has, the first view and the first grant go out together, to save a round trip.
void ViewingSession::opened_line(Clock::time_point now) {
  messages_.clear();
  has_line_ = true;
  is_open_ = false;
  sequence_ = 0;
  grants_.forget_outstanding();
  asked_ = now;
  protocol::Open open{dataset_, client_name_, grants_.take_all(), {}};
  if (client_) open.resume = client_->description().content_hash;
  send(open);
  if (client_) {
    const auto splits = client_->resume();
    for (std::size_t first = 0; first < splits.size(); first += protocol::kMaxHave) {
      const auto some = splits.begin() + std::ptrdiff_t(first);
      send(protocol::Have{{some, some + std::ptrdiff_t(std::min(protocol::kMaxHave, splits.size() - first))}});
    }
  }
  send_view();
  first_ = served_ = epoch_;
}

void ViewingSession::lost_line() {
  has_line_ = is_open_ = false;
  messages_.clear();
}

Result<void> ViewingSession::receive(std::span<const std::uint8_t> bytes, Clock::time_point now) {
  was_opened_ = fresh_ = false;
  figures_.bytes += bytes.size();
  ++figures_.messages;
  auto message = protocol::decode_server_message(bytes);
  if (!message) return nonsense(message.error().message);
  if (auto* opened = std::get_if<protocol::Opened>(&*message)) return take(*opened, now);
  if (const auto* fault = std::get_if<protocol::Fault>(&*message)) return take(*fault);
  if (!is_open_) return nonsense("something else than the data set's description");
  if (const auto* batch = std::get_if<protocol::Batch>(&*message)) return take(*batch, now);
  return take(std::get<protocol::Done>(*message));
}

Result<void> ViewingSession::take(protocol::Opened& opened, Clock::time_point now) {
  if (std::exchange(is_open_, true)) return nonsense("a second description");
  was_opened_ = true;
  ++figures_.sessions;
  grants_.round_trip(now - asked_);
  if (client_ && opened.resumed) {
    ++figures_.resumed;
    return {};
  }
  auto client = StreamClient::start(std::move(opened.description), view_->budget);
  if (!client) return nonsense(client.error().message);
  client_ = std::move(*client);
  client_->look(view_->camera);
  fresh_ = true;
  figures_.received = figures_.repeated = 0;
  return {};
}

// The answer to a view has come: what that was to forget is gone.
void ViewingSession::arrived(std::uint64_t epoch) {
  served_ = epoch;
  client_->arrived(epoch);
}

Result<void> ViewingSession::take(const protocol::Batch& batch, Clock::time_point now) {
  if (batch.sequence != sequence_++ || batch.epoch < served_ || batch.epoch > epoch_) return nonsense("a batch that is out of order");
  if (!grants_.spend(protocol::cost_of(batch))) return nonsense("more than it was granted");
  arrived(batch.epoch);
  const std::uint64_t before = client_->updates();
  if (auto applied = client_->apply(batch.payload, batch.epoch); !applied) return nonsense(applied.error().message);
  if (client_->updates() - before != batch.updates) return nonsense("a batch of another size than it says");
  figures_.received += batch.updates;
  if (batch.epoch == epoch_) {
    figures_.remaining_error = batch.remaining_error;
    figures_.remaining_pixels = batch.remaining_pixels;
    figures_.updates_to_go = batch.updates_to_go;
  }
  grants_.applied(protocol::cost_of(batch), now);
  while (const std::uint64_t bytes = grants_.take()) send(protocol::Credit{bytes});
  return {};
}

Result<void> ViewingSession::take(const protocol::Done& done) {
  if (done.epoch < served_ || done.epoch > epoch_) return nonsense("an end that is out of order");
  arrived(done.epoch);
  if (done.updates_sent != client_->updates()) return nonsense("the end of a view, with updates missing");
  grants_.pause();
  if (done.epoch != epoch_) return {};
  if (done.full && !std::exchange(gave_up_, true)) {
    send_view();
    return {};
  }
  figures_.done = true;
  figures_.full = done.full;
  if (!done.full) {
    const bool has_all = client_->updates() == client_->description().updates;
    figures_.remaining_error = 0;
    figures_.remaining_pixels = has_all || view_->region ? 0 : view_->camera.pixel_error;
    figures_.updates_to_go = 0;
  }
  return {};
}

Result<void> ViewingSession::take(const protocol::Fault& fault) {
  fault_code_ = fault.code;
  return fail("the server ended the session: " + printable(fault.text) + " (code " + std::to_string(unsigned(fault.code)) + ")");
}

}  // namespace intervale

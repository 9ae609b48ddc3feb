#include "client/load/load_stream.h"

#include <algorithm>
#include <string>

#include "protocol/codec.h"

namespace intervale {
namespace {

tl::unexpected<Error> nonsense(const std::string& what) { return fail("the server sent nonsense: " + what); }

}  // namespace

void LoadStream::begin_again() {
  opened_ = false;
  sequence_ = 0;
  grants_.forget_outstanding();
}

std::vector<protocol::ClientMessage> LoadStream::greeting() {
  protocol::Open open{plan_.url.name, "intervale-load " INTERVALE_VERSION, grants_.take_all(), {}};
  if (!mesh_) return {open};
  open.resume = plan_.description.content_hash;
  std::vector<protocol::ClientMessage> greeting{open};
  const std::vector<SlotGroup> splits = mesh_->resume();
  for (std::size_t first = 0; first < splits.size(); first += protocol::kMaxHave) {
    const auto some = splits.begin() + std::ptrdiff_t(first);
    const auto end = some + std::ptrdiff_t(std::min(protocol::kMaxHave, splits.size() - first));
    greeting.emplace_back(protocol::Have{{some, end}});
  }
  return greeting;
}

protocol::View LoadStream::ask(std::uint64_t epoch, const Lod& lod) {
  protocol::View view{epoch, lod};
  if (plan_.budget.max_updates != UINT64_MAX) view.room = plan_.budget.max_updates;
  if (mesh_) view.forget = mesh_->give_up(epoch, protocol::kMaxHave);
  return view;
}

void LoadStream::look(const std::optional<Camera>& camera) {
  camera_ = camera;
  if (mesh_ && camera_) mesh_->look(*camera_);
}

Result<void> LoadStream::take(protocol::Opened opened, std::size_t size, LoadClock::duration round_trip) {
  if (std::exchange(opened_, true)) return nonsense("a second description");
  grants_.round_trip(round_trip);
  if (opened.description.content_hash != plan_.description.content_hash) return nonsense("another volume than before");
  if (mesh_) {
    if (!opened.resumed) return nonsense("it has the same volume, and does not resume");
    figures_.repeated_bytes += size;
    return {};
  }
  if (!plan_.verify) return {};
  auto client = StreamClient::start(std::move(opened.description), plan_.budget);
  if (!client) return nonsense(client.error().message);
  mesh_ = std::move(*client);
  least_tets_ = mesh_->tet_count();
  look(camera_);
  return {};
}

// What the view was to forget is gone with its answer.
void LoadStream::arrived(std::uint64_t epoch) {
  if (!mesh_) return;
  mesh_->arrived(epoch);
  forgotten_ += updates_ - mesh_->updates();
  updates_ = mesh_->updates();
}

Result<void> LoadStream::take(const protocol::Batch& batch, std::uint64_t newest) {
  if (!opened_ || batch.sequence != sequence_++ || batch.epoch < std::max<std::uint64_t>(epoch_, 1) || batch.epoch > newest) {
    return nonsense("a batch that is out of order");
  }
  if (!grants_.spend(protocol::cost_of(batch))) return nonsense("more than it was granted");
  epoch_ = batch.epoch;
  arrived(batch.epoch);
  updates_ += batch.updates;
  received_ += batch.updates;
  return {};
}

Result<void> LoadStream::apply(const protocol::Batch& batch) {
  if (!mesh_) return {};
  auto applied = mesh_->apply(batch.payload, batch.epoch);
  if (applied && mesh_->updates() != updates_) applied = fail("a batch of another size than it says");
  if (applied && mesh_->tet_count() > std::max(plan_.budget.max_tets, least_tets_)) applied = fail("a mesh over its budget");
  if (applied) return {};
  mesh_.reset();  // it must not be used again
  return nonsense(applied.error().message);
}

Result<void> LoadStream::take(const protocol::Done& done, std::uint64_t newest) {
  if (!opened_ || done.epoch < std::max<std::uint64_t>(epoch_, 1) || done.epoch > newest) return nonsense("an end that is out of order");
  arrived(done.epoch);
  if (done.updates_sent != updates_) return nonsense("the end of the stream, with updates missing");
  epoch_ = done.epoch;
  grants_.pause();
  return {};
}

std::uint64_t LoadStream::grant(const protocol::Batch& batch, LoadClock::time_point now) {
  grants_.applied(protocol::cost_of(batch), now);
  std::uint64_t more = 0;
  while (const std::uint64_t bytes = grants_.take()) more += bytes;
  return more;
}

std::uint64_t LoadStream::repeated_updates() const { return mesh_ ? received_ - forgotten_ - mesh_->updates() : 0; }

}  // namespace intervale

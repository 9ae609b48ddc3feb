#include "server/serve/connections.h"

#include <utility>
#include <vector>

namespace intervale {

Connections::Membership& Connections::Membership::operator=(Membership&& other) noexcept {
  std::swap(set_, other.set_);
  std::swap(id_, other.id_);
  return *this;
}

Connections::Membership::~Membership() {
  if (set_ != nullptr) set_->leave(id_);
}

Connections::Membership Connections::join(const std::shared_ptr<Connection>& connection) {
  const std::unique_lock lock(mutex_);
  const std::uint64_t id = next_id_++;
  connections_.emplace(id, connection);
  if (draining_) connection->go_away();  // only posts, so the lock does no harm
  return {*this, id};
}

void Connections::go_away() {
  std::vector<std::shared_ptr<Connection>> told;  // outlives the lock: the last owner's destructor leaves the set
  const std::unique_lock lock(mutex_);
  draining_ = true;
  for (const auto& [id, weak] : connections_) {
    if (auto connection = weak.lock()) {
      connection->go_away();
      told.push_back(std::move(connection));
    }
  }
}

bool Connections::wait_until_empty(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  return empty_.wait_for(lock, time, [this] { return connections_.empty(); });
}

bool Connections::draining() const {
  const std::lock_guard lock(mutex_);
  return draining_;
}

std::size_t Connections::size() const {
  const std::lock_guard lock(mutex_);
  return connections_.size();
}

void Connections::leave(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  connections_.erase(id);
  if (connections_.empty()) empty_.notify_all();
}

}  // namespace intervale

#include "server/serve/connections.h"

#include <vector>

namespace intervale {

Connections::Registration Connections::add(const std::shared_ptr<Connection>& connection) {
  const std::unique_lock lock(mutex_);
  const std::uint64_t id = next_id_++;
  connections_.emplace(id, connection);
  waiting_.emplace(next_place_, id);
  if (draining_) connection->begin_shutdown();  // does not block
  return Registration(this, {id, next_place_++});
}

void Connections::set_waiting(Registration& registration, bool waits) {
  const std::lock_guard lock(mutex_);
  auto& [id, place] = registration.get_deleter();
  if (place) waiting_.erase(*place);
  place.reset();
  if (!waits) return;
  place = next_place_++;
  waiting_.emplace(*place, id);
}

bool Connections::make_room(std::size_t most) {
  std::shared_ptr<Connection> longest;  // destroyed after the lock is released: its destructor calls remove()
  const std::lock_guard lock(mutex_);
  if (connections_.size() < most) return true;
  if (connections_.size() >= most + kMostAborted || waiting_.empty()) return false;
  longest = connections_.at(waiting_.begin()->second).lock();
  waiting_.erase(waiting_.begin());
  if (longest) longest->abort("it waited longest for its client when there was no room for another connection");  // does not block
  return true;
}

void Connections::begin_shutdown() {
  // Until the lock is released: a connection's destructor calls remove().
  std::vector<std::shared_ptr<Connection>> keep_alive;
  const std::unique_lock lock(mutex_);
  draining_ = true;
  for (const auto& [id, weak] : connections_) {
    if (auto connection = weak.lock()) {
      connection->begin_shutdown();
      keep_alive.push_back(std::move(connection));
    }
  }
}

void Connections::catalogue_changed() {
  std::vector<std::shared_ptr<Connection>> keep_alive;
  const std::unique_lock lock(mutex_);
  for (const auto& [id, weak] : connections_) {
    if (auto connection = weak.lock()) {
      connection->catalogue_changed();
      keep_alive.push_back(std::move(connection));
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

void Connections::remove(const Remove& registration) {
  const std::lock_guard lock(mutex_);
  connections_.erase(registration.id);
  if (registration.place) waiting_.erase(*registration.place);
  if (connections_.empty()) empty_.notify_all();
}

}  // namespace intervale

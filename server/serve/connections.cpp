#include "server/serve/connections.h"

#include <vector>

namespace intervale {

Connections::Registration Connections::add(const std::shared_ptr<Connection>& connection) {
  const std::unique_lock lock(mutex_);
  const std::uint64_t id = next_id_++;
  connections_.emplace(id, connection);
  if (draining_) connection->begin_shutdown();  // does not block
  return Registration(this, {id});
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

void Connections::remove(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  connections_.erase(id);
  if (connections_.empty()) empty_.notify_all();
}

}  // namespace intervale

// The open connections of a server: to shut them all down, and to wait until they are gone.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

namespace intervale {

class Connection {
 public:
  virtual ~Connection() = default;
  // Any thread; neither blocks.
  virtual void begin_shutdown() = 0;  // the server drains: close in order, soon
  virtual void abort() = 0;           // close the socket at once
};

// Any thread.
class Connections {
 public:
  struct Remove {
    std::uint64_t id = 0;
    void operator()(Connections* set) const { set->remove(id); }
  };
  // Removes the connection when destroyed.
  using Registration = std::unique_ptr<Connections, Remove>;

  // A connection that is added while the server drains is shut down at once.
  [[nodiscard]] Registration add(const std::shared_ptr<Connection>& connection);

  void begin_shutdown();                                  // of all connections, and of those added later
  bool wait_until_empty(std::chrono::milliseconds time);  // false if there still are connections after that time
  [[nodiscard]] bool draining() const;                    // begin_shutdown() was called
  [[nodiscard]] std::size_t size() const;

 private:
  void remove(std::uint64_t id);
  mutable std::mutex mutex_;
  std::condition_variable empty_;
  std::map<std::uint64_t, std::weak_ptr<Connection>> connections_;
  std::uint64_t next_id_ = 0;
  bool draining_ = false;
};

}  // namespace intervale

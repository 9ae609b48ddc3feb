// The open connections of a server: to shut them all down and wait until they are gone, and to make room for others.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

namespace intervale {

class Connection {
 public:
  virtual ~Connection() = default;
  // Any thread; none blocks.
  virtual void begin_shutdown() = 0;        // the server drains: close in order, soon
  virtual void catalogue_changed() {}       // there may be more of a data set that was not whole
  virtual void abort(const char* why) = 0;  // close the socket at once; why: for the log, a literal
};

// Any thread.
class Connections {
 public:
  struct Remove {
    std::uint64_t id = 0;
    std::optional<std::uint64_t> place = {};  // among those that wait
    void operator()(Connections* set) const { set->remove(*this); }
  };
  // Removes the connection when destroyed.
  using Registration = std::unique_ptr<Connections, Remove>;

  // A connection that is added while the server drains is shut down at once. It waits; see set_waiting().
  [[nodiscard]] Registration add(const std::shared_ptr<Connection>& connection);

  // Whether the connection waits for what its client must send before it costs more than the connection: a request, or
  // Open. One that waits again goes to the end.
  void set_waiting(Registration& registration, bool waits);
  // Whether one more connection may be added if there are to be `most`. If there are so many, the one that waits longest
  // is aborted to make room; until it is gone there is one more, and at most kMostAborted more.
  bool make_room(std::size_t most);

  void begin_shutdown();                                  // of all connections, and of those added later
  void catalogue_changed();                               // for all connections
  bool wait_until_empty(std::chrono::milliseconds time);  // false if there still are connections after that time
  [[nodiscard]] bool draining() const;                    // begin_shutdown() was called
  [[nodiscard]] std::size_t size() const;

 private:
  static constexpr std::size_t kMostAborted = 64;

  void remove(const Remove& registration);
  mutable std::mutex mutex_;
  std::condition_variable empty_;
  std::map<std::uint64_t, std::weak_ptr<Connection>> connections_;
  std::map<std::uint64_t, std::uint64_t> waiting_;  // ids, by place
  std::uint64_t next_id_ = 0, next_place_ = 0;
  bool draining_ = false;
};

}  // namespace intervale

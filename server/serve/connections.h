// The connections a server has, so that it can ask them all to go and know when they are gone.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace intervale {

class Connection {
 public:
  virtual ~Connection() = default;
  // Any thread; these do not block.
  virtual void go_away() = 0;  // the server drains: take leave soon
  virtual void drop() = 0;     // end at once, without leave
};

// Any thread.
class Connections {
 public:
  // Leaves the set when it goes.
  class Membership {
   public:
    Membership() = default;
    Membership(Connections& set, std::uint64_t id) : set_(&set), id_(id) {}
    Membership(Membership&& other) noexcept : set_(std::exchange(other.set_, nullptr)), id_(other.id_) {}
    Membership& operator=(Membership&& other) noexcept;
    ~Membership();

   private:
    Connections* set_ = nullptr;
    std::uint64_t id_ = 0;
  };

  // A connection that joins while the server drains is told to go at once.
  [[nodiscard]] Membership join(const std::shared_ptr<Connection>& connection);

  void go_away();                                         // tells them all, and those to come
  bool wait_until_empty(std::chrono::milliseconds time);  // whether it became empty in time
  [[nodiscard]] bool draining() const;
  [[nodiscard]] std::size_t size() const;

 private:
  void leave(std::uint64_t id);
  mutable std::mutex mutex_;
  std::condition_variable empty_;
  std::map<std::uint64_t, std::weak_ptr<Connection>> connections_;
  std::uint64_t next_id_ = 0;
  bool draining_ = false;
};

}  // namespace intervale

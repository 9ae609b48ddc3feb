// One client of a load: a WebSocket that asks for views by its own timetable and measures what it receives. Internal to
// client/load: brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "client/core/client_session.h"
#include "client/load/load_connection.h"
#include "client/load/load_plan.h"
#include "client/load/load_stats.h"
#include "client/load/load_views.h"

namespace intervale {

// On one thread. It opens one connection after the other, as long as its server is lost and found again. Each has two
// coroutines: the reader receives messages and measures; the writer sends credit, and views as they are due, and alone
// closes.
class LoadClient {
 public:
  // number: among the plan's clients. All references outlive this; stats and progress are added to.
  LoadClient(boost::asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, unsigned number, LoadStats& stats,
             LoadProgress& progress);
  LoadClient(const LoadClient&) = delete;
  LoadClient& operator=(const LoadClient&) = delete;

  // From the wait for its start to the end of its last connection. What goes wrong is in the stats.
  boost::asio::awaitable<void> run();
  void end_views();  // the duration is over: no new views; closes once all are answered
  void leave();      // closes

  // After run(). Nothing if the plan wants none, or if it may be damaged.
  [[nodiscard]] std::optional<StreamClient> take_mesh();

 private:
  using Time = LoadClock::time_point;
  enum class State : std::uint8_t {
    connecting,  // to its first server
    connected,   // a WebSocket is open
    closing,     // ... and is to be closed in order: what still arrives does not count
    lost,        // the server is lost, and another one is looked for
    closed,      // the end, in order
    failed,      // the end, with an error
  };
  LoadClient(boost::asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, const CameraPath& path, Time start,
             LoadStats& stats, LoadProgress& progress);

  [[nodiscard]] bool is_connected() const { return state_ == State::connected || state_ == State::closing; }
  boost::asio::awaitable<void> converse();
  boost::asio::awaitable<void> write_messages();
  boost::asio::awaitable<void> read_messages();
  boost::asio::awaitable<void> wait_for_rate(std::size_t bytes);
  bool look();
  [[nodiscard]] ViewRequest newest_view() const;
  void receive(std::size_t size);
  void take_opened(bool resumes, bool is_new_mesh, std::size_t size);
  void take_batch(const ClientSession::Event& batch, std::size_t size, Time now);
  void take_done(const ClientSession::Event& done, Time now);
  void close_if_answered();
  void end_connection(boost::beast::error_code error);
  void end_session(const std::string& what, bool may_reconnect);
  void fail(const std::string& what);
  void cut_off(State state);
  void report();

  const LoadPlan& plan_;
  LoadStats& stats_;
  LoadProgress& progress_;
  Time start_;  // when it is to connect
  State state_ = State::connecting;
  LoadConnection connection_;
  LoadViews views_;
  ClientSession session_;
  std::uint64_t root_tets_ = 0;  // of the mesh without any update: no budget makes it smaller
  boost::beast::flat_buffer buffer_;
  boost::asio::steady_timer wake_;        // the writer sleeps on it
  boost::asio::steady_timer rate_timer_;  // the reader does, where the rate is limited
  Time received_until_{};                 // when all that was received would have been at that rate
};

}  // namespace intervale

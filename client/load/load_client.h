// One client of a load: a WebSocket that asks for views by its own timetable and measures what it gets. Internal to client/load: brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "client/load/figures.h"
#include "client/load/load_connection.h"
#include "client/load/load_plan.h"
#include "client/load/load_stream.h"
#include "client/load/load_views.h"
#include "protocol/messages.h"

namespace intervale {

// On one thread. It has one session after the other, as long as its server is lost and found again. Two coroutines a session: the reader takes
// messages and measures, the writer sends credit and views as they are due, and alone closes.
class LoadClient {
 public:
  // number: among the plan's clients. All that is referred to outlives this; figures and progress are added to.
  LoadClient(boost::asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, unsigned number, LoadFigures& figures,
             LoadProgress& progress);
  LoadClient(const LoadClient&) = delete;
  LoadClient& operator=(const LoadClient&) = delete;

  // From the wait for its start to the end of its last session. What goes wrong is in the figures.
  boost::asio::awaitable<void> run();
  void end_views();  // the duration is over: no new views; closes once all are answered
  void leave();      // closes

  // After run().
  std::optional<StreamClient> take_mesh() { return stream_.take_mesh(); }

 private:
  using Time = LoadClock::time_point;
  LoadClient(boost::asio::io_context& io, const LoadConnection::Endpoints& endpoints, const LoadPlan& plan, const CameraPath& path, Time start,
             LoadFigures& figures, LoadProgress& progress);

  boost::asio::awaitable<void> converse();
  boost::asio::awaitable<void> write_messages();
  boost::asio::awaitable<bool> greet();
  boost::asio::awaitable<bool> send(const protocol::ClientMessage& message);
  boost::asio::awaitable<void> read_messages();
  boost::asio::awaitable<void> pass_line(std::size_t bytes);
  [[nodiscard]] bool advance();
  [[nodiscard]] protocol::View view() { return stream_.ask(views_.epoch(), views_.lod()); }  // the last one that was due
  void receive(std::size_t size);
  void take(protocol::Opened opened);
  void take(const protocol::Batch& batch);
  void take(const protocol::Done& done);
  void take(const protocol::Fault& fault);
  void close_if_answered();
  void lost(boost::beast::error_code error);
  void lose(const std::string& what);
  void fail(const std::string& what);
  void cut_off();

  const LoadPlan& plan_;
  LoadFigures& figures_;
  LoadProgress& progress_;
  Time start_;  // when it is to connect
  LoadConnection connection_;
  LoadViews views_;
  LoadStream stream_;
  boost::beast::flat_buffer buffer_;
  boost::asio::steady_timer wake_;  // the writer sleeps on it
  boost::asio::steady_timer line_;  // the reader does, where the rate is limited
  Time line_free_{};
  Time asked_;                    // when Open was sent
  Time now_;                      // when the message that is looked at had come
  std::uint64_t credit_due_ = 0;  // granted, and still to be sent
  std::uint64_t bytes_ = 0;       // of messages
  bool connected_ = false;
  bool closing_ = false;  // what comes counts no more
  bool gone_ = false;     // the connection is over
  bool lost_ = false;     // ... and another is looked for
  bool failed_ = false;   // ... and none is
};

}  // namespace intervale

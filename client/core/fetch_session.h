// One stream from beginning to end: what is asked for, when it is enough, what it came to. Without I/O; whatever carries
// the messages drives it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/core/client_session.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct FetchOptions {
  Lod lod;
  RangeRequest shown;                 // of the data set; ranges are needed if it has every range
  std::vector<std::string> channels;  // of the data set, that the meshes bring along
  // Where `shown` does not say what to refine: the inside of the ranges too, if the data set has it.
  bool prefers_uniform = false;
  // Surfaces hide what is behind them: what the lod's camera does not see is received last.
  bool is_opaque = false;
  // The most bytes of messages that are received; only the first one, the description, may exceed it. No updates
  // arrive for less than that message and protocol::kMinCredit.
  std::optional<std::uint64_t> max_bytes;
  // Of a file that is read meanwhile (fetch_growing()): with a camera, no finer scales than estimates want
  // (estimates_want_finer()). Otherwise a camera wants all of the file, to measure how far surfaces move.
  bool on_demand = false;
  std::chrono::seconds reconnect{30};  // how long to try to reach a lost server again; 0: not at all
};

struct FetchStats {
  ClientSession::Stats session;   // over all connections
  double seconds_first_mesh = 0;  // until the mesh first had a tetrahedron; 0 if it never had
  double seconds = 0;             // from the start to the end of the stream
  bool is_complete = false;       // everything that was asked for arrived; false: a budget ended the stream
};

struct Fetched {
  StreamClient client;
  FetchStats stats;
};

struct FetchEvents {
  // After each batch; the stream's seconds are not known yet.
  std::function<void(const StreamClient&, const FetchStats&)> on_batch;
  // One line that the user should read; the stream goes on.
  std::function<void(const std::string&)> on_notice;
};

// Whether what is asked for may be sent from the coarse scales of a data set before the finer ones are there: the mesh is
// the same in the end. Not with a camera, since how far surfaces move is not known yet, unless on_demand; nor where a
// budget ends the stream, since the order of what arrives matters then.
[[nodiscard]] bool takes_coarse_first(const FetchOptions& options);

// On one thread. options and events must outlive it.
class FetchSession {
 public:
  using Clock = ClientSession::Clock;

  // name: of the data set. server: as of ClientSession::Options.
  FetchSession(const std::string& name, const std::string& server, const FetchOptions& options, const FetchEvents& events);

  // To be connected, and given what arrives; its messages are to be sent.
  [[nodiscard]] ClientSession& session() { return session_; }

  // To be called after each ClientSession::receive(), with its event; the session may have messages then.
  Result<void> received(const ClientSession::Event& event);

  [[nodiscard]] bool has_mesh() const { return session_.mesh() != nullptr; }
  // Everything has arrived, or a budget is reached.
  [[nodiscard]] bool has_enough() const { return is_complete() || session_.is_exhausted() || (has_mesh() && session_.mesh()->over_budget()); }
  void notice(const std::string& text) const {
    if (events_.on_notice) events_.on_notice(text);
  }

  // Once it has enough.
  [[nodiscard]] Fetched finish() &&;

 private:
  Result<void> opened(const Description& description);
  Result<void> look(const std::optional<Refine>& refine);
  [[nodiscard]] bool is_complete() const { return session_.state() == ClientSession::State::idle; }
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  std::string name_, server_;
  const FetchOptions& options_;
  const FetchEvents& events_;
  Clock::time_point start_ = Clock::now();
  ClientSession session_;
  FetchStats stats_;
  bool had_mesh_ = false;
};

}  // namespace intervale

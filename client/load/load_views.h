// When a client of a load is to ask for which view, and how long each waited.
//
// Latencies are free of coordinated omission. A client connects at a time fixed before the run; its view k is due k periods after its WebSocket was
// opened, however slow the server is, and its latency counts from that time, not from when it could be sent. A view that is replaced before it was
// served counts until the first message for a view as new or newer. What is unanswered when the duration is over is waited for kGrace more, and then
// counts with the time it has waited. While a server is lost, views go on being due.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "client/load/camera_paths.h"
#include "client/load/load_plan.h"
#include "client/load/load_stats.h"

namespace intervale {

// Of one client. Every time that is passed in is no earlier than the one before.
class LoadViews {
 public:
  using Time = LoadClock::time_point;

  // path: the client's own. start: when it was to connect. stats: to be added to; they outlive this.
  LoadViews(const CameraPath& path, Time start, LoadStats& stats) : path_(path), start_(start), stats_(stats) {}

  void begin(Time now);         // the first WebSocket is open, and the first view due
  void end() { over_ = true; }  // no view is due from now on

  [[nodiscard]] Time next_due() const;  // Time::max(): none will be
  bool advance(Time now);               // to the newest view that is due, if any is; those before it count as sent with it
  void asked(std::uint64_t epoch);      // the newest view was sent, with this epoch, which is greater than the last

  [[nodiscard]] Lod lod() const { return view_of(path_, view_); }  // of the last one that was due
  [[nodiscard]] bool is_only_one() const { return path_.scenario == Scenario::full; }

  // What comes.
  void serve(std::uint64_t epoch, Time now);                // an answer to every view up to this one
  void finish(std::uint64_t epoch, bool is_all, Time now);  // ... and its end; is_all: there was room for all of it
  void note_bytes(std::size_t bytes);                       // of a batch, once it has served what it serves: stale for the views that still wait
  void note_mesh(std::uint64_t bytes, Time now);            // there is a mesh to see, after so many bytes in all; the first time counts

  void lose(Time now);  // the server; until the next view is served
  [[nodiscard]] bool is_lost() const { return lost_at_.has_value(); }

  [[nodiscard]] bool are_over() const { return over_ && pending_.empty() && has_mesh_; }  // and all answered

  // At the very end: what is still waited for counts with its time so far, unless the client failed, whose times would be shorter than the truth.
  void report_rest(bool failed, Time now);

 private:
  struct Pending {  // an answer is waited for
    Time due;
    std::uint64_t epoch = UINT64_MAX;  // not sent yet
    std::uint64_t stale_bytes = 0;
  };
  CameraPath path_;
  Time start_;
  LoadStats& stats_;
  Time first_;                   // when the first one was due
  std::uint64_t view_ = 0;       // number of the last one
  std::uint64_t epoch_ = 0;      // of the last one sent
  std::deque<Pending> pending_;  // in order
  std::optional<Time> lost_at_;  // when the server was seen to be lost
  bool has_mesh_ = false;        // or it is known that none will come
  bool is_complete_ = false;     // all of the last view has come
  bool over_ = false;
};

}  // namespace intervale

// The timetable of the views of one client, and their latencies.
//
// Latencies are free of coordinated omission. A client connects at a time fixed before the run; its view k is due k
// periods after its WebSocket was opened, however slow the server is, and its latency counts from that time, not from
// when it was sent. A view that is replaced before it was answered counts until the first message for the same view or
// a newer one. Views that are unanswered at the end of the duration may take kGrace more, and then count with the time
// they have waited. While a server is lost, views continue to be due.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "client/load/camera_paths.h"
#include "client/load/load_plan.h"
#include "client/load/load_stats.h"

namespace intervale {

// Of one client. The times passed in never decrease.
class LoadViews {
 public:
  using Time = LoadClock::time_point;

  // path: with the seed of the client. start: when it was to connect. stats: added to; they outlive this.
  LoadViews(const CameraPath& path, Time start, LoadStats& stats) : path_(path), start_(start), stats_(stats) {}

  void begin(Time now);         // the first WebSocket is open: the first view is due
  void end() { over_ = true; }  // no view is due from now on

  [[nodiscard]] Time next_due() const;  // Time::max(): no view will be
  // Goes to the newest view that is due; those before it count as sent with it. False if none is due.
  bool advance(Time now);
  void asked(std::uint64_t epoch);  // the newest view was sent, with this epoch, which is greater than the last

  [[nodiscard]] Lod lod() const { return view_of(path_, view_); }  // of the last one that was due
  [[nodiscard]] bool is_only_one() const { return path_.scenario == Scenario::full; }

  // What arrives.
  void serve(std::uint64_t epoch, Time now);                // an answer to every view up to this one
  void finish(std::uint64_t epoch, bool is_all, Time now);  // ... and its Done; is_all: there was room for all of it
  // Of a batch, after serve(): they are stale for the views that still wait.
  void note_bytes(std::size_t bytes);
  // The mesh is not empty, after so many bytes in all; the first call counts.
  void note_mesh(std::uint64_t bytes, Time now);

  void lose(Time now);  // the server is lost, until the next view is answered

  // No view is due or unanswered.
  [[nodiscard]] bool are_over() const { return over_ && pending_.empty() && has_mesh_; }

  // At the very end: unanswered views count with their time so far. Not if the client failed: the times would be too
  // short.
  void report_rest(bool failed, Time now);

 private:
  struct Pending {  // a view without an answer
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
  std::optional<Time> lost_at_;  // when the loss of the server was noticed
  bool has_mesh_ = false;        // or it is known that none will come
  bool is_complete_ = false;     // all of the newest view has arrived
  bool over_ = false;
};

}  // namespace intervale

// The timetable of the views of one client, and their latencies.
//
// Latencies are free of coordinated omission. A client connects at a time fixed before the run; its view k is due k
// periods after its WebSocket was opened, however slow the server is, and its latency counts from that time, not from
// when it was sent. A view that is replaced before it was answered counts until the first message for the same view or
// a newer one, and one that is replaced before its Done until the next Done. Views that are not served to the end when
// the duration is over may take the plan's grace more, and then count with the time they have waited. While a server is
// lost, views continue to be due.
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

  // The first WebSocket is open: the first view is due. end: none is due from then on, even if nobody looks before.
  void begin(Time now, Time end = Time::max());
  void end() { over_ = true; }  // no view is due from now on

  [[nodiscard]] Time next_due() const;  // Time::max(): no view will be
  // Goes to the newest view that is due; those before it count as sent with it. False if none is due.
  bool advance(Time now);
  // The newest view was sent, with this epoch, which is greater than the last. Those that follow, up to the next one told
  // of here, are of the same view sent again: an answer to any of them is one to that view.
  void asked(std::uint64_t epoch);

  // Of the last view that was due.
  [[nodiscard]] std::uint64_t number() const { return view_; }
  [[nodiscard]] Lod lod() const { return view_of(path_, view_); }
  [[nodiscard]] bool is_only_one() const { return path_.scenario == Scenario::full; }

  // What arrives.
  // Epochs never decrease.
  void serve(std::uint64_t epoch, Time now);                // an answer to every view up to this one
  void finish(std::uint64_t epoch, bool is_all, Time now);  // ... and its Done; is_all: there was room for all of it
  // Of a batch, after serve(): they are of the view that it served, and stale for those that still wait.
  void note_bytes(std::size_t bytes);
  // The mesh is not empty, after so many bytes in all; the first call counts.
  void note_mesh(std::uint64_t bytes, Time now);

  void lose(Time now);  // the server is lost, until the next view is answered

  // No view is due, and all are done; of the whole stream a part is enough.
  [[nodiscard]] bool are_over() const { return over_ && answered_ == open_.size() && (open_.empty() || is_only_one()) && has_mesh_; }
  // All of the newest view has arrived.
  [[nodiscard]] bool is_complete() const { return is_complete_; }

  // At the very end: views that are not done count with their time so far. Not if the client failed: the times would be
  // too short.
  void report_rest(bool failed, Time now);

 private:
  struct Open {  // a view that is not done
    Time due;
    std::uint64_t epoch = UINT64_MAX;  // not sent yet
    std::uint64_t stale_bytes = 0;     // until it was answered
  };
  [[nodiscard]] std::uint64_t first_epoch_of(std::uint64_t epoch);  // of the view that was sent with this one
  void answer(std::uint64_t epoch, Time now);
  void count_bytes();
  CameraPath path_;
  Time start_;
  LoadStats& stats_;
  Time first_;  // when the first one was due
  Time end_ = Time::max();
  std::uint64_t view_ = 0;  // number of the last one
  // Of the last one answered, and of those asked for after it; ascending.
  std::deque<std::uint64_t> asked_;
  std::deque<Open> open_;     // in order
  std::size_t answered_ = 0;  // so many of them were: the first ones
  struct Served {
    std::uint64_t epoch = 0, bytes = 0;  // its first epoch
    bool is_done = false;
  };
  std::optional<Served> served_;   // the last view that was, and the bytes of its batches
  std::uint64_t first_epoch_ = 0;  // of the first one sent
  std::optional<Time> lost_at_;    // when the loss of the server was noticed
  bool has_mesh_ = false;          // or it is known that none will come
  bool is_complete_ = false;
  bool over_ = false;
};

}  // namespace intervale

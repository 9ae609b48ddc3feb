// Reads the data sets of a server while it runs.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/data_set_source.h"
#include "server/serve/server.h"

namespace intervale {

// Loads the data sets, and follows the changes of their files, on a thread for each source: that may take long, and
// neither signals nor the other sources wait for a web server that does not answer. Offers them to the server, at first
// once each source has loaded.
class Loading {
 public:
  struct Input {
    std::unique_ptr<DataSetSource> source;
    std::chrono::milliseconds poll_time;
  };
  // inputs: of two data sets of one name, that of the first counts; at the start it is an error. keep_time: how long on
  // demand scales stay that nobody uses. where: the end of the line that tells what is served. failed: called on one of
  // those threads if nothing can be served. The server must outlive this.
  Loading(std::vector<Input> inputs, Server& server, std::chrono::milliseconds keep_time, std::string where,
          std::function<void(const Error&)> failed);
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;
  ~Loading();
  void poll_now();
  void request_stop();

 private:
  using Clock = std::chrono::steady_clock;
  struct Source {
    Input input;
    std::optional<Catalogue> catalogue;    // the last; nullopt: not loaded yet
    bool polls = false, reads_on = false;  // what its thread was woken for
    Clock::time_point next_poll;
    std::jthread thread;
  };
  void run(Source& source, const std::stop_token& stop);
  void wake(bool Source::*why);
  [[nodiscard]] bool wait_until_poll(Source& source, const std::stop_token& stop);
  Result<void> offer(Source& source, Catalogue catalogue);

  Server& server_;
  std::chrono::milliseconds keep_time_;
  std::string where_;
  std::function<void(const Error&)> failed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool is_offered_ = false;
  std::set<std::string> skipped_;  // names of data sets of which another one is served, that were logged
  std::vector<Source> sources_;    // the last member: their threads use the others
};

}  // namespace intervale

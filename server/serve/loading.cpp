#include "server/serve/loading.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "common/parallel/all_cores.h"
#include "server/serve/scale_demand.h"
#include "server/serve/spare_cores.h"

namespace intervale {

Loading::Loading(std::vector<Input> inputs, Server& server, std::chrono::milliseconds keep_time, std::string where,
                 std::function<void(const Error&)> failed)
    : server_(server), keep_time_(keep_time), where_(std::move(where)), failed_(std::move(failed)), sources_(inputs.size()) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    sources_[i].next_poll = Clock::now() + inputs[i].poll_time;
    sources_[i].input = std::move(inputs[i]);
  }
  if (auto* const demand = server_.scale_demand()) demand->set_wake([this] { wake(&Source::reads_on); });
  for (Source& source : sources_)
    source.thread = std::jthread([this, &source](const std::stop_token& stop) { on_spare_cores([&] { run(source, stop); }); });
}

Loading::~Loading() {
  request_stop();
  if (auto* const demand = server_.scale_demand()) demand->set_wake([] {});
  for (Source& source : sources_) source.thread.join();  // each offers what the others have
}

void Loading::poll_now() { wake(&Source::polls); }

void Loading::request_stop() {
  for (Source& source : sources_) source.thread.request_stop();
}

void Loading::run(Source& source, const std::stop_token& stop) {
  try {
    SpareCores cores(stop, server_.scheduler(), SpareCores::Rests::while_sessions_wait, server_.memory().data_memory());
    const ParallelFor& parallel = cores.all();
    DataSetSource& sets = *source.input.source;
    auto catalogue = sets.load(parallel);
    if (!catalogue) return failed_(catalogue.error());
    if (auto offered = offer(source, std::move(*catalogue)); !offered) return failed_(offered.error());
    while (!stop.stop_requested()) {
      for (auto more = sets.complete(parallel); !more || *more; more = sets.complete(parallel)) {
        if (!more) return failed_(more.error());
        (void)offer(source, std::move(**more));
        if (Clock::now() >= source.next_poll) break;  // changes do not wait for all of it
      }
      if (!wait_until_poll(source, stop)) continue;
      if (auto changed = sets.poll(parallel)) (void)offer(source, std::move(*changed));
      if (auto fewer = sets.drop_unused(keep_time_)) (void)offer(source, std::move(*fewer));
    }
  } catch (const Stopped&) {
  } catch (const std::exception& exception) {
    failed_({exception.what()});
  }
}

// What is new of one source, with what there is of the others.
Result<void> Loading::offer(Source& source, Catalogue catalogue) {
  const std::lock_guard lock(mutex_);
  source.catalogue = std::move(catalogue);
  if (!std::all_of(sources_.begin(), sources_.end(), [](const Source& one) { return one.catalogue.has_value(); })) return {};
  Catalogue all;
  std::set<std::string> skipped;
  for (const Source& one : sources_) {
    for (const auto& [name, volume] : one.catalogue->volumes()) {
      auto added = all.add(volume);
      if (!added && !is_offered_) return added;
      if (!added && skipped.insert(name).second && !skipped_.contains(name)) spdlog::warn("skipped: {}", added.error().message);
    }
  }
  skipped_ = std::move(skipped);
  const std::size_t count = all.volumes().size();
  server_.offer(std::move(all));
  if (std::exchange(is_offered_, true)) return {};
  spdlog::info("serving {} data set{}{}", count, count == 1 ? "" : "s", where_);
  if (server_.memory().is_full()) spdlog::warn("the data sets take more memory than --max-memory allows: sessions are refused");
  return {};
}

void Loading::wake(bool Source::*why) {
  const std::lock_guard lock(mutex_);
  for (Source& source : sources_) source.*why = true;
  wake_.notify_all();
}

// Whether it is time to look for changes; or something is to be read on before, or this is to stop.
bool Loading::wait_until_poll(Source& source, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, source.next_poll, [&source] { return source.polls || source.reads_on; });
  source.reads_on = false;
  if (stop.stop_requested() || (!source.polls && Clock::now() < source.next_poll)) return false;
  source.polls = false;
  source.next_poll = Clock::now() + source.input.poll_time;
  return true;
}

}  // namespace intervale

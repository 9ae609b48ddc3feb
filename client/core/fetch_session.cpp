#include "client/core/fetch_session.h"

#include <utility>

#include "client/core/draw_depth_map.h"

namespace intervale {

bool takes_coarse_first(const FetchOptions& options) {
  return (!options.lod.camera || options.on_demand) && !options.lod.max_tets && !options.lod.max_updates && !options.max_bytes;
}

FetchSession::FetchSession(const std::string& name, const std::string& server, const FetchOptions& options, const FetchEvents& events)
    : name_(name),
      server_(server),
      options_(options),
      events_(events),
      session_({.dataset = name, .client = "intervale-client " INTERVALE_VERSION, .server = server, .max_bytes = options.max_bytes}) {
  (void)look(options.shown.refine);  // no data set is known yet
}

Result<void> FetchSession::received(const ClientSession::Event& event) {
  if (event.kind == ClientSession::Event::Kind::opened) {
    if (auto begun = opened(*session_.description()); !begun) return begun;
  }
  if (event.is_new_mesh && had_mesh_) notice("the data of " + server_ + " changed meanwhile; starting again");
  had_mesh_ = true;
  const StreamClient& client = *session_.mesh();
  if (stats_.seconds_first_mesh == 0 && client.tet_count() > 0) stats_.seconds_first_mesh = elapsed();
  stats_.session = session_.stats();
  if (event.kind == ClientSession::Event::Kind::batch && events_.on_batch) events_.on_batch(client, stats_);
  if (!session_.wants_depth_map()) return {};
  if (auto map = draw_depth_map(client, *options_.lod.camera)) session_.send_depth_map(*std::move(map));
  return {};
}

Result<void> FetchSession::opened(const Description& description) {
  if (description.has_every_range && options_.shown.ranges.empty()) return misuse("'" + name_ + "' has every range: say which with --range LO HI");
  if (!options_.prefers_uniform || options_.shown.refine || description.refine != Refine::uniform) return {};
  return look(Refine::uniform);
}

Result<void> FetchSession::look(const std::optional<Refine>& refine) {
  return session_.look({.lod = options_.lod,
                        .budget = {.max_tets = options_.lod.max_tets.value_or(UINT64_MAX)},
                        .shown = {options_.shown.ranges, refine},
                        .early = takes_coarse_first(options_),
                        .channels = options_.channels,
                        .is_opaque = options_.is_opaque});
}

Fetched FetchSession::finish() && {
  stats_.session = session_.stats();
  stats_.is_complete = is_complete();
  stats_.seconds = elapsed();
  return {*std::move(session_).take_mesh(), stats_};
}

}  // namespace intervale

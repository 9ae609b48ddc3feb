#include "client/api/fetch_mesh.h"

#include <utility>

#include "client/api/data_set_url.h"
#include "client/net/fetch.h"
#include "client/net/http_get.h"
#include "common/api/describe_data_set.h"

namespace intervale {

Result<FetchedMesh> fetch_mesh(std::string_view text, const MeshRequest& request, const FetchMeshOptions& options) {
  const auto url = parse_data_set_url(text, options.access);
  if (!url) return tl::unexpected(url.error());
  if (auto valid = check_request(request); !valid) return tl::unexpected(valid.error());
  FetchOptions fetch_options;
  fetch_options.lod = request.lod;
  fetch_options.shown = request.shown;
  fetch_options.channels = request.channels;
  fetch_options.max_bytes = options.max_bytes;
  fetch_options.reconnect = options.reconnect;
  FetchEvents events{.on_batch = {}, .on_notice = options.on_notice};
  if (options.on_progress) {
    events.on_batch = [&options](const StreamClient& client, const FetchStats& stats) {
      options.on_progress({client.updates(), stats.session.updates_to_go, client.tet_count(), stats.session.bytes, stats.session.remaining_error});
    };
  }
  const auto fetched = fetch(*url, fetch_options, events);
  if (!fetched) return tl::unexpected(fetched.error());
  const FetchStats& stats = fetched->stats;
  return FetchedMesh{.mesh = fetched->client.mesh(),
                     .info = info_of(fetched->client.description()),
                     .is_complete = stats.is_complete,
                     .updates = fetched->client.updates_in_mesh(),
                     .bytes = stats.session.bytes,
                     .seconds_first_mesh = stats.seconds_first_mesh,
                     .seconds = stats.seconds};
}

Result<std::string> list_data_sets(std::string_view text, const Access& access) {
  const auto url = parse_url(text, access);
  if (!url) return tl::unexpected(url.error());
  return http_get(*url, "/api/datasets");
}

}  // namespace intervale

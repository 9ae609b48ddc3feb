#include "client/core/stream_client.h"

#include "common/base.h"
#include "common/update_codec.h"

namespace intervale {

StreamClient::StreamClient(Description description, Front front) : description_(std::move(description)), front_(std::move(front)) {}

Result<StreamClient> StreamClient::start(Description description, std::optional<std::uint64_t> max_tets) {
  if (auto ok = check_description(description); !ok) return fail("the server describes no volume: " + ok.error().message);
  const auto base = decode_base(description.base, Domain(description.grid.dims));
  if (!base) return tl::unexpected(base.error());
  Front front(description.grid, *base);
  StreamClient client(std::move(description), std::move(front));
  if (max_tets) client.max_tets_ = *max_tets;
  return client;
}

Result<void> StreamClient::apply(std::span<const std::uint8_t> payload) {
  const auto applied = apply_batch(front_, payload, max_tets_);
  if (!applied) return tl::unexpected(applied.error());
  if (importance_ && over_budget()) balance(front_, max_tets_, importance_);
  return {};
}

void StreamClient::look(const Camera& camera) {
  importance_ = size_on_screen(camera, description_.grid);
  if (over_budget()) balance(front_, max_tets_, importance_);
}

bool StreamClient::over_budget() const { return front_.shown_count() < front_.split_count() || front_.tet_count() > max_tets_; }
std::uint64_t StreamClient::updates() const { return front_.split_count(); }
std::uint64_t StreamClient::updates_in_mesh() const { return front_.shown_count(); }
std::uint64_t StreamClient::tet_count() const { return front_.tet_count(); }
const Description& StreamClient::description() const { return description_; }
const Front& StreamClient::front() const { return front_; }
Mesh StreamClient::mesh() const { return front_.mesh(); }

}  // namespace intervale

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
  client.max_tets_ = max_tets;
  client.over_budget_ = max_tets && client.front_.tet_count() > *max_tets;
  return client;
}

Result<void> StreamClient::apply(std::span<const std::uint8_t> payload) {
  if (over_budget_) return {};
  const auto applied = apply_batch(front_, payload, max_tets_);
  if (!applied) return tl::unexpected(applied.error());
  updates_ += applied->updates;
  over_budget_ = applied->over_budget;
  return {};
}

bool StreamClient::over_budget() const { return over_budget_; }
std::uint64_t StreamClient::updates() const { return updates_; }
std::uint64_t StreamClient::tet_count() const { return front_.tet_count(); }
const Description& StreamClient::description() const { return description_; }
const Front& StreamClient::front() const { return front_; }
Mesh StreamClient::mesh() const { return front_.mesh(); }

}  // namespace intervale

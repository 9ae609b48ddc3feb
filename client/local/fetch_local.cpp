#include "client/local/fetch_local.h"

#include <optional>
#include <string>
#include <utility>

#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"

namespace intervale {
namespace {

// Passes on what the client has to say. A message that the sending side refuses is answered by its fault.
std::optional<protocol::Fault> pass_messages(ClientSession& client, SessionState& server) {
  for (const auto& bytes : client.take_messages()) {
    const auto message = protocol::decode_client_message(bytes);
    if (!message) return protocol::Fault{protocol::CloseCode::malformed, message.error().message};
    if (auto fault = server.receive(*message)) return fault;
  }
  return {};
}

}  // namespace

Result<Fetched> fetch_local(const std::shared_ptr<const IntervalVolume>& volume, const FetchOptions& options, const FetchEvents& events) {
  if (auto ok = check_lod(options.lod); !ok) return tl::unexpected(ok.error());
  const std::string& name = volume->description().name;
  if (auto fits = protocol::check_sendable(volume->description()); !fits) return tl::unexpected(fits.error());
  LocalWorker worker;
  SessionState server([&volume](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return volume; }, worker);
  FetchSession fetch(name, "'" + name + "'", options, events);
  fetch.session().connected(FetchSession::Clock::now());
  while (!fetch.has_enough()) {
    std::optional<protocol::ServerMessage> message;
    if (auto fault = pass_messages(fetch.session(), server)) {
      message = std::move(*fault);
    } else {
      message = server.next();
    }
    if (!message) {
      if (server.waits() ? worker.work() : server.has_work()) continue;
      return fail("'" + name + "': the stream does not end");
    }
    const auto event = fetch.session().receive(protocol::encode(*message), FetchSession::Clock::now());
    if (!event) return tl::unexpected(event.error());
    if (auto received = fetch.received(*event); !received) return tl::unexpected(received.error());
  }
  return std::move(fetch).finish();
}

}  // namespace intervale

// One streaming session over a WebSocket. Internal to server/serve: brings in Asio and Beast.
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include <memory>

#include "protocol/transport/stream.h"
#include "server/serve/context.h"

namespace intervale {

// Who the session is for.
struct Peer {
  std::shared_ptr<const Scope> scope;  // nullptr: it has no right to be here, and is told so with close code 4401
  AddressCounts::Lease address_lease;
};

// Answers an upgrade request that offers our subprotocol and streams from then on. Returns at once; the session keeps itself alive.
void start_websocket_session(Stream stream, const boost::beast::http::request<boost::beast::http::empty_body>& request, ServerContext& context,
                             Peer guest);

}  // namespace intervale

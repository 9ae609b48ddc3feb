// One streaming session over a WebSocket. Internal to server/serve: brings in Asio and Beast.
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include <memory>

#include "protocol/transport/stream.h"
#include "server/serve/context.h"

namespace intervale {

// The client of a session.
struct Peer {
  // What its token grants; nullptr: no valid token, and the session is closed with 4401.
  std::shared_ptr<const Scope> scope;
  AddressCounts::Lease address_lease;
  Memory::Share memory;                        // of the connection
  std::shared_ptr<Accounts::Account> account;  // that pays for the session's work
};

// Accepts an upgrade request that offers the subprotocol, and runs the session. Does not block; the session keeps
// itself alive.
void start_websocket_session(Stream stream, const boost::beast::http::request<boost::beast::http::empty_body>& request, ServerContext& context,
                             Peer peer);

}  // namespace intervale

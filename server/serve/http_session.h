// One HTTP connection, until it closes or is upgraded to a WebSocket. Internal to server/serve: brings in Asio.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "server/serve/connection_executor.h"
#include "server/serve/context.h"
#include "server/serve/http_routes.h"

namespace intervale {

// Serves requests on a socket whose executor is a strand of its own, on a ConnectionExecutor of that payer. Does not block;
// the connection keeps itself alive.
void start_http_session(boost::asio::ip::tcp::socket socket, ServerContext& context, PortRole role, AddressCounts::Lease address_lease,
                        ConnectionPayerPtr payer);

}  // namespace intervale

// One streaming session over a WebSocket. Internal to server/serve: brings in Asio and Beast.
#pragma once

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "server/serve/context.h"

namespace intervale {

// Answers an upgrade request that offers our subprotocol and streams from then on. Returns at once; the session keeps itself alive.
void start_websocket_session(boost::beast::tcp_stream stream, const boost::beast::http::request<boost::beast::http::empty_body>& request,
                             ServerContext& context);

}  // namespace intervale

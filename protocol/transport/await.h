// How coroutines wait for operations on streams. Includes Asio.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace intervale {

// co_await of an operation with this token gives its error first, and does not throw it.
inline constexpr auto kAwait = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace intervale

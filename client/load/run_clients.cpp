#include "client/load/run_clients.h"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>
#include <memory>
#include <vector>

#include "client/load/load_client.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);

asio::awaitable<void> end_on_time(asio::steady_timer& timer, const LoadPlan& plan, std::vector<std::unique_ptr<LoadClient>>& clients) {
  timer.expires_at(plan.end());
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;  // all clients have ended already
  for (const auto& client : clients) {
    if (client) client->end_views();
  }
  timer.expires_at(plan.end() + kGrace);
  if (const auto [error] = co_await timer.async_wait(kAwait); error) co_return;
  for (const auto& client : clients) {
    if (client) client->leave();
  }
}

}  // namespace

LoadStats run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<StreamClient>> meshes, LoadProgress& progress) {
  asio::io_context io(1);
  const auto endpoints = tcp::resolver(io).resolve(plan.url.host, plan.url.port);
  LoadStats stats;
  std::vector<std::unique_ptr<LoadClient>> clients;
  for (unsigned number = first; number < plan.clients; number += step) {
    clients.push_back(std::make_unique<LoadClient>(io, endpoints, plan, number, stats, progress));
  }
  asio::steady_timer end(io);
  std::size_t running = clients.size();
  std::exception_ptr failure;
  for (std::size_t i = 0; i < clients.size(); ++i) {
    asio::co_spawn(io, clients[i]->run(), [&, i](const std::exception_ptr& thrown) {
      if (thrown) failure = thrown;
      if (plan.verify) meshes[first + i * step] = clients[i]->take_mesh();
      clients[i].reset();  // the timer of a closed WebSocket would keep the io_context running
      if (--running == 0) end.cancel();
    });
  }
  asio::co_spawn(io, end_on_time(end, plan, clients), [&](const std::exception_ptr& thrown) {
    if (thrown) failure = thrown;
  });
  io.run();
  if (failure) std::rethrow_exception(failure);
  return stats;
}

}  // namespace intervale

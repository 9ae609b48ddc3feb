#include "server/serve/serve.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <utility>

#include "server/serve/server.h"

namespace intervale {

Result<void> serve(const ServeOptions& options, const std::vector<std::filesystem::path>& inputs) {
  if (!spdlog::get("intervale")) spdlog::set_default_logger(spdlog::stderr_color_mt("intervale"));  // stdout is for results
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %v");
  std::signal(SIGPIPE, SIG_IGN);  // a client that left is an error code, not an end

  // Taken over before anything else, so that a signal during the start is not lost.
  boost::asio::io_context signals;
  boost::asio::signal_set wanted(signals, SIGINT, SIGTERM);
  int signal = 0;
  wanted.async_wait([&signal](const boost::system::error_code& error, int number) {
    if (!error) signal = number;
  });

  auto catalogue = Catalogue::load(inputs);
  if (!catalogue) return tl::unexpected(catalogue.error());
  const std::size_t count = catalogue->volumes().size();
  auto server = Server::start(options, std::move(*catalogue));
  if (!server) return tl::unexpected(server.error());
  spdlog::info("serving {} data set{} at {}", count, count == 1 ? "" : "s", (*server)->url());

  signals.run();
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  (*server)->stop();
  spdlog::info("stopped");
  return {};
}

}  // namespace intervale

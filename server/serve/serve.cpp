#include "server/serve/serve.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "server/serve/server.h"

namespace intervale {
namespace {

// Where a build and an installation alike put the viewer.
std::optional<std::filesystem::path> viewer_beside_the_program() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return {};
  auto folder = (program.parent_path() / ".." / "share" / "intervale" / "viewer").lexically_normal();
  if (!std::filesystem::exists(folder / "index.html", error)) return {};
  return folder;
}

}  // namespace

Result<void> serve(const ServeOptions& wanted, const std::vector<std::filesystem::path>& inputs) {
  if (!spdlog::get("intervale")) spdlog::set_default_logger(spdlog::stderr_color_mt("intervale"));  // stdout is for results
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %v");
  std::signal(SIGPIPE, SIG_IGN);  // a client that left is an error code, not an end

  // Taken over before anything else, so that a signal during the start is not lost.
  boost::asio::io_context signals;
  boost::asio::signal_set ending(signals, SIGINT, SIGTERM);
  int signal = 0;
  ending.async_wait([&signal](const boost::system::error_code& error, int number) {
    if (!error) signal = number;
  });

  ServeOptions options = wanted;
  if (!options.viewer) options.viewer = viewer_beside_the_program();
  auto catalogue = Catalogue::load(inputs);
  if (!catalogue) return tl::unexpected(catalogue.error());
  const std::size_t count = catalogue->volumes().size();
  auto server = Server::start(options, std::move(*catalogue));
  if (!server) return tl::unexpected(server.error());
  spdlog::info("serving {} data set{}{}{}", count, count == 1 ? "" : "s", options.viewer ? "; the viewer is at " : " at ", (*server)->url());

  signals.run();
  spdlog::info("{}: draining", signal == SIGINT ? "SIGINT" : "SIGTERM");
  (*server)->stop();
  spdlog::info("stopped");
  return {};
}

}  // namespace intervale

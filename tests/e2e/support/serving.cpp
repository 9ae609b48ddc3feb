#include "tests/e2e/support/serving.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "server/serve/catalogue_watch.h"

namespace intervale {

std::unique_ptr<Server> start(const ServeOptions& wanted, const std::filesystem::path& input) {
  spdlog::set_level(spdlog::level::off);
  ServeOptions options = wanted;
  options.listen = "127.0.0.1:0";
  options.threads = 2;
  auto server = Server::start(options, CatalogueWatch({input}).load().value());
  if (!server) throw std::runtime_error(server.error().message);
  return std::move(*server);
}

std::string get(std::uint16_t port, const std::string& target) {
  return talk(port, "GET " + target + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
}

Waiting::Waiting(std::uint16_t port) : client(port) {
  client.send(protocol::Open{"buckyball", "waiting", protocol::kMinCredit});
  client.send(kEverything);
  (void)client.expect<protocol::Opened>();
  updates = client.expect<protocol::Batch>().updates;
}

std::uint64_t Waiting::finish() {
  client.send(protocol::Credit{protocol::kDefaultWindow});
  return updates += client.stream_to_end();
}

}  // namespace intervale

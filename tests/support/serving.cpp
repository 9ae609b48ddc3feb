#include "tests/support/serving.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <iterator>
#include <stdexcept>

#include "server/serve/catalogue_watcher.h"

namespace intervale {

std::unique_ptr<Server> start(const ServeOptions& wanted, const std::filesystem::path& input) {
  spdlog::set_level(spdlog::level::off);
  ServeOptions options = wanted;
  options.listen = "127.0.0.1:0";
  options.threads = 2;
  auto server = Server::start(options);
  if (!server) throw std::runtime_error(server.error().message);
  (*server)->offer(CatalogueWatcher({input}, (*server)->memory()).load().value());
  return std::move(*server);
}

std::string get(std::uint16_t port, const std::string& target) {
  return talk(port, "GET " + target + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
}

double metric(std::uint16_t port, const std::string& name) {
  const std::string text = get(port, "/metrics");
  const std::string before = "\n" + name + " ";
  const std::size_t at = text.find(before);
  return at == std::string::npos ? -1 : std::stod(text.substr(at + before.size()));
}

bool eventually(const std::function<bool()>& holds) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!holds()) {
    if (std::chrono::steady_clock::now() >= until) return false;
  }
  return true;
}

std::size_t descriptors_of(int process) {
  const std::filesystem::directory_iterator all("/proc/" + std::to_string(process) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

std::uint64_t everything(std::uint16_t port, const protocol::Open& open) {
  RawClient client(port);
  client.send(open);
  client.send(kEverything);
  return client.stream_to_end();
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

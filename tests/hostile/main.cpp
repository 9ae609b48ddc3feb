// Hostile clients, many at once: run.py starts a server for them, and measures what an honest client gets meanwhile.
#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/net/connection.h"
#include "client/net/fetch.h"
#include "common/program/program.h"
#include "protocol/transport/await.h"
#include "tests/hostile/attacks.h"

namespace intervale {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::milliseconds kRetry{20};  // after a connection that was refused

struct Options {
  std::string attack, url;
  unsigned attackers = 20, addresses = 1;
  double seconds = 10;
  bool list = false;
};

// One connection after the other.
asio::awaitable<void> attack_on(const Attack& attack, Campaign& campaign, unsigned first, unsigned step) {
  const auto executor = co_await asio::this_coro::executor;
  asio::steady_timer pause(executor);
  for (std::uint64_t number = first;; number += step) {
    HostileConnection connection(executor, campaign.tally);
    const Turn turn{campaign, number};
    bool is_in = co_await connection.connect(campaign.server, source_of(campaign, first));
    if (is_in && attack.has_websocket) is_in = co_await connection.upgrade();
    if (is_in) co_await attack.act(connection, turn);
    if (is_in) continue;
    pause.expires_after(kRetry);
    co_await pause.async_wait(kAwait);
  }
}

Result<Description> describe(const ServerUrl& url) {
  auto connection = StreamConnection::open(url);
  if (!connection) return tl::unexpected(connection.error());
  ClientSession session({.dataset = url.name, .client = "hostile", .has_mesh = false});
  session.connected(ClientSession::Clock::now());
  if (auto sent = connection->send(session); !sent) return tl::unexpected(sent.error());
  if (const auto opened = connection->receive(session); !opened) return tl::unexpected(opened.error());
  connection->close();
  return *session.description();
}

// Of so many of the most important updates, the supercubes that hold the most of them.
Result<std::vector<SlotGroup>> choose_named(const ServerUrl& url, std::uint64_t updates) {
  FetchOptions options;
  options.lod.max_updates = updates;
  auto fetched = fetch(url, options, {});
  if (!fetched) return tl::unexpected(fetched.error());
  std::vector<SlotGroup> groups = fetched->client.resume();
  std::ranges::stable_sort(groups, std::greater(), [](const SlotGroup& group) { return std::popcount(group.slots); });
  groups.resize(std::min(groups.size(), protocol::kMaxHave));
  std::ranges::sort(groups, {}, &SlotGroup::key);
  return groups;
}

nlohmann::ordered_json to_json(const Campaign& campaign) {
  const Tally& tally = campaign.tally;
  return {{"attackers", campaign.attackers},
          {"addresses", campaign.addresses},
          {"connections", tally.connections},
          {"sessions", tally.sessions},
          {"messages", tally.messages},
          {"answers", tally.answers},
          {"ends", tally.ends},
          {"let_in_ms", campaign.let_in_ms ? nlohmann::ordered_json(*campaign.let_in_ms) : nlohmann::ordered_json()}};
}

// Until the time is over, the campaign stops, or a signal arrives.
void run(const Attack& attack, Campaign& campaign, double seconds) {
  asio::io_context io(1);
  campaign.stop = [&io] { io.stop(); };
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](auto...) { io.stop(); });
  asio::steady_timer end(io, std::chrono::duration_cast<asio::steady_timer::duration>(std::chrono::duration<double>(seconds)));
  end.async_wait([&io](auto...) { io.stop(); });
  const unsigned each = std::clamp(kMostConnections / campaign.attackers, 1u, attack.connections);
  std::exception_ptr failure;
  for (unsigned i = 0; i < campaign.attackers * each; ++i) {
    asio::co_spawn(io, attack_on(attack, campaign, i, campaign.attackers * each), [&](const std::exception_ptr& thrown) {
      failure = thrown;
      io.stop();
    });
  }
  io.run();
  if (failure) std::rethrow_exception(failure);
}

Result<void> run(const Options& options) {
  if (options.list) {
    std::string lines;
    for (const Attack& attack : attacks()) lines += fmt::format("{:<10} {}\n", attack.name, attack.help);
    return print(lines);
  }
  const auto attack = std::ranges::find(attacks(), options.attack, &Attack::name);
  if (attack == attacks().end()) return misuse("there is no attack '" + options.attack + "': see --list");
  const auto url = parse_url(options.url);
  if (!url) return tl::unexpected(url.error());
  boost::system::error_code error;
  const auto address = asio::ip::make_address_v4(url->host, error);
  if (error || !address.is_loopback()) return misuse("the server is to be at an address 127.0.0.0/8");
  auto description = describe(*url);
  if (!description) return tl::unexpected(description.error());
  if (description->has_every_range != attack->needs_every_range)
    return misuse(fmt::format("{} needs a data set of {}", attack->name, attack->needs_every_range ? "every range" : "one range"));
  Campaign campaign{.server = {address, std::uint16_t(std::stoul(url->port))},
                    .dataset = url->name,
                    .description = std::move(*description),
                    .attackers = options.attackers,
                    .addresses = options.addresses};
  if (attack->named_updates > 0) {
    auto named = choose_named(*url, attack->named_updates);
    if (!named) return tl::unexpected(named.error());
    campaign.named = std::move(*named);
  }
  if (auto printed = print("attacking\n"); !printed) return printed;
  run(*attack, campaign, options.seconds);
  return print_json(to_json(campaign));
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) {
  intervale::Program program("hostile_clients", "Attacks a server on this machine with many clients at once, and prints what they saw as JSON");
  intervale::Options options;
  CLI::App& app = program.only_command([&options] { return intervale::run(options); });
  app.add_flag("--list", options.list, "Print the attacks");
  app.add_option("ATTACK", options.attack, "Name of an attack");
  app.add_option("URL", options.url, "ws://127.0.0.1:port/NAME");
  app.add_option("--attackers", options.attackers, "Number of attackers")->check(CLI::Range(1, 5000))->capture_default_str();
  app.add_option("--addresses", options.addresses, "Source addresses of the attackers: 127.0.1.1 and on")
      ->check(CLI::Range(1, 250))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "Longest time; SIGTERM ends sooner")->check(CLI::Range(0.01, 3600.0))->capture_default_str();
  return program.run(argc, argv);
}

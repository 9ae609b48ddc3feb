// The attacks: what each connection of a hostile client does. Brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "tests/hostile/hostile_connection.h"

namespace intervale {

// What all attackers of a run share. One thread.
struct Campaign {
  boost::asio::ip::tcp::endpoint server;
  std::string dataset;
  Description description;
  std::vector<SlotGroup> named;  // updates that the attack names: at most protocol::kMaxHave supercubes
  unsigned attackers = 1;
  unsigned addresses = 1;
  Tally tally;
  std::function<void()> stop = {};  // ends the run

  // Of the attack crowd.
  bool is_full = false;             // the server has refused one of them
  unsigned waiting = 0, gone = 0;   // attackers that opened all they could; that left
  std::optional<double> let_in_ms;  // from when all had left until a new session had the mesh of a view
};

// One connection of an attacker.
struct Turn {
  Campaign& campaign;
  std::uint64_t number = 0;  // of the attacker's connection, 0, 1, …: another one for each connection of the run
};

struct Attack {
  const char* name;
  const char* help;  // one line
  // From a TCP connection, or from a WebSocket, to what the attacker does last. Another connection follows.
  boost::asio::awaitable<void> (*act)(HostileConnection& connection, const Turn& turn);
  bool has_websocket = true;
  unsigned connections = 1;         // of each attacker at once, but no more than kMostConnections in all
  std::uint64_t named_updates = 0;  // Campaign::named is chosen among so many of the most important updates
  bool needs_every_range = false;   // the data set has every range
};

inline constexpr unsigned kMostConnections = 5000;

[[nodiscard]] std::span<const Attack> attacks();

// The source address of an attacker.
[[nodiscard]] boost::asio::ip::address_v4 source_of(const Campaign& campaign, std::uint64_t attacker);

}  // namespace intervale

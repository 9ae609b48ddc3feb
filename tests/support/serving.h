// A server in this process, and a client in the middle of its stream.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/serve/server.h"
#include "tests/support/programs.h"
#include "tests/support/raw_client.h"

namespace intervale {

inline const protocol::Open kOpen{"buckyball", "test", protocol::kDefaultWindow};
inline const protocol::View kEverything{1, {}};

// On a free port, with two threads, whatever the options say of those; silent from then on. Throws if it cannot.
std::unique_ptr<Server> start(const ServeOptions& wanted = {}, const std::filesystem::path& input = buckyball());

// The whole answer to a GET, its head included, on a connection of its own.
[[nodiscard]] std::string get(std::uint16_t port, const std::string& target);

// What the server that listens there says of itself; -1: nothing under that name.
[[nodiscard]] double metric(std::uint16_t port, const std::string& name);

// What comes true once somebody has noticed; they have a minute.
[[nodiscard]] bool eventually(const std::function<bool()>& holds);

// How many a process has open.
[[nodiscard]] std::size_t descriptors_of(int process);

// The updates of a session that takes the whole stream.
std::uint64_t everything(std::uint16_t port, const protocol::Open& open = kOpen);

// Of the buckyball's: one batch received, no credit for a second.
struct Waiting {
  RawClient client;
  std::uint64_t updates = 0;
  explicit Waiting(std::uint16_t port);
  std::uint64_t finish();  // all updates that came
};

}  // namespace intervale

#include "tests/hostile/attacks.h"

#include <algorithm>
#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <cmath>
#include <list>

#include "client/load/camera_paths.h"
#include "client/load/range_path.h"
#include "protocol/codec.h"
#include "protocol/transport/await.h"

namespace intervale {
namespace {

namespace asio = boost::asio;
using namespace asio::experimental::awaitable_operators;
using protocol::ClientMessage;
using Clock = std::chrono::steady_clock;
using Until = HostileConnection::Until;

constexpr double kFine = 1e-3;                 // pixels: all updates matter
constexpr std::uint64_t kMuch = 3'000'000;     // updates
constexpr std::chrono::milliseconds kTick{5};  // between views: 200 a second
constexpr unsigned kHavesPerTick = 10;         // 2,000 a second
constexpr std::chrono::seconds kDrip{1};       // between bytes of a slow client
constexpr std::uint64_t kCrowd = 2000;         // most sessions of a crowd
constexpr std::chrono::milliseconds kPoll{20};

ClientMessage open_of(const Turn& turn, std::uint64_t credit = protocol::kMaxWindow) {
  return protocol::Open{turn.campaign.dataset, "hostile", credit};
}

ClientMessage everything() { return protocol::View{1, {}}; }

// A different camera with each epoch.
protocol::View view_of(const Turn& turn, Scenario scenario, double pixel_error, std::uint64_t epoch) {
  const CameraPath path{.scenario = scenario, .box = box_of(turn.campaign.description.grid), .pixel_error = pixel_error, .seed = turn.number + 1};
  return {.epoch = epoch, .lod = view_of(path, epoch)};
}

ClientMessage costly_view(const Turn& turn, std::uint64_t epoch) {
  protocol::View view = view_of(turn, Scenario::orbit, kFine, epoch);
  view.lod.max_updates = kMuch;
  return view;
}

asio::awaitable<void> sleep_until(Clock::time_point time) {
  const auto executor = co_await asio::this_coro::executor;  // named: g++ 12 destroys temporaries in a co_await twice
  asio::steady_timer timer(executor, time);
  co_await timer.async_wait(kAwait);
}

asio::awaitable<void> send_costly_views(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn);
  bool goes_on = co_await connection.send(open);
  for (std::uint64_t epoch = 1; goes_on; ++epoch) {
    const ClientMessage view = costly_view(turn, epoch);
    goes_on = co_await connection.send(view) && co_await connection.receive_answer(epoch, Until::first_answer);
  }
  co_await connection.receive_all();
}

asio::awaitable<void> send_a_costly_view(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn), view = costly_view(turn, 1);
  (void)co_await connection.send(open);
  (void)co_await connection.send(view);
  (void)co_await connection.receive_answer(1, Until::first_answer);
}

asio::awaitable<void> repeat_have(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = protocol::Open{turn.campaign.dataset, "hostile", protocol::kMaxWindow, turn.campaign.description.content_hash};
  const auto have = protocol::encode(ClientMessage(protocol::Have{turn.campaign.named}));
  bool goes_on = co_await connection.send(open);
  for (auto next = Clock::now(); goes_on; next += kTick) {
    for (unsigned i = 0; goes_on && i < kHavesPerTick; ++i) goes_on = co_await connection.send_bytes(have);
    co_await sleep_until(next);
  }
}

asio::awaitable<void> send_haves(HostileConnection& connection, const Turn& turn) {
  co_await (repeat_have(connection, turn) && connection.receive_all());
}

asio::awaitable<void> forget_and_ask_again(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn);
  bool goes_on = co_await connection.send(open);
  protocol::View view;
  for (const SlotGroup& group : turn.campaign.named)
    view.lod.max_updates = view.lod.max_updates.value_or(0) + std::uint64_t(std::popcount(group.slots));
  for (view.epoch = 1; goes_on; ++view.epoch) {
    const ClientMessage message = view;
    goes_on = co_await connection.send(message) && co_await connection.receive_answer(view.epoch, Until::done);
    view.forget = turn.campaign.named;
  }
  co_await connection.receive_all();
}

asio::awaitable<void> take_small_batches(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn, protocol::kMinCredit), view = everything();
  (void)co_await connection.send(open);
  (void)co_await connection.send(view);
  for (;;) {
    const auto message = co_await connection.receive();
    if (!message || std::holds_alternative<protocol::Done>(*message)) co_return;
    (void)co_await connection.send_credit();
  }
}

// The next view when it is due, whether the last one was answered or not.
template <class NextView>
asio::awaitable<void> send_views(HostileConnection& connection, const Turn& turn, NextView next_view) {
  const ClientMessage open = open_of(turn);
  bool goes_on = co_await connection.send(open);
  const auto start = Clock::now();
  for (std::uint64_t epoch = 1; goes_on; ++epoch) {
    const ClientMessage view = next_view(epoch);
    goes_on = co_await connection.send(view) && co_await connection.send_credit();
    co_await sleep_until(start + epoch * kTick);
  }
}

asio::awaitable<void> jump_about(HostileConnection& connection, const Turn& turn) {
  const auto next_view = [&turn](std::uint64_t epoch) { return view_of(turn, Scenario::jump, 1, epoch); };
  co_await (send_views(connection, turn, next_view) && connection.receive_all());
}

// Half of the views wait until the surfaces of their range are measured.
asio::awaitable<void> change_ranges(HostileConnection& connection, const Turn& turn) {
  const Range values = values_of(turn.campaign.description);
  const auto next_view = [&turn, values](std::uint64_t epoch) {
    const auto value = [&](std::uint64_t end) { return std::lerp(values.alpha, values.beta, random_fraction(turn.number, 2 * epoch + end)); };
    protocol::View view = view_of(turn, Scenario::orbit, 1, epoch);
    view.shown.ranges = {{std::min(value(0), value(1)), std::max(value(0), value(1))}};
    view.early = epoch % 2 == 0;
    return view;
  };
  co_await (send_views(connection, turn, next_view) && connection.receive_all());
}

asio::awaitable<void> vanish(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn), view = everything();
  (void)co_await connection.send(open);
  (void)co_await connection.send(view);
}

asio::awaitable<void> drip_request(HostileConnection& connection) {
  const std::string request = std::string("GET ") + protocol::kPath + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n";
  bool goes_on = true;
  for (std::size_t at = 0; goes_on && at < request.size(); ++at) {
    const std::string byte = request.substr(at, 1);
    goes_on = co_await connection.send_raw(byte);
    co_await sleep_until(Clock::now() + kDrip);
  }
}

asio::awaitable<void> drip_message(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn);
  bool goes_on = co_await connection.send(open);
  const auto view = protocol::encode(everything());
  for (std::size_t at = 0; goes_on && at + 1 < view.size(); ++at) {
    goes_on = co_await connection.send_fragment(view[at]);
    co_await sleep_until(Clock::now() + kDrip);
  }
}

asio::awaitable<void> send_slow_request(HostileConnection& connection) { co_await (drip_request(connection) && connection.receive_all_raw()); }

asio::awaitable<void> send_slow_message(HostileConnection& connection, const Turn& turn) {
  const bool is_in = co_await connection.upgrade();
  if (is_in) co_await (drip_message(connection, turn) && connection.receive_all());
}

asio::awaitable<void> drip(HostileConnection& connection, const Turn& turn) {
  return turn.number % 2 == 0 ? send_slow_request(connection) : send_slow_message(connection, turn);
}

asio::awaitable<void> stop_halfway(HostileConnection& connection, const Turn& /*turn*/) {
  const std::string half = std::string("GET ") + protocol::kPath + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnec";
  (void)co_await connection.send_raw(half);
  co_await connection.receive_all_raw();
}

// A session that has received the mesh of an ordinary view.
asio::awaitable<bool> enter(HostileConnection& connection, const Turn& turn) {
  const ClientMessage open = open_of(turn, protocol::kDefaultWindow), view = view_of(turn, Scenario::orbit, 2, 1);
  if (!co_await connection.connect(turn.campaign.server, source_of(turn.campaign, turn.number))) co_return false;
  if (!co_await connection.upgrade()) co_return false;
  if (!co_await connection.send(open) || !co_await connection.send(view)) co_return false;
  co_return co_await connection.receive_answer(1, Until::done);
}

asio::awaitable<void> measure_let_in(const Turn& turn) {
  const auto executor = co_await asio::this_coro::executor;
  const auto start = Clock::now();
  for (;;) {
    HostileConnection next(executor, turn.campaign.tally);
    if (co_await enter(next, turn)) break;
    co_await sleep_until(Clock::now() + kPoll);
  }
  turn.campaign.let_in_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  turn.campaign.stop();
}

// All attackers open sessions until one is refused, and then leave together.
asio::awaitable<void> crowd(HostileConnection& connection, const Turn& turn) {
  Campaign& campaign = turn.campaign;
  const auto executor = co_await asio::this_coro::executor;
  connection.reset();
  std::list<HostileConnection> sessions;
  while (!campaign.is_full && sessions.size() < kCrowd / campaign.attackers) {
    if (!co_await enter(sessions.emplace_back(executor, campaign.tally), turn)) campaign.is_full = true;
  }
  ++campaign.waiting;
  while (campaign.waiting < campaign.attackers) co_await sleep_until(Clock::now() + kPoll);
  sessions.clear();
  ++campaign.gone;
  while (campaign.gone < campaign.attackers) co_await sleep_until(Clock::now() + kPoll);
  if (turn.number == 0) co_await measure_let_in(turn);
  for (;;) co_await sleep_until(Clock::now() + std::chrono::hours(1));
}

constexpr std::array<Attack, 11> kAttacks{{
    {"budget", "sends views of 3 million updates that take long to choose, the next one at the first answer", send_costly_views},
    {"reconnect", "sends one such view on each connection", send_a_costly_view},
    {.name = "have", .help = "names 2,048 full supercubes again and again before the first view", .act = send_haves, .named_updates = 400'000},
    {.name = "forget", .help = "gives up all that it was sent, and asks for it again", .act = forget_and_ask_again, .named_updates = 30'000},
    {"endless", "asks for everything, and grants the least credit for each batch", take_small_batches},
    {"jump", "jumps to another camera 200 times a second", jump_about},
    {.name = "ranges",
     .help = "shows another range 200 times a second, of a data set of every range",
     .act = change_ranges,
     .needs_every_range = true},
    {"vanish", "asks for everything, and is gone at once", vanish},
    {.name = "slow", .help = "sends one byte a second: half of them of a request, half of them of a message", .act = drip, .has_websocket = false},
    {.name = "halfopen",
     .help = "sends half a request on each of up to 250 connections",
     .act = stop_halfway,
     .has_websocket = false,
     .connections = 250},
    {.name = "crowd", .help = "opens sessions until one is refused, leaves with all, and waits to be let in", .act = crowd, .has_websocket = false},
}};

}  // namespace

std::span<const Attack> attacks() { return kAttacks; }

asio::ip::address_v4 source_of(const Campaign& campaign, std::uint64_t attacker) {
  return asio::ip::address_v4({127, 0, 1, static_cast<unsigned char>(1 + attacker % campaign.addresses)});
}

}  // namespace intervale

// How soon a viewer draws another range of what it holds: the first picture of a drag, and those that follow.
//
// A client receives a view of a data set of every range until it is done. Then alpha moves by 5 % of the field, inwards
// and outwards, and by as much again. A step is what DrawnRange does until all triangles are there to be uploaded. One
// core, no connection, no drawing.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "client/view/coarse_front.h"
#include "client/view/drawn_range.h"
#include "common/ivm/every_range.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "server/builder/value_builder.h"
#include "tests/bench/cases.h"
#include "tests/bench/timing.h"

namespace intervale::bench {
namespace {

constexpr int kRuns = 5;
constexpr std::array<int, 2> kPixels{1280, 800};
constexpr double kPixelError = 4;
constexpr double kPart = 0.05;                                             // of the field, by which alpha moves
constexpr std::array<std::uint64_t, 4> kMost{~0ULL, 40000, 20000, 10000};  // updates that stay
using Sigma = std::shared_ptr<const IntervalVolume>;

Camera whole_view(const Grid& grid) {
  const auto [middle, diagonal] = frame_of(grid);
  Camera camera;
  camera.look_at = middle;
  camera.up = {0, 0, 1};
  const Vec3 towards = normalized({0.62, -1, 0.52});
  for (std::size_t i = 0; i < 3; ++i) camera.eye[i] = middle[i] + 1.5 * diagonal * towards[i];
  camera.viewport = kPixels;
  camera.pixel_error = kPixelError;
  return camera;
}

// A client that has received all that a view wants.
class Client {
 public:
  Client(const Sigma& sigma, const Range& range, Refine refine) {
    LocalWorker worker;
    SessionState server([&sigma](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return sigma; }, worker);
    ViewRequest request;
    request.lod.camera = whole_view(sigma->description().grid);
    request.shown = {.ranges = {range}, .refine = refine};
    if (auto looked = session_.look(request); !looked) throw std::runtime_error(looked.error().message);
    session_.connected({});
    while (!mesh_is_done()) {
      for (const auto& m : session_.take_messages()) {
        if (const auto fault = server.receive(*protocol::decode_client_message(m))) throw std::runtime_error(fault->text);
      }
      const auto message = server.next();
      if (message) {
        if (const auto event = session_.receive(protocol::encode(*message), {}); !event) throw std::runtime_error(event.error().message);
      } else if (!server.has_work() && server.waits()) {
        worker.work();
      }
    }
  }
  [[nodiscard]] const StreamClient& mesh() const { return *session_.mesh(); }

 private:
  [[nodiscard]] bool mesh_is_done() const { return session_.state() == ClientSession::State::idle; }
  ClientSession session_{{.dataset = "drag", .client = "bench_drag"}};
};

// Milliseconds of the first step of a drag, and of the second; and the triangles of the second.
struct Steps {
  std::vector<double> first, next;  // of each run
  std::size_t triangles = 0;
};

Steps steps(const StreamClient& client, Refine refine, const std::array<Range, 2>& ranges, int levels) {
  Steps steps;
  for (int run = 0; run < kRuns; ++run) {
    DrawnRange drawn(client.front());
    static_cast<void>(drawn.update(true, {}));  // what is seen before the drag
    for (const bool is_first : {true, false}) {
      const Range& range = ranges[is_first ? 0 : 1];
      const double seconds_taken = seconds([&] {
        drawn.use_coarse(client, levels, {range, refine});
        steps.triangles = 0;
        for (const std::uint32_t id : drawn.update(false, {}).pieces) steps.triangles += drawn.piece(id, false).indices.size() / 3;
        return 0;
      });
      (is_first ? steps.first : steps.next).push_back(1000 * seconds_taken);
    }
  }
  return steps;
}

void measure(const Case& c) {
  Volume samples = *c.volume;
  const Sigma sigma = std::make_shared<const IntervalVolume>(or_throw(of_every_range(build_value_volume(samples, c.format).take())));
  const Client client(sigma, c.range, c.refine);
  const std::vector<std::uint64_t> counts = counts_without_finest(client.mesh());
  const double width = c.format.greatest() - c.format.least();
  for (const double way : {kPart, -kPart}) {
    const auto moved = [&](double by) { return Range{std::min(c.range.alpha + by * width, c.range.beta), c.range.beta}; };
    for (const std::uint64_t most : kMost) {
      const auto levels = std::find_if(counts.begin(), counts.end(), [most](std::uint64_t count) { return count <= most; }) - counts.begin();
      const Steps s = steps(client.mesh(), c.refine, {moved(way), moved(2 * way)}, int(levels));
      fmt::print("| {} {} | {} | {} | {} | {} | {:.1f} | {:.1f} | {} |\n", c.name, range_text(c.range, c.refine), way > 0 ? "inwards" : "outwards",
                 client.mesh().updates(), levels, counts[std::size_t(levels)], median(s.first), median(s.next), s.triangles);
    }
  }
}

int run(int argc, char** argv) {
  fmt::print("Milliseconds; medians of {} runs, one core. {} x {} pixels, a view of {} px that is done.\n\n", kRuns, kPixels[0], kPixels[1],
             kPixelError);
  fmt::print(
      "| range | alpha moves | updates held | levels left out | updates that stay | first step | next step | triangles "
      "|\n|---|---|--:|--:|--:|--:|--:|--:|\n");
  for_each_case(argc, argv, measure);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

// bench_drag [CASE...]: cases as of cases.h; without any, samples of the product's own.
int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_drag", intervale::bench::run, argc, argv); }

// How well a mesh keeps up with a camera that turns, over a slow connection: the share of frames that are not right, with
// and without motion prefetch, and the bytes that were sent in vain.
//
// Client and server are the product's; the connection is a model in virtual time: what is sent waits for what was sent
// before, takes its time at the connection's rate, and arrives half a round trip later. Decoding takes no time.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/core/client_session.h"
#include "common/ivm/refinement.h"
#include "common/mesh/boundary.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "server/builder/field_hierarchy.h"
#include "tests/bench/cases.h"
#include "tests/support/cameras.h"
#include "tests/support/surfaces.h"

namespace intervale::bench {
namespace {

using testing::NaiveCamera;
using testing::SurfaceDistance;
using testing::Triangles;
using testing::Vector;
using Sigma = std::shared_ptr<const IntervalVolume>;
using Clock = ClientSession::Clock;
using Message = ClientSession::Message;
using Milliseconds = std::chrono::milliseconds;

constexpr int kPool = 40000;   // points on the full mesh's surface
constexpr int kPoints = 1500;  // of those, that are looked at in a frame, at most
constexpr double kRight = 4;   // a frame is right if 99 % of its points are off by at most so many pixels

struct Options {
  double degrees_per_second = 30, megabits_per_second = 10, pixel_error = 1;
  int round_trip = 50, view_interval = 100, frame_interval = 100;  // in ms
  int rest = 1000, turn = 4000;                                    // likewise: before the camera turns, and while it does
  std::vector<std::ptrdiff_t> motions;
  int queued = 64;  // KiB that the server's socket takes
};

// Where the camera is, and around what it turns.
struct Motion {
  const char* name;
  double away;  // from the middle, in diagonals of the box
  Vector direction;
  bool is_orbit;  // around the middle, which it looks at; otherwise around itself
};
constexpr std::array<Motion, 3> kMotions{{{"orbit, close", 0.6, {-0.8, 0.3, 0.52}, true},
                                          {"orbit, closer", 0.35, {-0.8, 0.3, 0.52}, true},
                                          {"turn, from within", 0.2, {0.9, 0.3, 0.3}, false}}};

Vector about_up(const Vector& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]};
}

Camera camera_at(const Motion& motion, const Options& options, const Grid& g, int time) {
  const auto [middle, diagonal] = frame_of(g);
  const double seconds = std::clamp(time - options.rest, 0, options.turn) / 1e3;
  const double angle = seconds * options.degrees_per_second * std::numbers::pi / 180, away = motion.away * diagonal;
  const Vector from = testing::unit(motion.direction);
  Camera camera;
  camera.eye = testing::along(middle, away, motion.is_orbit ? about_up(from, angle) : from);
  camera.look_at = motion.is_orbit ? middle : testing::along(camera.eye, -1, about_up(from, angle));
  camera.pixel_error = options.pixel_error;
  return camera;
}

// One direction of a connection.
class Line {
 public:
  Line(double bytes_per_ms, int delay) : bytes_per_ms_(bytes_per_ms), delay_(delay) {}
  void send(Message message, int now) {
    free_at_ = std::max(free_at_, double(now)) + double(message.size()) / bytes_per_ms_;
    on_its_way_.push_back({std::move(message), free_at_ + delay_});
  }
  [[nodiscard]] double queued(int now) const { return std::max(0.0, free_at_ - now) * bytes_per_ms_; }
  [[nodiscard]] std::optional<Message> arrived(int now) {
    if (on_its_way_.empty() || on_its_way_.front().at > now) return {};
    Message message = std::move(on_its_way_.front().message);
    on_its_way_.pop_front();
    return message;
  }

 private:
  struct Sent {
    Message message;
    double at = 0;
  };
  std::deque<Sent> on_its_way_;
  double bytes_per_ms_, free_at_ = 0;
  int delay_;
};

// The full mesh's surface.
struct Whole {
  Triangles surface;
  std::vector<Vector> pool;
  explicit Whole(const Sigma& sigma) {
    StreamClient full = or_throw(StreamClient::start(sigma->description()));
    StreamPlan plan(sigma);
    plan.set_lod(Lod{});
    while (const auto batch = plan.next(protocol::kMaxBatchPayload)) {
      if (const auto applied = full.apply(batch->payload); !applied) throw std::runtime_error(applied.error().message);
    }
    const Mesh mesh = full.mesh();
    surface = testing::triangles_of(mesh, boundary_triangles(mesh));
    std::mt19937 random(1);
    pool = testing::points_on(surface, kPool, random);
  }
};

// The deviation of 99 % of the points in the picture, in pixels.
double deviation(const Whole& whole, const SurfaceDistance& distance, const Camera& c) {
  const NaiveCamera camera(c);
  std::vector<double> off;
  for (const Vector& p : whole.pool) {
    if (off.size() == std::size_t(kPoints)) break;
    if (camera.shows(p)) off.push_back(distance(p) * camera.pixels_per_unit(p));
  }
  if (off.empty()) return 0;
  std::sort(off.begin(), off.end());
  return off[off.size() * 99 / 100];
}

// What came between two frames.
struct Arrival {
  int at = 0;
  double bytes = 0;
  std::vector<UpdateIndex> updates;
};

struct Figures {
  int frames = 0, wrong = 0;
  double mean_excess = 0;  // pixels beyond kRight, over all frames
  double bytes = 0, stale = 0;
};

class Run {
 public:
  Run(const Sigma& sigma, const Motion& motion, const Options& options, bool prefetches)
      : sigma_(sigma),
        motion_(motion),
        options_(options),
        prefetches_(prefetches),
        down_(options.megabits_per_second * 125, options.round_trip / 2),
        up_(options.megabits_per_second * 125, options.round_trip - options.round_trip / 2),
        held_(sigma->size()) {}

  Figures measure(const Whole& whole) {
    const int end = options_.rest + options_.turn;
    Figures figures;
    look(0);
    client_.connected(Clock::time_point{});
    std::optional<SurfaceDistance> distance;
    Triangles triangles;
    std::uint64_t drawn = 0;
    for (int now = 0; now < end; ++now) {
      if (now >= options_.rest && now % options_.view_interval == 0) look(now);
      exchange(now);
      if (now % options_.frame_interval == 0) note_arrivals(now);
      if (now < options_.rest || now % options_.frame_interval != 0) continue;
      ++figures.frames;
      if (!client_.mesh()) {
        ++figures.wrong;
        continue;
      }
      if (!distance || client_.mesh()->updates() != drawn) {
        const Mesh mesh = client_.mesh()->mesh();
        triangles = testing::triangles_of(mesh, boundary_triangles(mesh));
        distance.emplace(triangles);
        drawn = client_.mesh()->updates();
      }
      const double off = deviation(whole, *distance, camera(now));
      figures.wrong += off > kRight;
      figures.mean_excess += std::max(0.0, off - kRight);
    }
    figures.mean_excess /= figures.frames;
    count_bytes(figures);
    return figures;
  }

 private:
  [[nodiscard]] Camera camera(int time) const { return camera_at(motion_, options_, sigma_->description().grid, time); }

  void look(int now) {
    ViewRequest request;
    request.lod.camera = camera(now);
    const auto ahead = camera_motion_.next(*request.lod.camera, Clock::time_point(Milliseconds(now)));
    if (prefetches_) request.ahead = ahead;
    if (auto looked = client_.look(request); !looked) throw std::runtime_error(looked.error().message);
  }

  // All that happens within a millisecond.
  void exchange(int now) {
    for (Message& m : client_.take_messages()) up_.send(std::move(m), now);
    while (const auto m = up_.arrived(now)) {
      if (const auto fault = server_.receive(*protocol::decode_client_message(*m))) throw std::runtime_error(fault->text);
    }
    while (down_.queued(now) < 1024.0 * options_.queued) {
      const auto message = server_.next();
      if (!message && (server_.has_work() || (server_.waits() && worker_.work()))) continue;
      if (!message) break;
      down_.send(protocol::encode(*message), now);
    }
    while (const auto m = down_.arrived(now)) {
      const auto event = client_.receive(*m, Clock::time_point(Milliseconds(now)));
      if (!event) throw std::runtime_error(event.error().message);
      if (event->kind == ClientSession::Event::Kind::batch) new_bytes_ += m->size();
    }
  }

  // What came since the last time.
  void note_arrivals(int now) {
    if (!client_.mesh() || client_.mesh()->updates() == noted_) return;
    Arrival arrival{now, double(std::exchange(new_bytes_, 0)), {}};
    StreamClient mesh = *client_.mesh();
    noted_ = mesh.updates();
    for (const SlotGroup& g : mesh.resume()) {
      const auto found = *sigma_->set().find_supercube(scale_of_key(g.key), position_of_key(g.key));
      for (const Slot slot : set_bits<Slot>(g.slots)) {
        const Place place = sigma_->set().place_in(found.brick, found.supercube, g.key, slot);
        if (held_.contains(place)) continue;
        held_.insert(place);
        arrival.updates.push_back(place.index);
      }
    }
    arrivals_.push_back(std::move(arrival));
  }

  // Stale: of updates that no view wanted from when they arrived on.
  void count_bytes(Figures& figures) {
    std::vector<int> last(sigma_->size(), -1);
    for (int now = 0; now < options_.rest + options_.turn; now += options_.frame_interval) {
      if (now != 0 && now < options_.rest) continue;
      Lod lod;
      lod.camera = camera(now);
      const SplitSet wanted = select(*sigma_, lod);
      sigma_->set().for_each_down([&](const Place& p) {
        if (wanted.contains(p)) last[p.index] = std::max(now, options_.rest);
      });
    }
    for (const Arrival& a : arrivals_) {
      figures.bytes += a.bytes;
      const auto in_vain = std::count_if(a.updates.begin(), a.updates.end(), [&](UpdateIndex i) { return last[i] < a.at; });
      if (!a.updates.empty()) figures.stale += a.bytes * double(in_vain) / double(a.updates.size());
    }
  }

  const Sigma& sigma_;
  const Motion& motion_;
  const Options& options_;
  bool prefetches_;
  CameraMotion camera_motion_;
  LocalWorker worker_;
  SessionState server_{[this](const std::string&) { return sigma_; }, worker_};
  ClientSession client_{{.dataset = "motion", .client = "bench_motion"}};
  Line down_, up_;
  SplitSet held_;
  std::vector<Arrival> arrivals_;
  std::size_t new_bytes_ = 0;
  std::uint64_t noted_ = 0;
};

void measure(const Case& c, const Options& options) {
  const FieldHierarchy hierarchy(*c.volume, {c.range, c.refine, {}});
  const auto sigma = std::make_shared<const IntervalVolume>(or_throw(hierarchy.compact(c.format)));
  const Whole whole(sigma);
  for (const Motion& motion : kMotions) {
    if (!options.motions.empty() && std::find(options.motions.begin(), options.motions.end(), &motion - kMotions.data()) == options.motions.end())
      continue;
    for (const bool prefetches : {false, true}) {
      const Figures f = Run(sigma, motion, options, prefetches).measure(whole);
      fmt::print("| {} {} | {} | {} | {:.1f} % | {:.2f} | {:.0f} | {:.0f} |\n", c.name, range_text(c.range, c.refine), motion.name,
                 prefetches ? "with" : "without", 100.0 * f.wrong / f.frames, f.mean_excess, f.bytes / 1e3, f.stale / 1e3);
      std::fflush(stdout);
    }
  }
}

int run(int argc, char** argv) {
  CLI::App app("Measures how well a mesh keeps up with a camera that turns, with and without motion prefetch, and prints a table in Markdown",
               "bench_motion");
  std::vector<std::string> volumes, samples;
  int size = 65;
  Options options;
  app.add_option("--volume", volumes, fmt::format("A volume and a range: {}. May be given again", kCaseSyntax))
      ->type_name("CASE")
      ->allow_extra_args(false);
  app.add_option("--samples", samples, "The product's own samples to measure");
  app.add_option("--size", size, "Samples a side of those")->capture_default_str();
  app.add_option("--speed", options.degrees_per_second, "Of the turn, in degrees a second")->capture_default_str();
  app.add_option("--rate", options.megabits_per_second, "Of the connection, in Mbit/s")->capture_default_str();
  app.add_option("--round-trip", options.round_trip, "In ms")->capture_default_str();
  app.add_option("--pixel-error", options.pixel_error, "Of the views")->capture_default_str();
  app.add_option("--view-interval", options.view_interval, "In ms")->capture_default_str();
  app.add_option("--frame-interval", options.frame_interval, "In ms, of the frames that are measured")->capture_default_str();
  app.add_option("--rest", options.rest, "In ms, before the camera turns")->capture_default_str();
  app.add_option("--turn", options.turn, "In ms, while it turns")->capture_default_str();
  app.add_option("--motion", options.motions, "By number, from 0; all if there is none");
  app.add_option("--queue", options.queued, "In KiB: what the server's socket takes")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  fmt::print("| volume, range | motion | prefetch | frames not within {} px | mean px beyond | kB | kB stale |\n|---|---|---|--:|--:|--:|--:|\n",
             kRight);
  for (const auto& text : volumes) measure(or_throw(read_case(text)), options);
  for (const auto& name : samples) measure(or_throw(sample_case(name, size)), options);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_motion", intervale::bench::run, argc, argv); }

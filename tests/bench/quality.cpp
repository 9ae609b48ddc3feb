// How soon a picture is right: bytes received against the deviation measured on the screen, and against the noise in the
// picture as it is drawn, for the order in which we send and for others.
//
// Deviation is measured, not estimated: points are spread over the full mesh's surface, those in the picture are kept,
// and for each the distance to the surface of the mesh so far is taken, in pixels where the point is.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/core/stream_client.h"
#include "common/front/batch_decoder.h"
#include "common/ivm/batch_encoder.h"
#include "common/ivm/every_range.h"
#include "common/ivm/refinement.h"
#include "common/mesh/boundary.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/picture/canvas.h"
#include "common/ranges/find_relevant_updates.h"
#include "common/selection/stream_plan.h"
#include "common/view/depth_map.h"
#include "protocol/limits.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "tests/bench/cases.h"
#include "tests/bench/quality.h"
#include "tests/support/cameras.h"
#include "tests/support/surfaces.h"

namespace intervale::bench {
namespace {

using testing::NaiveCamera;
using testing::SurfaceDistance;
using testing::Triangles;
using testing::Vector;

constexpr double kPixelError = 1;
constexpr double kEnough = 0.4;       // pixels: no need to look further
constexpr double kFirstBytes = 2048;  // of the first picture that is measured; each further one has half as much again

using Sigma = std::shared_ptr<const IntervalVolume>;

struct Look {
  const char* name;
  double away;  // from the middle, in diagonals of the box
  Vector direction;
};
constexpr std::array<Look, kLookNames.size()> kLooks{
    {{"all of it", 1.2, {0.5, 0.4, -0.77}}, {kLookNames[1], 0.6, {-0.8, 0.3, 0.52}}, {kLookNames[2], 0.2, {0.3, -0.9, 0.3}}}};

Lod lod_of(const Look& look, const Grid& g) {
  const auto [middle, diagonal] = frame_of(g);
  Lod lod;
  lod.camera.emplace();
  lod.camera->look_at = middle;
  lod.camera->eye = testing::along(middle, look.away * diagonal, testing::unit(look.direction));
  lod.camera->up = {0, 1, 0};
  lod.camera->viewport = {1920, 1080};
  lod.camera->pixel_error = kPixelError;
  return lod;
}

// As the programs draw it.
std::vector<std::uint8_t> drawn(const Mesh& mesh, Camera camera, const Box& box) {
  camera.viewport = kDrawn;
  const Viewpoint viewpoint(camera, box);
  auto canvas = or_throw(Canvas::create(kDrawn, viewpoint, {}));
  for_each_triangle(mesh, {}, viewpoint, [&canvas](std::span<const Corner> corners) { canvas.draw(corners); });
  return or_throw(canvas.finish()).rgb;
}

// The full mesh's surface, as points in one picture, and drawn.
struct Picture {
  static constexpr Deviation kAllIsMissing{1e9, 1e9, 1e9, 1e9};
  Camera seen_from;
  Box box;
  std::vector<std::uint8_t> pixels;
  NaiveCamera camera;
  const SurfaceDistance& whole;  // outlives this
  std::vector<Vector> points;

  Picture(const Mesh& mesh, const Triangles& full, const SurfaceDistance& distance, const Camera& c, const Box& b)
      : seen_from(c), box(b), pixels(drawn(mesh, c, b)), camera(c), whole(distance) {
    std::mt19937 random(1);
    for (int tries = 0; tries < 40 && points.size() < std::size_t(kPoints); ++tries) {
      for (const Vector& p : testing::points_on(full, kPoints, random)) {
        if (camera.shows(p) && points.size() < std::size_t(kPoints)) points.push_back(p);
      }
    }
    if (points.size() < 100) throw std::runtime_error("there is next to nothing to be seen");
  }

  // How the picture of a mesh differs.
  void compare(const Mesh& mesh, Point& to) const {
    constexpr int kVisible = 16;  // of 255
    const auto other = drawn(mesh, seen_from, box);
    double sum = 0;
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
      int most = 0;
      for (std::size_t k = i; k < i + 3; ++k) {
        const int off = std::abs(int(pixels[k]) - int(other[k]));
        sum += double(off) * off;
        most = std::max(most, off);
      }
      wrong += most > kVisible;
    }
    to.decibels = sum == 0 ? 99 : std::min(99.0, 10 * std::log10(255.0 * 255 * double(pixels.size()) / sum));
    to.wrong_percent = 300.0 * double(wrong) / double(pixels.size());
  }

  // Of the full mesh's surface from a mesh's, and of that from the full one's: what is missing, and what is too much.
  [[nodiscard]] std::array<Deviation, 2> deviations(const Mesh& mesh) const {
    const Triangles triangles = testing::triangles_of(mesh, boundary_triangles(mesh));
    if (triangles.empty()) return {kAllIsMissing, kAllIsMissing};
    std::mt19937 random(2);
    std::vector<Vector> its;
    for (const Vector& p : testing::points_on(triangles, kPoints, random)) {
      if (camera.shows(p)) its.push_back(p);
    }
    return {of(points, SurfaceDistance(triangles)), its.empty() ? kAllIsMissing : of(its, whole)};
  }

 private:
  [[nodiscard]] Deviation of(const std::vector<Vector>& some, const SurfaceDistance& distance) const {
    std::vector<double> off;
    off.reserve(some.size());
    for (const Vector& p : some) off.push_back(distance(p) * camera.pixels_per_unit(p));
    std::sort(off.begin(), off.end());
    return {off[off.size() / 2], off[off.size() * 9 / 10], off[off.size() * 99 / 100], off.back()};
  }
};

// The fewest bytes that we know for some updates, closed under parents: as few batches as can be, each along the Morton
// curve.
std::size_t bytes_of(const IntervalVolume& volume, const SplitSet& updates) {
  const SupercubeSet& set = volume.set();
  SplitSet sent(set);
  std::size_t bytes = 0;
  std::vector<SlotGroup> groups;
  std::uint64_t count = 0;
  const auto flush = [&] {
    if (!groups.empty()) bytes += encode_batch(volume, {volume.description().whole()}, sent, groups).size();
    groups.clear();
    count = 0;
  };
  for (const SlotGroup& g : updates.groups(set)) {
    const auto more = std::uint64_t(std::popcount(g.slots));
    if (count + more > kBatchUpdatesMost) flush();
    count += more;
    groups.push_back(g);
    sent.insert(g.brick, g.key, g.slots);
  }
  flush();
  return bytes;
}

using NextBatch = std::function<std::optional<std::vector<std::uint8_t>>(const StreamClient&)>;
using BytesSoFar = std::function<double()>;

// Takes batches as a client does, and measures what it has now and then.
Curve follow(const IntervalVolume& volume, const Picture& picture, const NextBatch& next, const BytesSoFar& bytes_so_far = {},
             const RangeRequest& shown = {}) {
  StreamClient client = or_throw(StreamClient::start(volume.description(), {}, shown));
  Curve curve;
  double bytes = 0, due = kFirstBytes;
  bool more = true;
  while (more) {
    const auto batch = next(client);
    more = batch.has_value();
    if (more) {
      if (const auto applied = client.apply(*batch, 0, shown); !applied) throw std::runtime_error(applied.error().message);
      bytes += double(batch->size());
      if (bytes < due) continue;
    }
    while (due <= bytes) due *= 1.5;
    const Mesh mesh = client.mesh();
    Point point;
    point.bytes = bytes_so_far ? bytes_so_far() : bytes;
    const auto [missing, too_much] = picture.deviations(mesh);
    point.missing = missing;
    point.too_much = too_much;
    picture.compare(mesh, point);
    curve.push_back(point);
    if (point.missing.of_99 < kEnough) break;
  }
  return curve;
}

DepthMap depth_map_of(const Mesh& mesh, const Camera& camera) {
  DepthBuffer buffer(camera);
  for (const auto& triangle : testing::triangles_of(mesh, boundary_triangles(mesh))) buffer.draw(triangle);
  return buffer.map();
}

// with_depth: as a client that sends a depth map whenever it has twice as many updates as at the last. shown: of a data
// set of every range, of which it is measured how far its surfaces move.
Curve follow_plan(const Sigma& sigma, const Picture& picture, const Lod& lod, bool with_depth = false, const RangeRequest& shown = {}) {
  StreamPlan plan(sigma);
  if (!shown.ranges.empty()) plan.set_relevant(find_relevant_updates(sigma, resolve(sigma->description(), shown), Distances::measured));
  plan.set_lod(lod);
  std::size_t bytes = 0;
  std::uint64_t due = kDepthMapUpdates;
  return follow(
      *sigma, picture,
      [&](const StreamClient& client) -> std::optional<std::vector<std::uint8_t>> {
        if (with_depth && client.updates() >= due) {
          due = 2 * client.updates();
          const DepthMap map = depth_map_of(client.mesh(), *lod.camera);
          plan.set_lod(lod, &map);
        }
        const std::size_t most = next_payload(bytes, protocol::kMaxBatchPayload);
        auto batch = plan.next(most);
        while (!batch && !plan.done()) batch = plan.next(most);
        if (!batch) return {};
        bytes += batch->payload.size();
        return std::move(batch->payload);
      },
      {}, shown);
}

// A range of a data set of every range, as a session sends it. What can be sent by estimates is sent before the first
// surface is measured: the worst case.
Curve follow_afresh(const Sigma& every, const Picture& picture, const Lod& lod, const RangeRequest& shown) {
  LocalWorker worker;
  const auto open = [&every](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return every; };
  SessionState session(open, worker);
  const auto tell = [&session](const protocol::ClientMessage& message) {
    if (const auto fault = session.receive(message)) throw std::runtime_error(fault->text);
  };
  tell(protocol::Open{.dataset = "every", .client = "bench", .credit = protocol::kMaxWindow});
  tell(protocol::View{.epoch = 1, .lod = lod, .shown = shown, .early = true});
  const auto next = [&](const StreamClient&) -> std::optional<std::vector<std::uint8_t>> {
    while (true) {
      auto message = session.next();
      if (message) {
        if (auto* const batch = std::get_if<protocol::Batch>(&*message)) {
          tell(protocol::Credit{protocol::cost_of(*batch)});
          return std::move(batch->payload);
        }
        if (std::holds_alternative<protocol::Done>(*message)) return {};
      } else if (session.waits()) {
        if (!worker.work()) throw std::runtime_error("the session waits for nothing");
      }
    }
  };
  return follow(*every, picture, next, {}, shown);
}

// Updates one by one, in batches that grow by an eighth. at_least: each prefix counts the fewest bytes it can be had
// for, not what it took.
Curve follow_list(const Sigma& sigma, const Picture& picture, const std::vector<UpdateIndex>& order, bool at_least) {
  const SupercubeSet& set = sigma->set();
  SplitSet sent(set);
  std::size_t at = 0;
  const auto next = [&](const StreamClient&) -> std::optional<std::vector<std::uint8_t>> {
    const std::size_t end = std::min({order.size(), at + std::max<std::size_t>(500, at / 8), at + kBatchUpdatesMost});
    if (at == end) return {};
    SplitSet some(set);
    for (; at < end; ++at) {
      const Place place = set.place(order[at]);
      some.insert(place);
      sent.insert(place);
    }
    return encode_batch(*sigma, {sigma->description().whole()}, sent, some.groups(set));
  };
  return follow(*sigma, picture, next, at_least ? BytesSoFar([&] { return double(bytes_of(*sigma, sent)); }) : BytesSoFar());
}

std::vector<Row> measure(const Case& c) {
  const FieldHierarchy hierarchy(*c.volume, {c.range, c.refine, {}});
  const auto sigma = std::make_shared<const IntervalVolume>(or_throw(hierarchy.compact(c.format)));
  Volume samples = *c.volume;
  const auto every = std::make_shared<const IntervalVolume>(or_throw(of_every_range(build_value_volume(samples, c.format).take())));
  const RangeRequest shown{{c.range}, c.refine};
  std::vector<UpdateIndex> all(sigma->size()), by_level;
  std::iota(all.begin(), all.end(), UpdateIndex(0));
  sigma->set().for_each_down([&](const Place& p) { by_level.push_back(p.index); });
  StreamClient full = or_throw(StreamClient::start(sigma->description()));
  {
    StreamPlan plan(sigma);
    plan.set_lod(Lod{});
    while (const auto batch = plan.next(protocol::kMaxBatchPayload)) {
      if (const auto applied = full.apply(batch->payload); !applied) throw std::runtime_error(applied.error().message);
    }
  }
  const Mesh mesh = full.mesh();
  const Triangles surface = testing::triangles_of(mesh, boundary_triangles(mesh));
  const SurfaceDistance distance(surface);
  std::vector<Row> rows;
  for (const Look& look : kLooks) {
    const Lod lod = lod_of(look, sigma->description().grid);
    const Picture picture(mesh, surface, distance, *lod.camera, box_of(sigma->description().grid));
    Row row{fmt::format("{} {}", c.name, range_text(c.range, c.refine)), look.name, {}, 0, 0};
    row.curves[kOurs] = follow_plan(sigma, picture, lod);
    row.curves[kHiddenLast] = follow_plan(sigma, picture, lod, true);
    const SplitSet wanted = select(*sigma, lod);
    Lod to_the_end = lod;
    to_the_end.camera->pixel_error = 1e-3;
    row.curves[kIdeal] = follow_list(sigma, picture, in_order(*sigma, select(*sigma, to_the_end), to_the_end), true);
    row.curves[kByError] = follow_plan(sigma, picture, Lod{});
    row.curves[kByLevel] = follow_list(sigma, picture, by_level, false);
    row.curves[kAfresh] = follow_afresh(every, picture, lod, shown);
    row.curves[kMeasured] = follow_plan(every, picture, lod, false, shown);
    row.least_bytes = double(bytes_of(*sigma, wanted));
    StreamPlan plan(sigma);
    plan.set_lod(lod);
    for (std::size_t bytes = 0; !plan.done(); row.done_bytes = double(bytes)) {
      if (const auto batch = plan.next(next_payload(bytes, protocol::kMaxBatchPayload))) bytes += batch->payload.size();
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

int run(int argc, char** argv) {
  CLI::App app("Measures how many bytes it takes until a picture is right, for our order and for others, and prints a table in Markdown",
               "bench_quality");
  std::vector<std::string> volumes, samples;
  int size = 65;
  std::string picture;
  app.add_option("--volume", volumes, fmt::format("A volume and a range: {}. May be given again", kCaseSyntax))
      ->type_name("CASE")
      ->allow_extra_args(false);
  app.add_option("--samples", samples, "The product's own samples to measure");
  app.add_option("--size", size, "Samples a side of those")->capture_default_str();
  app.add_option("--svg", picture, "Where to draw the curves")->type_name("FILE");
  CLI11_PARSE(app, argc, argv);
  std::vector<Case> cases;
  cases.reserve(volumes.size() + samples.size());
  for (const auto& text : volumes) cases.push_back(or_throw(read_case(text)));
  for (const auto& name : samples) cases.push_back(or_throw(sample_case(name, size)));
  std::vector<Row> rows;
  for (const Case& c : cases) {
    for (Row& row : measure(c)) rows.push_back(std::move(row));
  }
  if (rows.empty()) return 0;
  print_bytes(rows);
  print_pictures(rows);
  print_deviations(rows);
  if (!picture.empty()) draw_curves(rows, picture);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_quality", intervale::bench::run, argc, argv); }

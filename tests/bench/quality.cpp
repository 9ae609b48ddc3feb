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
#include "common/ivm/refinement.h"
#include "common/mesh/boundary.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/picture/canvas.h"
#include "common/selection/stream_plan.h"
#include "common/view/depth_map.h"
#include "protocol/limits.h"
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

constexpr double kPixelError = 1;
constexpr double kEnough = 0.4;       // pixels: no need to look further
constexpr double kFirstBytes = 4096;  // of the first picture that is measured; each further one has half as much again
constexpr int kPoints = 3000;
constexpr std::array<int, 2> kDrawn{640, 360};  // pixels

using Sigma = std::shared_ptr<const IntervalVolume>;

struct Look {
  const char* name;
  double away;  // from the middle, in diagonals of the box
  Vector direction;
};
constexpr std::array<Look, 3> kLooks{
    {{"all of it", 1.2, {0.5, 0.4, -0.77}}, {"close", 0.6, {-0.8, 0.3, 0.52}}, {"from within", 0.2, {0.3, -0.9, 0.3}}}};

Lod lod_of(const Look& look, const Grid& g) {
  Vector middle, side;
  for (int i = 0; i < 3; ++i) {
    side[i] = g.affine.spacing()[i] * (g.dims[i] - 1);
    middle[i] = g.affine.origin()[i] + side[i] / 2;
  }
  Lod lod;
  lod.camera.emplace();
  lod.camera->look_at = middle;
  lod.camera->eye = testing::along(middle, look.away * testing::length(side), testing::unit(look.direction));
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
  Camera seen_from;
  Box box;
  std::vector<std::uint8_t> pixels;
  NaiveCamera camera;
  std::vector<Vector> points;

  Picture(const Mesh& mesh, const Triangles& full, const Camera& c, const Box& b) : seen_from(c), box(b), pixels(drawn(mesh, c, b)), camera(c) {
    std::mt19937 random(1);
    for (int tries = 0; tries < 40 && points.size() < std::size_t(kPoints); ++tries) {
      for (const Vector& p : testing::points_on(full, kPoints, random)) {
        if (camera.shows(p) && points.size() < std::size_t(kPoints)) points.push_back(p);
      }
    }
    if (points.size() < 100) throw std::runtime_error("there is next to nothing to be seen");
  }

  // The peak signal-to-noise ratio, in decibels, of the picture of a mesh.
  [[nodiscard]] double decibels(const Mesh& mesh) const {
    const auto other = drawn(mesh, seen_from, box);
    double sum = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) sum += (double(pixels[i]) - other[i]) * (double(pixels[i]) - other[i]);
    return sum == 0 ? 99 : std::min(99.0, 10 * std::log10(255.0 * 255 * double(pixels.size()) / sum));
  }

  struct Deviation {
    double most = 0, worst = 0;  // of 99 % of the points; of all
  };
  [[nodiscard]] Deviation deviation(const Mesh& mesh) const {
    const Triangles triangles = testing::triangles_of(mesh, boundary_triangles(mesh));
    if (triangles.empty()) return {1e9, 1e9};
    const SurfaceDistance distance(triangles);
    std::vector<double> off;
    for (const Vector& p : points) off.push_back(distance(p) * camera.pixels_per_unit(p));
    std::sort(off.begin(), off.end());
    return {off[off.size() * 99 / 100], off.back()};
  }
};

// The fewest bytes that we know for some updates, closed under parents: as few batches as can be, each along the Morton
// curve.
std::size_t bytes_of(const IntervalVolume& volume, const SplitSet& updates) {
  const SupercubeSet& set = volume.set();
  SplitSet sent(volume.size());
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
    for (std::uint64_t left = g.slots; left != 0; left &= left - 1) {
      sent.insert(set.place_in(g.brick, g.supercube, g.key, Slot(std::countr_zero(left))).index);
    }
  }
  flush();
  return bytes;
}

struct Order {
  const char* name;
  const char* color;
};
constexpr std::array<Order, 5> kOrders{{{"Intervale", "#0b6e4f"},
                                        {"ideal", "#888888"},
                                        {"by field error", "#c1440e"},
                                        {"by level", "#3b5ba5"},
                                        {"Intervale with depth maps", "#8e44ad"}}};
constexpr std::size_t kOurs = 0, kIdeal = 1, kByLevel = 3, kHiddenLast = 4;

struct Point {
  double bytes = 0;
  Picture::Deviation deviation;
  double decibels = 0;
};
using Curve = std::vector<Point>;

using NextBatch = std::function<std::optional<std::vector<std::uint8_t>>(const StreamClient&)>;
using BytesSoFar = std::function<double()>;

// Takes batches as a client does, and measures what it has now and then.
Curve follow(const IntervalVolume& volume, const Picture& picture, const NextBatch& next, const BytesSoFar& bytes_so_far = {}) {
  StreamClient client = or_throw(StreamClient::start(volume.description()));
  Curve curve;
  double bytes = 0, due = kFirstBytes;
  bool more = true;
  while (more) {
    const auto batch = next(client);
    more = batch.has_value();
    if (more) {
      if (const auto applied = client.apply(*batch); !applied) throw std::runtime_error(applied.error().message);
      bytes += double(batch->size());
      if (bytes < due) continue;
    }
    while (due <= bytes) due *= 1.5;
    const Mesh mesh = client.mesh();
    curve.push_back({bytes_so_far ? bytes_so_far() : bytes, picture.deviation(mesh), picture.decibels(mesh)});
    if (curve.back().deviation.most < kEnough) break;
  }
  return curve;
}

DepthMap depth_map_of(const Mesh& mesh, const Camera& camera) {
  DepthBuffer buffer(camera);
  for (const auto& triangle : testing::triangles_of(mesh, boundary_triangles(mesh))) buffer.draw(triangle);
  return buffer.map();
}

// with_depth: as a client that sends a depth map whenever it has twice as many updates as at the last.
Curve follow_plan(const Sigma& sigma, const Picture& picture, const Lod& lod, bool with_depth = false) {
  StreamPlan plan(sigma);
  plan.set_lod(lod);
  std::size_t target = kFirstPayload;
  std::uint64_t due = kDepthMapUpdates;
  return follow(*sigma, picture, [&](const StreamClient& client) -> std::optional<std::vector<std::uint8_t>> {
    if (with_depth && client.updates() >= due) {
      due = 2 * client.updates();
      const DepthMap map = depth_map_of(client.mesh(), *lod.camera);
      plan.set_lod(lod, &map);
    }
    auto batch = plan.next(target);
    while (!batch && !plan.done()) batch = plan.next(target);
    if (!batch) return {};
    target = std::min(2 * target, protocol::kMaxBatchPayload);
    return std::move(batch->payload);
  });
}

// Updates one by one, in batches that grow by an eighth. at_least: each prefix counts the fewest bytes it can be had
// for, not what it took.
Curve follow_list(const Sigma& sigma, const Picture& picture, const std::vector<UpdateIndex>& order, bool at_least) {
  const SupercubeSet& set = sigma->set();
  SplitSet sent(sigma->size());
  std::size_t at = 0;
  const auto next = [&](const StreamClient&) -> std::optional<std::vector<std::uint8_t>> {
    const std::size_t end = std::min({order.size(), at + std::max<std::size_t>(500, at / 8), at + kBatchUpdatesMost});
    if (at == end) return {};
    SplitSet some(sigma->size());
    for (; at < end; ++at) {
      some.insert(order[at]);
      sent.insert(order[at]);
    }
    return encode_batch(*sigma, {sigma->description().whole()}, sent, some.groups(set));
  };
  return follow(*sigma, picture, next, at_least ? BytesSoFar([&] { return double(bytes_of(*sigma, sent)); }) : BytesSoFar());
}

// Bytes until 99 % of the points are off by no more than that, between two measurements by their logarithms; none if
// never.
std::optional<double> bytes_to(const Curve& curve, double pixels) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve[i].deviation.most > pixels) continue;
    if (i == 0) return curve[i].bytes;
    const double t = std::log(curve[i - 1].deviation.most / pixels) / std::log(curve[i - 1].deviation.most / std::max(1e-6, curve[i].deviation.most));
    return std::exp(std::lerp(std::log(curve[i - 1].bytes), std::log(curve[i].bytes), t));
  }
  return {};
}

// Bytes until the picture has so many decibels; likewise.
std::optional<double> bytes_to_decibels(const Curve& curve, double decibels) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve[i].decibels < decibels) continue;
    if (i == 0) return curve[i].bytes;
    const double t = (decibels - curve[i - 1].decibels) / (curve[i].decibels - curve[i - 1].decibels);
    return std::exp(std::lerp(std::log(curve[i - 1].bytes), std::log(curve[i].bytes), t));
  }
  return {};
}

// What the picture has after so many bytes: what was measured last before.
double decibels_at(const Curve& curve, double bytes) {
  double decibels = 0;
  for (const Point& p : curve) {
    if (p.bytes <= bytes) decibels = p.decibels;
  }
  return decibels;
}

struct Row {
  std::string title;
  const char* look = "";
  std::array<Curve, kOrders.size()> curves;
  double done_bytes = 0, least_bytes = 0;  // what we send for a pixel error of 1, and the fewest for those updates
};

std::vector<Row> measure(const Case& c) {
  const FieldHierarchy hierarchy(*c.volume, {c.range, c.refine, {}});
  const auto sigma = std::make_shared<const IntervalVolume>(or_throw(hierarchy.compact(c.format)));
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
  std::vector<Row> rows;
  for (const Look& look : kLooks) {
    const Lod lod = lod_of(look, sigma->description().grid);
    const Picture picture(mesh, surface, *lod.camera, box_of(sigma->description().grid));
    Row row{fmt::format("{} {}", c.name, range_text(c.range, c.refine)), look.name, {}, 0, 0};
    row.curves[kOurs] = follow_plan(sigma, picture, lod);
    row.curves[kHiddenLast] = follow_plan(sigma, picture, lod, true);
    const SplitSet wanted = select(*sigma, lod);
    Lod to_the_end = lod;
    to_the_end.camera->pixel_error = 1e-3;
    row.curves[kIdeal] = follow_list(sigma, picture, in_order(*sigma, select(*sigma, to_the_end), to_the_end), true);
    row.curves[2] = follow_plan(sigma, picture, Lod{});
    row.curves[kByLevel] = follow_list(sigma, picture, by_level, false);
    row.least_bytes = double(bytes_of(*sigma, wanted));
    StreamPlan plan(sigma);
    plan.set_lod(lod);
    for (std::size_t target = kFirstPayload; !plan.done(); target = std::min(2 * target, protocol::kMaxBatchPayload)) {
      if (const auto batch = plan.next(target)) row.done_bytes += double(batch->payload.size());
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string kilobytes(double bytes) { return bytes < 1e4 ? fmt::format("{:.1f}", bytes / 1e3) : fmt::format("{:.0f}", bytes / 1e3); }

void print_rows(const std::vector<Row>& rows) {
  fmt::print(
      "| volume, range | view | bytes to 4 px, kB: Intervale | ideal | by field error | by level | to 1 px: Intervale | ideal | by field error | by "
      "level | "
      "Intervale / ideal: 4 px | 1 px | when done |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    fmt::print("| {} | {} |", r.title, r.look);
    for (const double pixels : {4.0, 1.0}) {
      for (std::size_t k = 0; k < kHiddenLast; ++k) {
        const auto bytes = bytes_to(r.curves[k], pixels);
        fmt::print(" {} |", bytes ? kilobytes(*bytes) : "–");
      }
    }
    for (const double pixels : {4.0, 1.0}) {
      const auto ours = bytes_to(r.curves[0], pixels), ideal = bytes_to(r.curves[1], pixels);
      fmt::print(" {} |", ours && ideal ? fmt::format("{:.2f}", *ours / *ideal) : "–");
    }
    fmt::print(" {:.2f} |\n", r.done_bytes / r.least_bytes);
  }
  fmt::print(
      "\nBytes until 99 % of {} points are off by at most that many pixels on the screen. The points lie on the surface of the\n"
      "full mesh, within the picture of 1920 x 1080. Values between measurements are interpolated. Ideal: one update at a time,\n"
      "first that which removes most squared deviation from the picture, each with the ancestors that it lacks; its bytes are\n"
      "what the updates so far would take in one batch, the fewest possible. By level: coarse before fine, as a\n"
      "level-of-detail pyramid is sent. By field error: the same order whatever the view. When done: the bytes sent for a\n"
      "pixel error of 1, over the fewest bytes for that.\n",
      kPoints);
}

void print_pictures(const std::vector<Row>& rows) {
  constexpr std::array<double, 8> kKilobytes{4, 8, 16, 32, 64, 128, 256, 512};
  const auto name = [](std::size_t k) { return k == kHiddenLast ? "with depth maps" : kOrders[k].name; };
  fmt::print("\n| volume, range | view | order | kB to 30 dB | 35 dB |");
  for (const double kilobytes : kKilobytes) fmt::print(" dB at {} kB |", kilobytes);
  fmt::print("\n|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    for (const std::size_t k : {kHiddenLast, kOurs, kByLevel}) {
      fmt::print("| {} | {} | {} |", r.title, r.look, name(k));
      for (const double decibels : {30.0, 35.0}) {
        const auto bytes = bytes_to_decibels(r.curves[k], decibels);
        fmt::print(" {} |", bytes ? kilobytes(*bytes) : "–");
      }
      for (const double kilobytes : kKilobytes) fmt::print(" {:.1f} |", decibels_at(r.curves[k], 1000 * kilobytes));
      fmt::print("\n");
    }
  }
  fmt::print(
      "\nPeak signal-to-noise ratio of the picture, {} x {} pixels as the programs draw them, against that of the full mesh. With\n"
      "depth maps: the client sends one whenever it has twice as many updates as at the last, and what they hide is sent last.\n",
      kDrawn[0], kDrawn[1]);
}

void draw(const std::vector<Row>& rows, const std::string& path) {
  constexpr int kWidth = 330, kHeight = 230, kLeft = 46, kTop = 34, kRight = 12, kBottom = 34;
  constexpr double kLowBytes = 3e3, kHighBytes = 4e6, kLowPixels = 0.3, kHighPixels = 300;
  const int columns = int(kLooks.size()), lines = int((rows.size() + kLooks.size() - 1) / kLooks.size());
  std::ofstream out(path);
  out << fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"11\">\n",
                     columns * kWidth, lines * kHeight + 26)
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int left = int(i) % columns * kWidth + kLeft, top = int(i) / columns * kHeight + kTop;
    const int width = kWidth - kLeft - kRight, height = kHeight - kTop - kBottom;
    const auto x = [&](double bytes) {
      return left + width * std::log(std::clamp(bytes, kLowBytes, kHighBytes) / kLowBytes) / std::log(kHighBytes / kLowBytes);
    };
    const auto y = [&](double px) {
      return top + height * std::log(kHighPixels / std::clamp(px, kLowPixels, kHighPixels)) / std::log(kHighPixels / kLowPixels);
    };
    out << fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"12\">{}, {}</text>\n", left, top - 8, rows[i].title, rows[i].look);
    for (const double bytes : {1e4, 1e5, 1e6}) {
      out << fmt::format("<path d=\"M{:.1f} {}v{}\" stroke=\"#ddd\"/><text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{} kB</text>\n", x(bytes),
                         top, height, x(bytes), top + height + 14, bytes / 1e3);
    }
    for (const double pixels : {1.0, 10.0, 100.0}) {
      out << fmt::format("<path d=\"M{} {:.1f}h{}\" stroke=\"{}\"/><text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{} px</text>\n", left, y(pixels),
                         width, pixels == 1 ? "#999" : "#ddd", left - 4, y(pixels) + 4, pixels);
    }
    out << fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#999\"/>\n", left, top, width, height);
    for (std::size_t k = rows[i].curves.size(); k-- > 0;) {
      std::string line;
      for (const Point& p : rows[i].curves[k]) line += fmt::format("{:.1f},{:.1f} ", x(p.bytes), y(p.deviation.most));
      out << fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n", line, kOrders[k].color, k == 0 ? 2.5 : 1.5,
                         k == 1 ? " stroke-dasharray=\"5 3\"" : "");
    }
  }
  for (std::size_t k = 0; k < kOrders.size(); ++k) {
    const int at = kLeft + int(k) * 150, y = lines * kHeight + 12;
    out << fmt::format("<path d=\"M{} {}h24\" stroke=\"{}\" stroke-width=\"2.5\"/><text x=\"{}\" y=\"{}\" font-size=\"12\">{}</text>\n", at, y,
                       kOrders[k].color, at + 30, y + 4, kOrders[k].name);
  }
  out << "</svg>\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + path);
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
  print_rows(rows);
  print_pictures(rows);
  if (!picture.empty()) draw(rows, picture);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_quality", intervale::bench::run, argc, argv); }

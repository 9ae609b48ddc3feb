// The tables and the drawing of bench_quality.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "tests/bench/quality.h"

namespace intervale::bench {
namespace {

// Bytes until 99 % of the points are off by no more than that, between two measurements by their logarithms; none if
// never.
std::optional<double> bytes_to(const Curve& curve, double pixels) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve[i].missing.of_99 > pixels) continue;
    if (i == 0) return curve[i].bytes;
    const double t = std::log(curve[i - 1].missing.of_99 / pixels) / std::log(curve[i - 1].missing.of_99 / std::max(1e-6, curve[i].missing.of_99));
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

// What was measured last before so many bytes; none before the first time.
std::optional<Point> point_at(const Curve& curve, double bytes) {
  std::optional<Point> last;
  for (const Point& p : curve) {
    if (p.bytes <= bytes) last = p;
  }
  return last;
}

std::string kilobytes(double bytes) { return bytes < 1e4 ? fmt::format("{:.1f}", bytes / 1e3) : fmt::format("{:.0f}", bytes / 1e3); }
std::string kilobytes(const std::optional<double>& bytes) { return bytes ? kilobytes(*bytes) : "–"; }
std::string pixels_of(double pixels) { return pixels > 1e4 ? "–" : pixels < 10 ? fmt::format("{:.1f}", pixels) : fmt::format("{:.0f}", pixels); }

}  // namespace

void print_bytes(const std::vector<Row>& rows) {
  constexpr std::array<double, 5> kPixels{16, 8, 4, 2, 1};
  fmt::print("| volume, range | view | order |");
  for (const double pixels : kPixels) fmt::print(" {} px |", pixels);
  fmt::print(" / ideal: 4 px | 1 px | when done |\n|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    for (const std::size_t k : {kOurs, kAfresh, kMeasured, kIdeal, kByError, kByLevel}) {
      fmt::print("| {} | {} | {} |", r.title, r.look, kOrders[k].name);
      for (const double pixels : kPixels) fmt::print(" {} |", kilobytes(bytes_to(r.curves[k], pixels)));
      for (const double pixels : {4.0, 1.0}) {
        const auto bytes = bytes_to(r.curves[k], pixels), ideal = bytes_to(r.curves[kIdeal], pixels);
        fmt::print(" {} |", k != kIdeal && bytes && ideal ? fmt::format("{:.2f}", *bytes / *ideal) : "");
      }
      fmt::print(" {} |\n", k == kOurs ? fmt::format("{:.2f}", r.done_bytes / r.least_bytes) : "");
    }
  }
  fmt::print(
      "\nkB until 99 % of {} points are off by at most that many pixels on the screen. The points lie on the surface of the\n"
      "full mesh, within the picture of 1920 x 1080. Values between measurements are interpolated. Ideal: one update at a time,\n"
      "first that which removes most squared deviation from the picture, each with the ancestors that it lacks; its bytes are\n"
      "what the updates so far would take in one batch, the fewest possible. By level: coarse before fine, as a\n"
      "level-of-detail pyramid is sent. By field error: the same order whatever the view. When done: the bytes sent for a\n"
      "pixel error of 1, over the fewest bytes for that. Of every range: the range of a data set of every range, by\n"
      "estimates of how far its surfaces move as long as these have anything to send, and then as it is measured; or measured\n"
      "before.\n",
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
        fmt::print(" {} |", kilobytes(bytes_to_decibels(r.curves[k], decibels)));
      }
      for (const double kilobytes : kKilobytes) {
        const auto point = point_at(r.curves[k], 1000 * kilobytes);
        fmt::print(" {} |", point ? fmt::format("{:.1f}", point->decibels) : "–");
      }
      fmt::print("\n");
    }
  }
  fmt::print(
      "\nPeak signal-to-noise ratio of the picture, {} x {} pixels as the programs draw them, against that of the full mesh.\n"
      "With depth maps: the client sends one whenever it has twice as many updates as at the last, and what they hide is sent\n"
      "last.\n",
      kDrawn[0], kDrawn[1]);
}

void print_deviations(const std::vector<Row>& rows) {
  fmt::print(
      "\n| volume, range | view | order, after 64 kB | missing: 50 % | 90 % | 99 % | all | too much: 50 % | 90 % | 99 % | all | wrong pixels |\n"
      "|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& r : rows) {
    for (const std::size_t k : {kHiddenLast, kOurs, kByLevel}) {
      const auto point = point_at(r.curves[k], 64e3);
      if (!point) continue;
      fmt::print("| {} | {} | {} |", r.title, r.look, k == kHiddenLast ? "with depth maps" : kOrders[k].name);
      for (const Deviation& d : {point->missing, point->too_much}) {
        for (const double pixels : {d.of_50, d.of_90, d.of_99, d.of_100}) fmt::print(" {} |", pixels_of(pixels));
      }
      fmt::print(" {:.1f} % |\n", point->wrong_percent);
    }
  }
  fmt::print(
      "\nPixels on the screen that so many points are off at most. Missing: points of the full mesh's surface from the mesh so\n"
      "far. Too much: the other way round. Wrong: a colour is off by more than 16 of 255.\n");
}

void draw_curves(const std::vector<Row>& rows, const std::string& path) {
  constexpr int kWidth = 330, kHeight = 230, kLeft = 46, kTop = 34, kRight = 12, kBottom = 34;
  constexpr double kLowBytes = 3e3, kHighBytes = 4e6, kLowPixels = 0.3, kHighPixels = 300;
  const int columns = int(kLookNames.size()), lines = int((rows.size() + kLookNames.size() - 1) / kLookNames.size());
  std::ofstream out(path);
  out << fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"11\">\n",
                     columns * kWidth, lines * kHeight + 46)
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
      for (const Point& p : rows[i].curves[k]) line += fmt::format("{:.1f},{:.1f} ", x(p.bytes), y(p.missing.of_99));
      out << fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n", line, kOrders[k].color, k == 0 ? 2.5 : 1.5,
                         k == 1 ? " stroke-dasharray=\"5 3\"" : "");
    }
  }
  for (std::size_t k = 0; k < kOrders.size(); ++k) {
    const int at = kLeft + int(k % 4) * 240, y = lines * kHeight + 12 + int(k / 4) * 20;
    out << fmt::format("<path d=\"M{} {}h24\" stroke=\"{}\" stroke-width=\"2.5\"/><text x=\"{}\" y=\"{}\" font-size=\"12\">{}</text>\n", at, y,
                       kOrders[k].color, at + 30, y + 4, kOrders[k].name);
  }
  out << "</svg>\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

}  // namespace intervale::bench

// What bench_quality measures, and how it is printed.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace intervale::bench {

inline constexpr int kPoints = 3000;
inline constexpr std::array<int, 2> kDrawn{640, 360};  // pixels of the pictures that are compared
inline constexpr std::array<const char*, 3> kLookNames{"all of it", "close", "from within"};

struct Order {
  const char* name;
  const char* color;
};
inline constexpr std::array<Order, 7> kOrders{{{"Intervale", "#0b6e4f"},
                                               {"ideal", "#888888"},
                                               {"by field error", "#c1440e"},
                                               {"by level", "#3b5ba5"},
                                               {"Intervale with depth maps", "#8e44ad"},
                                               {"of every range, asked for afresh", "#e0a100"},
                                               {"of every range, measured before", "#7a6a00"}}};
inline constexpr std::size_t kOurs = 0, kIdeal = 1, kByError = 2, kByLevel = 3, kHiddenLast = 4, kAfresh = 5, kMeasured = 6;

// Pixels on the screen: of so many percent of the points.
struct Deviation {
  double of_50 = 0, of_90 = 0, of_99 = 0, of_100 = 0;
};

// After so many bytes.
struct Point {
  double bytes = 0;
  Deviation missing, too_much;  // of the full mesh's surface from that of the mesh so far; the other way round
  double decibels = 0;          // the peak signal-to-noise ratio of the picture
  double wrong_percent = 0;     // of its pixels, visibly
};
using Curve = std::vector<Point>;

struct Row {
  std::string title;
  const char* look = "";
  std::array<Curve, kOrders.size()> curves;
  double done_bytes = 0, least_bytes = 0;  // what we send for a pixel error of 1, and the fewest for those updates
};

void print_bytes(const std::vector<Row>& rows);
void print_pictures(const std::vector<Row>& rows);
void print_deviations(const std::vector<Row>& rows);
void draw_curves(const std::vector<Row>& rows, const std::string& path);

}  // namespace intervale::bench

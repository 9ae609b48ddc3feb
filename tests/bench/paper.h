// The paper's figures: Weiss and De Floriani 2008, Tables 1 and 2.
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "tests/bench/cases.h"

namespace intervale::bench {

struct PaperSizes {
  std::string_view name;   // a case is this row's if its name begins so, letters taken as small ones,
  Range range;             // its range is this one,
  Refine refine;           // so is this,
  int longest;             // and its longest side is at least half as many samples as the paper's volume has
  std::string_view title;  // as the paper has it
  double coefficients, updates, compact_mb, vertices, tets, indexed_mb, ratio;
};

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr std::array<PaperSizes, 10> kPaperTable1{{
    {"bunny", {10, 10}, Refine::boundary, 201, "Bunny1, 201³", 1.1e6, 808e3, 10.3, 1.2e6, 4.6e6, 84, 8.13},
    {"bunny", {0, 30}, Refine::boundary, 201, "Bunny2, 201³", 850e3, 616e3, 7.9, 938e3, 3.4e6, 63, 8.06},
    {"bunny", {0, kInfinity}, Refine::boundary, 201, "Bunny3, 201³", 671e3, 486e3, 6.2, 735e3, 2.7e6, 49, 7.96},
    {"bunny", {-0.5, 0.5}, Refine::boundary, 201, "Bunny (thin shell), 201³", 1.3e6, 548e3, 7.6, 1.1e6, 3.2e6, 61, 8.1},
    {"bunny", {0, kInfinity}, Refine::uniform, 201, "Bunny5, 201³", 671e3, 2.3e6, 27, 2.6e6, 14e6, 238, 8.81},
    {"engine", {175, 256}, Refine::boundary, 256, "Engine1, 256³", 331e3, 205e3, 2.7, 325e3, 1.1e6, 21, 7.87},
    {"engine", {55, 175}, Refine::boundary, 256, "Engine2, 256³", 1.7e6, 1e6, 13.1, 1.7e6, 6.2e6, 114, 8.67},
    {"tooth", {440, 1290}, Refine::boundary, 256, "Tooth, 256² × 161", 350e3, 252e3, 3.2, 364e3, 1.3e6, 24, 7.57},
    {"neghip", {59.1, 124.1}, Refine::boundary, 64, "Neghip, 64³", 90e3, 45e3, 0.6, 81e3, 262e3, 4.9, 8.27},
    {"buckyball", {128, 188}, Refine::boundary, 128, "Buckyball, 128³", 595e3, 316e3, 4.2, 553e3, 2e6, 37, 8.82},
}};

inline constexpr std::array<double, 6> kErrorPercents{30, 3, 0.3, 0.03, 0.01, 0};

// Seconds on a Core 2 Duo of 2 GHz, at each of kErrorPercents; which of its ranges, the paper does not say.
struct PaperTimes {
  std::string_view name;
  std::array<double, 6> delta, sigma;
  double mean;  // of sigma / delta, as printed
};
inline constexpr std::array<PaperTimes, 5> kPaperTable2{{
    {"bunny", {0.1, 0.43, 1, 1.2, 1.1, 1.2}, {0.1, 0.4, 0.74, 0.78, 0.8, 0.82}, 0.77},
    {"engine", {0.05, 1.4, 5.6, 6.3, 6.8, 6.1}, {0.04, 1.8, 5, 4.9, 4.9, 4.9}, 0.87},
    {"tooth", {0.17, 1.7, 8.9, 12, 12, 16}, {0.13, 1.6, 5.7, 6.6, 7.3, 7.6}, 0.66},
    {"neghip", {0.12, 0.27, 3.7, 24, 34, 37}, {0.09, 0.25, 4.3, 18, 23, 25}, 0.82},
    {"bucky", {3.5, 23, 27, 26, 25, 28}, {1.5, 15, 20, 22, 24, 30}, 0.78},
}};
inline constexpr double kPaperMean = 0.78;

// The paper's row for a case; null where it has none.
[[nodiscard]] const PaperSizes* paper_sizes(const Case& c);
[[nodiscard]] const PaperTimes* paper_times(const Case& c);

}  // namespace intervale::bench

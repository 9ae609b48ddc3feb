#include "client/load/range_path.h"

#include <algorithm>
#include <cmath>

#include "client/load/camera_paths.h"

namespace intervale {
namespace {

constexpr std::uint64_t kMoves = 10;                            // of one drag
constexpr double kRest = 1;                                     // seconds after a drag
constexpr double kStep = 0.05;                                  // a move, as a share of the values
constexpr std::uint64_t kFirstRandom = std::uint64_t(1) << 32;  // those before are the cameras'

enum class End : std::uint8_t { alpha = 0, beta = 1 };

double random(const RangePath& path, End end, std::uint64_t number) {
  return random_fraction(path.seed, kFirstRandom + 2 * number + std::uint64_t(end));
}

// How far an end has gone after so many moves, at least one, as a share of the values: more with each of them.
double gone(const RangePath& path, End end, std::uint64_t moves) {
  const double way = kStep * (double(moves) - 0.5 + random(path, end, moves));
  return random(path, end, 0) < 0.5 ? way : -way;
}

// Where somebody is that went to x, but turned at each end of [low, high].
double folded(double x, double low, double high) {
  const double width = high - low;
  if (width <= 0) return low;
  double from_low = std::fmod(x - low, 2 * width);
  if (from_low < 0) from_low += 2 * width;
  return std::clamp(low + std::min(from_low, 2 * width - from_low), low, high);
}

}  // namespace

Range range_of(const RangePath& path, std::uint64_t number) {
  const double least = path.values.alpha, greatest = path.values.beta;
  Range range{std::clamp(path.start.alpha, least, greatest), std::clamp(path.start.beta, least, greatest)};
  if (number == 0 || least == greatest) return range;
  // Halved: the difference of two doubles can overflow.
  const auto share = [&](double value) { return (value / 2 - least / 2) / (greatest / 2 - least / 2); };
  const double alpha = share(range.alpha), beta = share(range.beta), middle = (alpha + beta) / 2;
  const std::uint64_t rounds = number / (2 * kMoves), rest = number % (2 * kMoves);
  const std::uint64_t alphas = rounds * kMoves + std::min(rest, kMoves), betas = number - alphas;
  if (alphas > 0) range.alpha = std::lerp(least, greatest, folded(alpha + gone(path, End::alpha, alphas), 0, middle));
  if (betas > 0) range.beta = std::lerp(least, greatest, folded(beta + gone(path, End::beta, betas), middle, 1));
  range.beta = std::max(range.alpha, range.beta);  // rounded
  return range;
}

double rests_before(std::uint64_t number) {
  const std::uint64_t drags = number == 0 ? 0 : (number - 1) / kMoves;  // that are over
  return kRest * double(drags);
}

}  // namespace intervale

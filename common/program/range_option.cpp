#include "common/program/range_option.h"

#include <cmath>

namespace intervale {
namespace {

Result<double> parse_bound(const std::string& text) {
  std::size_t used = 0;
  try {
    const double value = std::stod(text, &used);
    if (used == text.size() && !std::isnan(value)) return value;
  } catch (const std::exception&) {
    // reported below
  }
  return misuse("--range: '" + text + "' is not a number, -inf or inf");
}

Result<Range> parse_bounds(const std::string& lo, const std::string& hi) {
  const auto low = parse_bound(lo), high = parse_bound(hi);
  if (!low) return tl::unexpected(low.error());
  if (!high) return tl::unexpected(high.error());
  if (*low > *high) return misuse("--range: invalid range: LO (" + lo + ") is greater than HI (" + hi + ")");
  if (*low == INFINITY || *high == -INFINITY) return misuse("--range: no number lies between " + lo + " and " + hi);
  return Range{*low, *high};
}

}  // namespace

CLI::Option* add_range_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help) {
  return app.add_option("--range", bounds, help)->expected(2)->type_name("LO HI");
}

CLI::Option* add_ranges_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help) {
  // As many as are given, but two at a time.
  return app.add_option("--range", bounds, help)->type_size(2)->expected(1, -1)->allow_extra_args(false)->type_name("LO HI");
}

CLI::Option* add_refine_option(CLI::App& app, std::optional<std::string>& refine, const std::string& help) {
  return app.add_option("--refine", refine, help)->check(CLI::IsMember({"boundary", "uniform"}));
}

std::optional<Refine> parse_refine(const std::optional<std::string>& refine) {
  if (!refine) return {};
  return *refine == "uniform" ? Refine::uniform : Refine::boundary;
}

Result<std::optional<Range>> parse_range(const std::vector<std::string>& bounds) {
  if (bounds.empty()) return std::optional<Range>{};
  return parse_bounds(bounds.at(0), bounds.at(1)).map([](const Range& range) { return std::optional(range); });
}

Result<std::vector<Range>> parse_ranges(const std::vector<std::string>& bounds) {
  if (bounds.size() % 2 != 0) return misuse("--range: the last range has no HI");
  if (bounds.size() > 2 * kMaxRanges)
    return misuse("--range: at most " + std::to_string(kMaxRanges) + " ranges can be shown at once, not " + std::to_string(bounds.size() / 2));
  std::vector<Range> ranges;
  for (std::size_t i = 0; i < bounds.size(); i += 2) {
    const auto range = parse_bounds(bounds[i], bounds[i + 1]);
    if (!range) return tl::unexpected(range.error());
    ranges.push_back(*range);
  }
  return ranges;
}

}  // namespace intervale

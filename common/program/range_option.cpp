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

}  // namespace

CLI::Option* add_range_option(CLI::App& app, std::vector<std::string>& bounds, const std::string& help) {
  return app.add_option("--range", bounds, help)->expected(2)->type_name("LO HI");
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
  const auto low = parse_bound(bounds.at(0)), high = parse_bound(bounds.at(1));
  if (!low) return tl::unexpected(low.error());
  if (!high) return tl::unexpected(high.error());
  if (*low > *high) return misuse("--range: invalid range: LO (" + bounds[0] + ") is greater than HI (" + bounds[1] + ")");
  if (*low == INFINITY || *high == -INFINITY) return misuse("--range: no number lies between " + bounds[0] + " and " + bounds[1]);
  return std::optional(Range{*low, *high});
}

}  // namespace intervale

#include "server/cli/describe_volume.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/program/describe.h"
#include "common/program/program.h"
#include "common/util/printable.h"
#include "common/view/lod.h"

namespace intervale {
namespace {

// The histogram as bars: some bins a line.
std::string bars_of(const ValueHistogram& histogram) {
  constexpr std::size_t kLines = 32, kWidth = 60;
  const std::size_t bins = (histogram.count.size() + kLines - 1) / kLines;  // a line
  std::vector<std::uint64_t> sums((histogram.count.size() + bins - 1) / bins);
  for (std::size_t i = 0; i < histogram.count.size(); ++i) sums[i / bins] += histogram.count[i];
  const std::uint64_t most = std::max<std::uint64_t>(1, *std::max_element(sums.begin(), sums.end()));
  std::string text;
  for (std::size_t line = 0; line < sums.size(); ++line) {
    // The cube root shows small peaks beside large ones; a bar is never empty if there is a sample.
    const auto length = std::size_t(std::ceil(std::cbrt(double(sums[line]) / double(most)) * kWidth));
    text += fmt::format("{:>12.6g} {}\n", std::fma(double(line * bins), histogram.width, histogram.least), std::string(length, '#'));
  }
  return text;
}

// Where the samples lie, and what their numbers mean.
std::string place_of(const Grid& grid, const Labels& labels) {
  const Box box = box_of(grid);
  std::string text = fmt::format("world box ({:g}) to ({:g})\n", fmt::join(box.min, ", "), fmt::join(box.max, ", "));
  const Affine& a = grid.affine;
  if (a.is_axis_parallel()) {
    text += fmt::format("spacing ({:g})", fmt::join(a.spacing(), ", "));
  } else {
    text += fmt::format("axes ({:g}), ({:g}), ({:g})", fmt::join(a.column(0), ", "), fmt::join(a.column(1), ", "), fmt::join(a.column(2), ", "));
  }
  text += fmt::format(", origin ({:g}){}{}\n", fmt::join(a.origin(), ", "), labels.unit.empty() ? "" : ", in ", labels.unit);
  if (!labels.space.empty()) text += "space " + printable(labels.space) + "\n";
  if (!labels.field.empty() || !labels.field_unit.empty())
    text += fmt::format("field {}{}{}\n", labels.field, labels.field.empty() ? "in " : labels.field_unit.empty() ? "" : ", in ", labels.field_unit);
  return text;
}

}  // namespace

std::string text_of(std::span<const Channel> channels) {
  std::string text;
  for (const Channel& channel : channels) {
    text += fmt::format("channel {}: {}{}{}", printable(channel.name), channel.components.size() == 1 ? "scalar" : "vector",
                        channel.unit.empty() ? "" : ", in ", channel.unit);
    for (const ChannelComponent& c : channel.components)
      text +=
          fmt::format(", {:g} to {:g}{}", c.format.least(), c.format.greatest(), c.is_exact ? "" : fmt::format(" in steps of {:g}", c.format.step));
    text += "\n";
  }
  return text;
}

std::uint64_t file_size_of(const std::filesystem::path& file) {
  std::error_code code;
  const auto size = std::filesystem::file_size(file, code);
  return code ? 0 : size;
}

nlohmann::ordered_json stats_of(const IntervalVolume& volume, std::uint64_t file_bytes) {
  nlohmann::ordered_json stats = to_json(volume.description());
  stats["scope"] = "one";
  stats["supercubes"] = volume.set().supercubes();
  stats["memory_bytes"] = volume.memory_bytes();
  stats["file_bytes"] = file_bytes;
  return stats;
}

std::string text_of(const IntervalVolume& volume, std::uint64_t file_bytes) {
  const Description& d = volume.description();
  const auto times = [&d](std::uint64_t bytes) { return bytes == 0 ? 0.0 : double(d.full.indexed_bytes()) / double(bytes); };
  std::string text = fmt::format("{}: {} x {} x {} samples, range [{:g}, {:g}], refined: {}\n", printable(d.name), d.grid.dims[0], d.grid.dims[1],
                                 d.grid.dims[2], d.range.alpha, d.range.beta, d.refine == Refine::boundary ? "boundary" : "boundary and inside");
  text += place_of(d.grid, d.labels);
  text += text_of(d.channels);
  text += fmt::format("{} updates, {} coefficients, {} supercubes, largest error {:g}\n", d.updates, d.coefficients, volume.set().supercubes(),
                      d.max_error);
  text += fmt::format("full mesh: {} vertices, {} tetrahedra, {} as an indexed mesh\n", d.full.vertices, d.full.tets,
                      human_bytes(d.full.indexed_bytes()));
  return text + fmt::format("in memory {} ({:.1f} times smaller than the full mesh), in the file {} ({:.1f} times smaller)\n",
                            human_bytes(volume.memory_bytes()), times(volume.memory_bytes()), human_bytes(file_bytes), times(file_bytes));
}

nlohmann::ordered_json stats_of(const ValueSummary& set) {
  const FieldDescription& d = set.description;
  nlohmann::ordered_json stats{{"name", d.name}, {"scope", "every"}};
  add_grid(stats, d.grid, d.labels);
  stats["channels"] = to_json(d.channels);
  stats.update({
      {"type", name_of(d.format.type)},
      {"values", {{"least", d.format.least()}, {"greatest", d.format.greatest()}}},
      {"step", d.is_exact ? 0.0 : d.format.step},
      {"max_error", d.max_error},
      {"updates", set.updates},
      {"supercubes", set.supercubes},
      {"memory_bytes", set.memory_bytes},
      {"file_bytes", set.file_bytes},
      {"histogram", d.statistics.histogram.count},
      {"histogram_width", d.statistics.histogram.width},
  });
  return stats;
}

std::string text_of(const ValueSummary& set) {
  const FieldDescription& d = set.description;
  const std::uint64_t raw = d.grid.sample_count() * size_of(d.format.type);
  std::string text = fmt::format("{}: {} x {} x {} samples of type {}, every range\n", printable(d.name), d.grid.dims[0], d.grid.dims[1],
                                 d.grid.dims[2], name_of(d.format.type));
  text += place_of(d.grid, d.labels);
  text += fmt::format(
      "values {:g} to {:g}, {}\n", d.format.least(), d.format.greatest(),
      d.is_exact ? std::string("exact") : fmt::format("rounded to multiples of {:g}: off by {:g} at most", d.format.step, d.format.step / 2));
  text += text_of(d.channels);
  text += fmt::format("{} updates, {} supercubes, largest error {:g}\n", set.updates, set.supercubes, d.max_error);
  text += fmt::format("in memory {} ({:.2f} bytes a sample), in the file {} ({:.2f} times smaller than the samples)\n", human_bytes(set.memory_bytes),
                      double(set.memory_bytes) / double(d.grid.sample_count()), human_bytes(set.file_bytes),
                      set.file_bytes == 0 ? 0.0 : double(raw) / double(set.file_bytes));
  return text + "histogram (bars: cube root of the number of samples)\n" + bars_of(d.statistics.histogram);
}

}  // namespace intervale

#include "server/cli/describe_volume.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "common/program/describe.h"
#include "common/program/program.h"
#include "common/util/printable.h"
#include "common/view/lod.h"

namespace intervale {
namespace {

std::uint64_t size_of(const std::filesystem::path& file) {
  std::error_code code;
  const auto size = std::filesystem::file_size(file, code);
  return code ? 0 : size;
}

}  // namespace

nlohmann::ordered_json stats_of(const IntervalVolume& volume, const std::filesystem::path& file) {
  nlohmann::ordered_json stats = to_json(volume.description());
  stats["supercubes"] = volume.set().supercubes();
  stats["memory_bytes"] = volume.memory_bytes();
  stats["file_bytes"] = size_of(file);
  return stats;
}

std::string text_of(const IntervalVolume& volume, const std::filesystem::path& file) {
  const Description& d = volume.description();
  const std::uint64_t file_bytes = size_of(file);
  const auto times = [&d](std::uint64_t bytes) { return bytes == 0 ? 0.0 : double(d.full.indexed_bytes()) / double(bytes); };
  std::string text = fmt::format("{}: {} x {} x {} samples, range [{:g}, {:g}], refined: {}\n", printable(d.name), d.grid.dims[0], d.grid.dims[1],
                                 d.grid.dims[2], d.range.alpha, d.range.beta, d.refine == Refine::boundary ? "boundary" : "boundary and inside");
  const Box box = box_of(d.grid);
  text += fmt::format("world box ({:g}) to ({:g})\n", fmt::join(box.min, ", "), fmt::join(box.max, ", "));
  text += fmt::format("{} updates, {} coefficients, {} supercubes, largest error {:g}\n", d.updates, d.coefficients, volume.set().supercubes(),
                      d.max_error);
  text += fmt::format("full mesh: {} vertices, {} tetrahedra, {} as an indexed mesh\n", d.full.vertices, d.full.tets,
                      human_bytes(d.full.indexed_bytes()));
  return text + fmt::format("in memory {} ({:.1f} times smaller than the full mesh), in the file {} ({:.1f} times smaller)\n",
                            human_bytes(volume.memory_bytes()), times(volume.memory_bytes()), human_bytes(file_bytes), times(file_bytes));
}

}  // namespace intervale

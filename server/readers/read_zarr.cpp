// An array of a Zarr folder: a program of its own, see child_reader.h.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/readers/reader_program.h"
#include "server/readers/zarr_array.h"
#include "server/readers/zarr_chunks.h"

namespace intervale {
namespace {

Result<void> read(const ReaderRequest& request) try {
  const std::string name = in_quotes(request.path);
  const auto found = zarr_arrays_in(request.path);
  if (!found) return tl::unexpected<Error>(found.error());
  const std::vector<ZarrArray>& arrays = *found;
  if (arrays.empty()) return fail(name + " has no array of numbers with the axes z, y, x");
  auto chosen = arrays.begin();
  if (request.part) {
    const std::string wanted = request.part->starts_with('/') ? *request.part : "/" + *request.part;
    chosen = std::find_if(arrays.begin(), arrays.end(), [&](const ZarrArray& array) { return array.name == wanted; });
    if (chosen == arrays.end()) return misuse(name + " has no array '" + wanted + "' that is a volume");
  }
  auto header = header_of(*chosen, name);
  if (!header) return tl::unexpected<Error>(header.error());
  for (const ZarrArray& array : arrays) {
    if (arrays.size() == 1) break;
    header->parts.push_back({array.name, std::to_string(array.length(ZarrAxis::x)) + " x " + std::to_string(array.length(ZarrAxis::y)) + " x " +
                                             std::to_string(array.length(ZarrAxis::z)) + " of " + name_of(array.type)});
  }
  if (auto written = write_header(*header); !written || request.only_header) return written;
  if (request.time_point >= chosen->length(ZarrAxis::time)) return misuse(name + " has no time point of that number: the first is 0");
  ZarrChunkReader reader(*chosen, request.time_point);
  for (std::uint64_t z = 0; z < chosen->length(ZarrAxis::z); z += chosen->chunk[chosen->axis(ZarrAxis::z)]) {
    const auto layer = reader.layer(z);
    if (!layer) return tl::unexpected<Error>(layer.error());
    if (auto written = write_samples(*layer); !written) return written;
  }
  return {};
} catch (const nlohmann::json::exception&) {
  return fail(in_quotes(request.path) + ": its metadata are not those of Zarr; are they damaged?");
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }

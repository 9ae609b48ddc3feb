#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_extraction.h"
#include "common/ivm/value_file.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/mesh_digest.h"
#include "common/picture/picture.h"
#include "common/picture/picture_options.h"
#include "common/program/lod_options.h"
#include "common/program/range_option.h"
#include "common/util/printable.h"
#include "server/builder/all_cores.h"
#include "server/cli/commands.h"

namespace intervale {
namespace {

struct ExtractCommand {
  std::string file;
  std::optional<std::filesystem::path> output;
  std::optional<PictureOptions> picture;
  std::vector<std::string> range;
  std::optional<std::string> refine;
  Lod lod;
  unsigned threads = 0;
  bool digest = false;
  bool json = false;
};

using Clock = std::chrono::steady_clock;

// What was extracted, and of what.
struct Extracted {
  std::string name;
  Grid grid;
  Clock::time_point start;  // when the file was read
  Extraction extraction;
};

Result<Extracted> extract_values(const ExtractCommand& options, const std::optional<Range>& range) {
  if (!range) return misuse("'" + options.file + "' has every range: say which with --range LO HI");
  const auto volume = load_values(options.file, on_all_cores);
  if (!volume) return tl::unexpected(volume.error());
  const FieldDescription& d = (*volume)->description();
  const auto start = Clock::now();
  auto made =
      extract(**volume, {*range, options.refine.value_or("boundary") == "uniform" ? Refine::uniform : Refine::boundary, options.lod}, on_all_cores);
  if (!made) return tl::unexpected(made.error());
  return Extracted{d.name, d.grid, start, std::move(*made)};
}

// Whether a data set of one range holds what is asked for: its own range, or if it was refined uniformly any range
// within it.
Result<void> check_held(const ExtractCommand& options, const Description& d, const std::optional<Range>& range) {
  const bool is_uniform = d.refine == Refine::uniform;
  if (range && is_uniform && (range->alpha < d.range.alpha || range->beta > d.range.beta)) {
    return misuse(fmt::format("--range: '{}' has the ranges within [{:g}, {:g}]: build it without --range for every range", options.file,
                              d.range.alpha, d.range.beta));
  }
  if (range && !is_uniform && *range != d.range) {
    return misuse(fmt::format("--range: '{}' was built for the range [{:g}, {:g}] alone: build it without --range for every range", options.file,
                              d.range.alpha, d.range.beta));
  }
  if (options.refine && !is_uniform) {
    return misuse("--refine: '" + options.file + "' was refined when it was built: build it without --range for both");
  }
  return {};
}

Result<Extracted> extract_one_range(const ExtractCommand& options, const std::optional<Range>& range) {
  const auto volume = load_ivm(options.file, on_all_cores);
  if (!volume) return tl::unexpected(volume.error());
  const Description& d = (*volume)->description();
  if (auto held = check_held(options, d, range); !held) return tl::unexpected(held.error());
  const auto start = Clock::now();
  auto made = extract(**volume, options.lod, on_all_cores);
  if (!made) return tl::unexpected(made.error());
  if (const Range shown = range.value_or(d.range); shown != d.range || options.refine) {
    made->front.set_range(shown, options.refine.value_or("boundary") == "uniform" ? Refine::uniform : Refine::boundary,
                          options.lod.max_tets.value_or(~std::uint64_t(0)), on_all_cores);
    made->updates = made->front.shown_count();
  }
  return Extracted{d.name, d.grid, start, std::move(*made)};
}

Result<void> run(const ExtractCommand& options) {
  const auto range = parse_range(options.range);
  if (!range) return tl::unexpected(range.error());
  if (options.output) {
    if (auto writable = check_mesh_path(*options.output); !writable) return writable;
  }
  if (options.picture) {
    if (auto possible = check_picture(*options.picture, options.lod.camera); !possible) return possible;
  }
  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const auto extracted = is_value_file(options.file) ? extract_values(options, *range) : extract_one_range(options, *range);
  if (!extracted) return tl::unexpected(extracted.error());
  const std::uint64_t updates = extracted->extraction.updates;
  const Mesh mesh = extracted->extraction.front.mesh(on_all_cores);
  const double seconds = std::chrono::duration<double>(Clock::now() - extracted->start).count();
  if (options.output) {
    if (auto written = write_mesh(*options.output, mesh); !written) return written;
  }
  if (options.picture) {
    if (auto drawn = write_picture(*options.picture, mesh, box_of(extracted->grid), options.lod.camera); !drawn) return drawn;
  }
  const double enclosed = volume_of(mesh);
  if (options.json) {
    nlohmann::ordered_json json{
        {"updates", updates}, {"vertices", mesh.points.size()}, {"tets", mesh.tets.size()}, {"volume", enclosed}, {"seconds", seconds}};
    if (options.digest) json["digest"] = mesh_digest(mesh);
    return print_json(json);
  }
  std::string text = fmt::format("{}: {} updates, {} vertices, {} tetrahedra, volume {:.6g}, extracted in {:.3f} s\n", printable(extracted->name),
                                 updates, mesh.points.size(), mesh.tets.size(), enclosed, seconds);
  if (options.digest) text += "digest " + mesh_digest(mesh) + "\n";
  if (options.output) text += "wrote " + options.output->string() + "\n";
  if (options.picture) text += "drew " + options.picture->file.string() + "\n";
  return print(text);
}

}  // namespace

void add_extract_command(Program& program) {
  const auto options = std::make_shared<ExtractCommand>();
  CLI::App& command = program.add_command("extract", "Extract a mesh from an interval volume, without a server", [options] { return run(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm)")->required();
  command.add_option("-o,--output", options->output, "Mesh to write: .vtu (tetrahedra), .vtp, .ply, .stl, .obj or .glb (boundary triangles)")
      ->type_name("MESH");
  add_range_option(command, options->range, "Closed range of values: numbers, -inf or inf; needed if the file has every range");
  command
      .add_option("--refine", options->refine,
                  "Another range than the file's, or of every range: what to refine: boundary (default): the surfaces of the range only; uniform: "
                  "the inside too")
      ->check(CLI::IsMember({"boundary", "uniform"}));
  add_lod_options(command, options->lod);
  add_picture_options(command, options->picture);
  command.add_option("--threads", options->threads, "Number of threads; 0: one for each core")->capture_default_str();
  add_digest_flag(command, options->digest);
  add_json_flag(command, options->json);
}

}  // namespace intervale

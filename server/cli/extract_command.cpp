#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/mesh_digest.h"
#include "common/picture/picture.h"
#include "common/picture/picture_options.h"
#include "common/program/lod_options.h"
#include "common/program/progress.h"
#include "common/util/printable.h"
#include "server/builder/all_cores.h"
#include "server/cli/commands.h"

namespace intervale {
namespace {

struct ExtractCommand {
  std::string file;
  std::optional<std::filesystem::path> output;
  std::optional<PictureOptions> picture;
  Lod lod;
  unsigned threads = 0;
  bool digest = false;
  bool json = false;
};

Result<Extraction> extract_with_progress(const IntervalVolume& volume, const Lod& lod) {
  Progress progress("extracting " + printable(volume.description().name));
  return extract(
      volume, lod, [&progress](double done) { progress.fraction(done); }, on_all_cores);
}

Result<void> run(const ExtractCommand& options) {
  if (options.output) {
    if (auto writable = check_mesh_path(*options.output); !writable) return writable;
  }
  if (options.picture) {
    if (auto possible = check_picture(*options.picture, options.lod.camera); !possible) return possible;
  }
  const auto volume = load_ivm(options.file);
  if (!volume) return tl::unexpected(volume.error());
  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const auto start = std::chrono::steady_clock::now();
  const auto extracted = extract_with_progress(**volume, options.lod);
  if (!extracted) return tl::unexpected(extracted.error());
  const Mesh mesh = extracted->front.mesh(on_all_cores);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (options.output) {
    if (auto written = write_mesh(*options.output, mesh); !written) return written;
  }
  if (options.picture) {
    const Box box = box_of((*volume)->description().grid);
    if (auto drawn = write_picture(*options.picture, mesh, box, options.lod.camera); !drawn) return drawn;
  }
  const double enclosed = volume_of(mesh);
  if (options.json) {
    nlohmann::ordered_json json{
        {"updates", extracted->updates}, {"vertices", mesh.points.size()}, {"tets", mesh.tets.size()}, {"volume", enclosed}, {"seconds", seconds}};
    if (options.digest) json["digest"] = mesh_digest(mesh);
    return print_json(json);
  }
  std::string text =
      fmt::format("{}: {} updates, {} vertices, {} tetrahedra, volume {:.6g}, extracted in {:.3f} s\n", printable((*volume)->description().name),
                  extracted->updates, mesh.points.size(), mesh.tets.size(), enclosed, seconds);
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
  add_lod_options(command, options->lod);
  add_picture_options(command, options->picture);
  command.add_option("--threads", options->threads, "Number of threads; 0: one for each core")->capture_default_str();
  add_digest_flag(command, options->digest);
  add_json_flag(command, options->json);
}

}  // namespace intervale

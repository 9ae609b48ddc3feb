#include <fmt/core.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "common/ivm/load_volume.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/join.h"
#include "common/parallel/all_cores.h"
#include "common/picture/picture.h"
#include "common/picture/picture_options.h"
#include "common/program/channel_option.h"
#include "common/program/lod_options.h"
#include "common/program/mesh_figures.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/ranges/extract_meshes.h"
#include "common/remote/load_remote.h"
#include "common/remote/remote_options.h"
#include "common/util/printable.h"
#include "server/cli/commands.h"

namespace intervale {
namespace {

struct ExtractCommand {
  std::string file;
  std::optional<std::filesystem::path> output;
  std::optional<PictureOptions> picture;
  std::vector<std::string> range;
  std::optional<std::string> refine;
  std::vector<std::string> channels;
  RemoteOptions remote;
  Lod lod;
  unsigned threads = 0;
  bool tolerates_damage = false;
  bool digest = false;
  bool json = false;
};

using Clock = std::chrono::steady_clock;

// Whether the inside is refined where that is not said, and the data set has it.
bool prefers_uniform(const ExtractCommand& options) { return options.picture && options.picture->render == Render::volume; }

// What is to be shown of a data set.
Result<ShownRanges> shown_of(const ExtractCommand& options, const Description& d) {
  const auto ranges = parse_ranges(options.range);
  if (!ranges) return tl::unexpected(ranges.error());
  if (d.has_every_range && ranges->empty()) return misuse("'" + shown_url(options.file) + "' has every range: say which with --range LO HI");
  auto refine = parse_refine(options.refine);
  if (prefers_uniform(options) && !refine && d.refine == Refine::uniform) refine = Refine::uniform;
  ShownRanges shown = resolve(d, {*ranges, refine});
  if (auto held = check_held(d, shown); !held) return tl::unexpected(held.error());
  return shown;
}

// The meshes of all ranges as one, and the figures of each if there are several.
struct Extracted {
  Mesh mesh;
  std::uint64_t updates = 0;
  std::vector<MeshFigures> each;
};

Result<Extracted> extract_ranges(const ExtractCommand& options, const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown) {
  const auto numbers = find_channels(volume->description().channels, with_channel_of(options.picture, options.channels));
  if (!numbers) return tl::unexpected(numbers.error());
  Progress progress("extracting " + volume->description().name);
  auto extracted = extract_meshes(volume, shown, options.lod, *numbers, with_progress(progress, on_all_cores));
  if (!extracted) return tl::unexpected(extracted.error());
  Extracted all;
  std::vector<Mesh> meshes;
  for (ExtractedMesh& one : *extracted) {
    all.updates += one.updates;
    if (shown.size() > 1) all.each.push_back(figures_of(one.mesh, one.updates, options.digest, one.range));
    meshes.push_back(std::move(one.mesh));
  }
  all.mesh = joined(std::move(meshes));
  return all;
}

Result<void> report(const ExtractCommand& options, const std::string& name, const Extracted& extracted, double seconds) {
  const MeshFigures figures = figures_of(extracted.mesh, extracted.updates, options.digest);
  if (options.json) {
    nlohmann::ordered_json json{
        {"updates", figures.updates}, {"vertices", figures.vertices}, {"tets", figures.tets}, {"volume", figures.volume}, {"seconds", seconds}};
    if (figures.digest) json["digest"] = *figures.digest;
    if (!extracted.each.empty()) json["ranges"] = to_json(extracted.each);
    return print_json(json);
  }
  std::string text = fmt::format("{}: {}, extracted in {:.3f} s\n", printable(name), to_text(figures), seconds) + to_text(extracted.each);
  if (figures.digest) text += "digest " + *figures.digest + "\n";
  if (options.output) text += "wrote " + options.output->string() + "\n";
  if (options.picture) text += "drew " + options.picture->file.string() + "\n";
  return print(text);
}

Result<bool> draw(const PictureOptions& picture, const PictureSubject& subject, const std::optional<Camera>& camera) {
  Progress progress("drawing " + picture.file.string());
  return write_picture(picture, subject, camera, with_progress(progress, on_all_cores));
}

Result<std::shared_ptr<const IntervalVolume>> load(const ExtractCommand& options, const std::vector<Range>& ranges, PageFaults* faults) {
  if (!is_remote_url(options.file)) return load_volume(options.file, on_all_cores, faults);
  const auto url = parse_remote_url(options.file);
  if (!url) return tl::unexpected(url.error());
  const auto access = read_access(options.remote);
  if (!access) return tl::unexpected(access.error());
  const ShownRanges shown = asked_for({ranges, parse_refine(options.refine)}, prefers_uniform(options) ? Refine::uniform : Refine::boundary);
  return load_remote_volume(*url, *access, shown, on_all_cores, faults);
}

Result<void> run(const ExtractCommand& options) {
  const auto ranges = parse_ranges(options.range);
  if (!ranges) return tl::unexpected(ranges.error());
  if (options.output) {
    if (auto writable = check_mesh_path(*options.output); !writable) return writable;
  }
  if (options.picture) {
    if (auto possible = check_picture(*options.picture, options.lod.camera); !possible) return possible;
  }
  const unsigned threads = options.threads != 0 ? options.threads : unsigned(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  PageFaults faults;
  const auto volume = load(options, *ranges, options.tolerates_damage ? &faults : nullptr);
  if (!volume) return tl::unexpected(volume.error());
  if (faults.any()) {
    fmt::print(stderr, "intervale: warning: {}: {}; {} of {} updates are left out\n", printable(shown_url(options.file)), to_text(faults),
               faults.lost_updates, (*volume)->size());
  }
  const Description& description = (*volume)->description();
  const auto shown = shown_of(options, description);
  if (!shown) return tl::unexpected(shown.error());
  const auto start = Clock::now();
  const auto extracted = extract_ranges(options, *volume, *shown);
  if (!extracted) return tl::unexpected(extracted.error());
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (options.output) {
    if (auto written = write_mesh(*options.output, extracted->mesh); !written) return written;
  }
  if (options.picture) {
    const auto drawn = draw(*options.picture, {extracted->mesh, description, range_around(*shown)}, options.lod.camera);
    if (!drawn) return tl::unexpected(drawn.error());
    if (!*drawn) fmt::print(stderr, "intervale: warning: nothing of the mesh is in the picture\n");
  }
  return report(options, description.name, *extracted, seconds);
}

}  // namespace

void add_extract_command(Program& program) {
  const auto options = std::make_shared<ExtractCommand>();
  CLI::App& command = program.add_command("extract", "Extract a mesh from an interval volume, without a server", [options] { return run(*options); });
  command.add_option("FILE", options->file, "Interval volume (.ivm), or its URL (https://, http://)")->required();
  command.add_option("-o,--output", options->output, "Mesh to write: .vtu (tetrahedra), .vtp, .ply, .stl, .obj or .glb (boundary triangles)")
      ->type_name("MESH");
  add_ranges_option(command, options->range, kShownRangeHelp);
  add_refine_option(command, options->refine, kShownRefineHelp);
  add_channel_option(command, options->channels);
  add_lod_options(command, options->lod);
  add_picture_options(command, options->picture);
  command.add_option("--threads", options->threads, "Number of threads; 0: one for each core")->capture_default_str();
  command.add_flag("--tolerate-damage", options->tolerates_damage, "Leave out what damaged pages of the file hold, instead of failing");
  add_remote_options(command, options->remote);
  add_remote_authorities_option(command, options->remote);
  add_digest_flag(command, options->digest);
  add_json_flag(command, options->json);
}

}  // namespace intervale

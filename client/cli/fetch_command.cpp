#include <fmt/core.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/cli/commands.h"
#include "client/local/fetch_local.h"
#include "client/net/fetch.h"
#include "client/program/access_options.h"
#include "client/program/all_threads.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/join.h"
#include "common/picture/picture.h"
#include "common/picture/picture_options.h"
#include "common/program/channel_option.h"
#include "common/program/lod_options.h"
#include "common/program/mesh_figures.h"
#include "common/program/progress.h"
#include "common/program/range_option.h"
#include "common/remote/load_remote.h"
#include "common/remote/remote_options.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

struct FetchCommand {
  std::string url;
  Access access;
  RemoteOptions remote;
  FetchOptions fetch;
  std::vector<std::string> range;
  std::optional<std::string> refine;
  std::optional<std::filesystem::path> output;
  std::optional<PictureOptions> picture;
  bool digest = false;
  bool json = false;
};

// The volume of a growing mesh, for the progress line. It is computed again only as often as takes a tenth of the time.
class RecentVolume {
 public:
  double of(const StreamClient& client) {
    const auto now = Clock::now();
    if (now < next_) return volume_;
    volume_ = volume_of(client.mesh());
    const auto then = Clock::now();
    next_ = then + 9 * (then - now);
    return volume_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  double volume_ = 0;
  Clock::time_point next_{};
};

// A data set of a server, or a file on a web server.
using Source = std::variant<ServerUrl, RemoteUrl>;

// What was read of a file.
struct FileRead {
  std::uint64_t of_bytes = 0, bytes = 0, requests = 0;
};
struct FromSource {
  Fetched fetched;
  std::optional<FileRead> file;
};

Result<Source> parse_source(const FetchCommand& options) {
  if (is_remote_url(options.url)) return parse_remote_url(options.url).map([](RemoteUrl url) { return Source(std::move(url)); });
  auto url = parse_url(options.url, options.access);
  if (!url) return tl::unexpected(url.error());
  if (url->name.empty()) return misuse("the URL names no data set: expected " + url->server() + "/NAME; see intervale-client list " + url->server());
  return Source(std::move(*url));
}

FetchEvents events_of(Progress& progress) {
  FetchEvents events;
  events.on_notice = [&progress](const std::string& notice) { progress.note(notice); };
  events.on_batch = [&progress, volume = RecentVolume()](const StreamClient& client, const FetchStats& stats) mutable {
    if (!progress.is_seen()) return;
    const ClientSession::Stats& session = stats.session;
    const std::string left = session.remaining_pixels > 0 ? fmt::format("error {:.3g} px, {:.4g}", session.remaining_pixels, session.remaining_error)
                                                          : fmt::format("error {:.4g}", session.remaining_error);
    progress.text(fmt::format("{} updates, at most {} to go, {} tetrahedra, volume {:.6g}, {}, {}", client.updates(), session.updates_to_go,
                              client.tet_count(), volume.of(client), human_bytes(session.bytes), left));
  };
  return events;
}

Result<FromSource> fetch_from(const ServerUrl& url, const FetchCommand& /*options*/, const FetchOptions& fetch) {
  Progress progress("receiving " + printable(url.name));
  auto fetched = intervale::fetch(url, fetch, events_of(progress));
  if (!fetched) return tl::unexpected(with_access_hint(fetched.error(), url));
  return FromSource{*std::move(fetched), {}};
}

// Reads the file as far as the view needs it, and chooses what that is. The token is not for web servers: it is not sent.
Result<FromSource> fetch_from(const RemoteUrl& url, const FetchCommand& options, const FetchOptions& fetch) {
  RemoteOptions remote = options.remote;
  remote.authorities = options.access.authorities;
  const auto access = read_access(remote);
  if (!access) return tl::unexpected(access.error());
  fmt::print(stderr, "intervale-client: no server: reads what the view needs of {}\n", url.shown);
  Progress progress("reading " + url.shown);
  const RemoteLimits limits;
  RemoteVolume file(url, *access, limits, asked_for(fetch.shown, fetch.prefers_uniform ? Refine::uniform : Refine::boundary));
  bool has_begun = false;
  const NextVolume next = [&](ReadOn how, const ParallelFor& parallel) -> Result<std::shared_ptr<const IntervalVolume>> {
    auto read = how == ReadOn::all ? file.whole(parallel) : file.next(parallel);
    const bool is_other = !read && !has_begun && !url.shown.ends_with(".ivm");
    has_begun = true;
    if (is_other) return fail(read.error().message + "; data sets of intervale servers begin with ws:// or wss://");
    return read;
  };
  auto fetched = fetch_growing(next, fetch, events_of(progress), on_all_threads);
  if (!fetched) return tl::unexpected(fetched.error());
  return FromSource{*std::move(fetched), FileRead{file.file_bytes(), file.read_bytes(), file.requests()}};
}

// The meshes of all ranges as one, and the figures of each if there are several.
struct FetchedMesh {
  Mesh mesh;
  std::vector<MeshFigures> each;
};

FetchedMesh mesh_of(const StreamClient& client, bool has_digest) {
  FetchedMesh all;
  std::vector<Mesh> meshes = client.meshes();
  for (std::size_t i = 0; i < meshes.size() && meshes.size() > 1; ++i) {
    const Front& front = client.fronts()[i];
    all.each.push_back(figures_of(meshes[i], front.shown_count(), has_digest, front.range()));
  }
  all.mesh = joined(std::move(meshes));
  return all;
}

Result<void> report(const FetchCommand& options, const FromSource& source, const FetchedMesh& all) {
  const Fetched& fetched = source.fetched;
  const FetchStats& stats = fetched.stats;
  const MeshFigures figures = figures_of(all.mesh, fetched.client.updates_in_mesh(), options.digest);
  if (options.json) {
    nlohmann::ordered_json json{{"updates", figures.updates},
                                {"vertices", figures.vertices},
                                {"tets", figures.tets},
                                {"volume", figures.volume},
                                {"bytes_received", stats.session.bytes},
                                {"messages", stats.session.messages},
                                {"reconnects", stats.session.connections - 1},
                                {"seconds_first_mesh", stats.seconds_first_mesh},
                                {"seconds_applying", stats.session.seconds_applying},
                                {"seconds", stats.seconds}};
    if (const auto& file = source.file) json["file"] = {{"bytes", file->of_bytes}, {"bytes_read", file->bytes}, {"requests", file->requests}};
    if (figures.digest) json["digest"] = *figures.digest;
    if (!all.each.empty()) json["ranges"] = to_json(all.each);
    return print_json(json);
  }
  std::string text = printable(fetched.client.description().name) + ": " + to_text(figures) + "\n" + to_text(all.each);
  text += fmt::format("received {} in {} messages; first mesh after {:.1f} ms, {} after {:.1f} ms\n", human_bytes(stats.session.bytes),
                      stats.session.messages, 1000 * stats.seconds_first_mesh, stats.is_complete ? "all" : "budget reached", 1000 * stats.seconds);
  if (const auto& file = source.file)
    text += fmt::format("read {} of the file's {} in {} requests\n", human_bytes(file->bytes), human_bytes(file->of_bytes), file->requests);
  if (figures.digest) text += "digest " + *figures.digest + "\n";
  if (options.output) text += "wrote " + options.output->string() + "\n";
  if (options.picture) text += "drew " + options.picture->file.string() + "\n";
  return print(text);
}

Result<bool> draw(const PictureOptions& picture, const PictureSubject& subject, const std::optional<Camera>& camera) {
  Progress progress("drawing " + picture.file.string());
  return write_picture(picture, subject, camera, with_progress(progress, on_all_threads));
}

Result<void> run(const FetchCommand& options) {
  const auto source = parse_source(options);
  if (!source) return tl::unexpected(source.error());
  if (options.fetch.on_demand && !std::holds_alternative<RemoteUrl>(*source))
    return misuse("--on-demand is for files on web servers; intervale serve has an option of that name");
  if (options.output) {
    if (auto writable = check_mesh_path(*options.output); !writable) return writable;
  }
  if (options.picture) {
    if (auto possible = check_picture(*options.picture, options.fetch.lod.camera); !possible) return possible;
  }
  const auto ranges = parse_ranges(options.range);
  if (!ranges) return tl::unexpected(ranges.error());
  FetchOptions fetch = options.fetch;
  fetch.shown = {*ranges, parse_refine(options.refine)};
  fetch.channels = with_channel_of(options.picture, fetch.channels);
  fetch.prefers_uniform = options.picture && options.picture->render == Render::volume;
  // A mesh that is written is of use from all sides, and the order of what arrives matters only where a budget ends it.
  const auto& picture = options.picture;
  const bool has_budget = fetch.max_bytes || fetch.lod.max_tets;
  fetch.is_opaque = has_budget && picture && !options.output && picture->render == Render::surface && !picture->clip && !picture->edges;
  const auto from = std::visit([&](const auto& url) { return fetch_from(url, options, fetch); }, *source);
  if (!from) return tl::unexpected(from.error());
  const Fetched* const fetched = &from->fetched;
  const FetchedMesh all = mesh_of(fetched->client, options.digest);
  if (options.output) {
    if (auto written = write_mesh(*options.output, all.mesh); !written) return written;
  }
  if (options.picture) {
    const Description& description = fetched->client.description();
    const Range shown = range_around(resolve(description, fetch.shown));
    const auto drawn = draw(*options.picture, {all.mesh, description, shown}, options.fetch.lod.camera);
    if (!drawn) return tl::unexpected(drawn.error());
    if (!*drawn) fmt::print(stderr, "intervale-client: warning: nothing of the mesh is in the picture\n");
  }
  return report(options, *from, all);
}

}  // namespace

void add_fetch_command(Program& program) {
  const auto options = std::make_shared<FetchCommand>();
  CLI::App& command = program.add_command("fetch", "Receive a mesh, and write or draw it", [options] { return run(*options); });
  command
      .add_option("URL", options->url,
                  "ws://HOST:PORT/NAME (or wss://) of a server; or https://HOST/FILE.ivm (or http://), a file on a web server, which is read as far "
                  "as the mesh needs it")
      ->required();
  command.add_flag("--on-demand", options->fetch.on_demand,
                   "Of a file on a web server, read no finer scales than --pixel-error needs if it is estimated how far surfaces move. "
                   "Without it a camera needs all of the file");
  command.add_option("-o,--output", options->output, "Mesh file to write: .vtu, .vtp, .ply, .stl, .obj or .glb")->type_name("MESH");
  add_ranges_option(command, options->range, kShownRangeHelp);
  add_refine_option(command, options->refine, kShownRefineHelp);
  add_channel_option(command, options->fetch.channels);
  add_lod_options(command, options->fetch.lod);
  add_picture_options(command, options->picture);
  add_max_bytes_option(command, options->fetch.max_bytes);
  command
      .add_option_function<unsigned>(
          "--reconnect", [options](unsigned seconds) { options->fetch.reconnect = std::chrono::seconds(seconds); },
          "How long to try to reach a lost server again, to resume (default 30; 0: not at all)")
      ->type_name("SECONDS");
  add_digest_flag(command, options->digest);
  add_access_options(command, options->access);
  add_remote_options(command, options->remote);
  add_json_flag(command, options->json);
}

}  // namespace intervale

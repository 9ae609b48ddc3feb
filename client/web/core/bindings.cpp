// The client core as the browser's worker sees it: bytes of messages in, bytes of messages and buffers to draw from
// out. No I/O but for the meshes that are to be saved, which are written to files in memory.
//
// Texts that are returned say what went wrong; empty ones, that nothing did. Buffers that are returned are the
// caller's.
#include <emscripten/bind.h>
#include <emscripten/val.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/view/coarse_front.h"
#include "client/view/cross_section.h"
#include "client/view/drawn_range.h"
#include "client/view/point_values.h"
#include "client/view/stand_in.h"
#include "client/view/tets_in_box.h"
#include "client/view/values_at.h"
#include "client/view/viewing_session.h"
#include "client/view/volume_tets.h"
#include "client/web/core/js_surface.h"
#include "client/web/core/js_values.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/mesh_digest.h"
#include "common/view/palette.h"

namespace intervale {
namespace {

constexpr std::uint64_t kMostTets = 200'000;            // drawn one by one
constexpr std::uint64_t kMostTrianglesOfMap = 300'000;  // drawn into a depth map

ViewingSession::Clock::time_point time_of(double milliseconds) {
  return ViewingSession::Clock::time_point(
      std::chrono::duration_cast<ViewingSession::Clock::duration>(std::chrono::duration<double, std::milli>(milliseconds)));
}

// All palettes, the default first: {name, colours}; colours: 256 of them, red, green and blue, a byte each, sRGB. The
// first is that of the least value.
val palettes() {
  val palettes = val::array();
  for (const auto name : kPaletteNames) {
    const Palette::Bytes colours = find_palette(name)->bytes();
    val palette = val::object();
    palette.set("name", std::string(name));
    palette.set("colours", buffer_of(std::vector(colours.begin(), colours.end())));
    palettes.call<void>("push", palette);
  }
  return palettes;
}

class Viewer {
 public:
  explicit Viewer(const std::string& dataset) : session_(dataset, "intervale-viewer " INTERVALE_VERSION) {}

  // A View of messages.ts.
  std::string look(const val& view) {
    const val camera = view["camera"];
    WantedView wanted;
    wanted.camera = {.eye = three(camera["eye"]),
                     .look_at = three(camera["lookAt"]),
                     .up = three(camera["up"]),
                     .fov = camera["fov"].as<double>(),
                     .viewport = {camera["viewport"][0].as<int>(), camera["viewport"][1].as<int>()},
                     .pixel_error = view["pixelError"].as<double>()};
    wanted.shown.ranges = ranges_of(view["ranges"]);
    if (view["uniform"].as<bool>()) wanted.shown.refine = Refine::uniform;
    refine_ = wanted.shown.refine;
    if (const val channel = view["channel"]; !channel.isNull()) wanted.channels = {channel.as<std::string>()};
    for (int i = 0, count = view["probed"]["length"].as<int>(); i < count; ++i) wanted.channels.push_back(view["probed"][i].as<std::string>());
    if (!view["region"].isNull()) wanted.region = box_of(view["region"]);
    wanted.budget = {limit_of(view["maxTets"]), limit_of(view["maxUpdates"])};
    wanted.is_opaque = view["opaque"].as<bool>();
    // The last surface, if it shows the same, and more of it is still to come.
    const auto& last = session_.view();
    const bool hides = wanted.is_opaque && last && last->is_opaque && last->shown == wanted.shown && !is_previewing_ && !done();
    const std::optional<DepthMap> depth = hides ? depth_map(wanted.camera) : std::nullopt;
    stale_ = true;  // a budget hides and shows at once
    is_previewing_ = false;
    for (DrawnRange& range : drawn_) range.use_exact();
    const auto looked = session_.look(wanted, depth);
    fit_to_mesh();
    return text_of(looked);
  }
  // The ranges that are shown until the next look(). levels: how many of the finest ones are left out of the ranges that
  // differ from the last view's (coarse_front.h).
  std::string preview(const val& ranges, int levels) {
    if (drawn_.empty()) return {};
    const RangeRequest request{.ranges = ranges_of(ranges), .refine = refine_};
    const StreamClient& client = *session_.mesh();
    const ShownRanges shown = resolve(client.description(), request);
    stale_ = is_previewing_ = true;
    if (levels == 0 || shown.size() != drawn_.size()) {
      for (DrawnRange& range : drawn_) range.use_exact();
      const auto previewed = session_.preview(request);
      fit_to_mesh();
      return text_of(previewed);
    }
    if (auto held = check_held(client.description(), shown); !held) return text_of(held);
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      const Front& front = client.fronts()[i];
      if (shown[i] == ShownRange{front.range(), front.refine()}) {
        drawn_[i].use_exact();
      } else {
        drawn_[i].use_coarse(client, levels, shown[i]);
      }
    }
    return {};
  }
  // How many updates stay without the finest levels, by the number of those (coarse_front.h).
  val level_counts() const {
    val counts = val::array();
    if (!drawn_.empty()) {
      for (const std::uint64_t count : counts_without_finest(*session_.mesh())) counts.call<void>("push", double(count));
    }
    return counts;
  }
  void connected(double now) { session_.connected(time_of(now)); }
  void disconnected() { session_.disconnected(); }

  // Room for one message; valid until the next call.
  val inbox(std::size_t size) {
    inbox_.resize(size);
    return val(emscripten::typed_memory_view(inbox_.size(), inbox_.data()));
  }
  std::string receive(double now) {
    stale_ = true;
    const auto event = session_.receive(inbox_, time_of(now));
    event_ = event ? *event : ClientSession::Event();
    if (event_.is_new_mesh) drawn_.clear();
    fit_to_mesh();
    return text_of(event);
  }
  val take_messages() {
    val messages = val::array();
    for (const auto& message : session_.take_messages()) messages.call<void>("push", buffer_of(message));
    return messages;
  }

  // Of the last receive().
  [[nodiscard]] bool was_opened() const { return event_.kind == ClientSession::Event::Kind::opened; }
  [[nodiscard]] bool is_new_mesh() const { return event_.is_new_mesh; }
  // Of the last failure; 1000 if the server did not say it.
  [[nodiscard]] int fault_code() const {
    const auto& fault = session_.session().fault();
    return int(fault ? fault->code : protocol::CloseCode::normal);
  }

  [[nodiscard]] double updates() const { return session_.mesh() ? double(session_.mesh()->updates()) : 0.0; }
  [[nodiscard]] bool done() const { return session_.is_done(); }

  // What a Progress of messages.ts has of the core.
  [[nodiscard]] val progress() {
    const ClientSession::Stats& stats = session_.session().stats();
    const StreamClient* client = session_.mesh();
    val progress = val::object();
    progress.set("bytes", double(stats.bytes));
    progress.set("updates", updates());
    progress.set("updatesInMesh", client ? double(client->updates_in_mesh()) : 0.0);
    progress.set("updatesShown", client ? double(client->updates() - client->updates_left_out()) : 0.0);
    progress.set("tets", client ? double(client->tet_count()) : 0.0);
    progress.set("updatesToGo", double(stats.updates_to_go));
    progress.set("remainingError", stats.remaining_error);
    progress.set("remainingPixels", session_.remaining_pixels());
    progress.set("done", done());
    progress.set("full", stats.is_full);
    double bound = 0;
    std::vector<double> volumes;
    volumes.reserve(drawn_.size());
    for (const DrawnRange& range : drawn_) volumes.push_back(range.surface().volume());
    progress.set("triangles", double(surface_triangles()));
    progress.set("volumes", array_of(volumes));
    const bool rests = !drawn_.empty() && done() && !is_previewing_ && !stale_;  // the bound takes about as long as the surface
    for (DrawnRange& range : drawn_) bound += rests ? range.volume_bound() : 0;
    progress.set("volumeBound", rests ? val(bound) : val::null());
    progress.set("reconnects", double(stats.connections > 0 ? stats.connections - 1 : 0));
    progress.set("repeated", client && stats.updates > client->updates() ? double(stats.updates - client->updates()) : 0.0);
    return progress;
  }

  // Whether pieces, caps and tetrahedra have `values`, from the next update_surface() on: the field's at each vertex, as
  // floats in its units, or those of the channel of this name (of vectors the lengths), if it is not empty; otherwise
  // null. Pieces that have not changed since then come with update_surface() of all.
  void want_values(bool wanted, const std::string& channel) {
    wants_values_ = wanted;
    channel_ = channel;
  }

  // A SurfaceChange of messages.ts without its version: what changed since the last one, or everything. isOtherMesh:
  // whether tetrahedra changed; perhaps only some inside. A message may be there to be sent: what the surface hides.
  val update_surface(bool edges, bool all) {
    stale_ = false;
    val pieces = val::array(), removed = val::array(), reset = val::array();
    bool is_other_mesh = ranges_sent_ != drawn_.size();
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      const BoundarySurface::Change change = drawn_[i].update(all, wanted_values());
      if (change.reset) reset.call<void>("push", double(i));
      is_other_mesh = is_other_mesh || change.is_other_mesh;
      for (const std::uint32_t id : change.removed) removed.call<void>("push", js_piece_id(i, id));
      for (const std::uint32_t id : change.pieces) pieces.call<void>("push", js_piece(i, drawn_[i], id, edges));
    }
    for (std::size_t i = drawn_.size(); i < ranges_sent_; ++i) reset.call<void>("push", double(i));
    ranges_sent_ = drawn_.size();
    if (session_.wants_depth_map() && !is_previewing_) {
      if (auto map = depth_map(session_.view()->camera)) session_.send_depth_map(std::move(*map));
    }
    val result = val::object();
    result.set("reset", reset);
    result.set("pieces", pieces);
    result.set("removed", removed);
    result.set("isOtherMesh", is_other_mesh);
    result.set("ranges", double(drawn_.size()));
    return result;
  }

  // The same of a coarser surface, with at most so many triangles; null if that of the mesh has no more. With values if
  // the last update_surface() had. Not while a preview is shown.
  val stand_in(double triangles, bool edges) const {
    const std::uint64_t most = std::uint64_t(std::max(0.0, triangles)), full = surface_triangles();
    if (drawn_.empty() || full <= most) return val::null();
    StandIn stand_in(*session_.mesh(), full, most);
    val pieces = val::array(), reset = val::array();
    for (std::size_t i = 0; i < kMaxRanges; ++i) reset.call<void>("push", double(i));
    for (std::size_t i = 0; i < stand_in.ranges().size(); ++i) {
      DrawnRange& range = stand_in.ranges()[i];
      for (const std::uint32_t id : range.update(true, wanted_values()).pieces) pieces.call<void>("push", js_piece(i, range, id, edges));
    }
    val result = val::object();
    result.set("reset", reset);
    result.set("pieces", pieces);
    result.set("removed", val::array());
    result.set("ranges", double(stand_in.ranges().size()));
    return result;
  }

  // What is cut and shown one by one fits the last surface: is_stale() must be false.
  [[nodiscard]] bool is_stale() const { return stale_ || drawn_.empty(); }
  // Of a Cap, and of Tets, in messages.ts.
  val cap(const val& plane) const {
    CrossSection all;
    std::vector<double> triangles;
    triangles.reserve(drawn_.size());
    for (const DrawnRange& range : drawn_) {
      const CrossSection one = cross_section(range.surface(), {three(plane["normal"]), plane["offset"].as<double>()}, range.values());
      triangles.push_back(double(one.vertices.size() / 3));
      all.vertices.insert(all.vertices.end(), one.vertices.begin(), one.vertices.end());
      all.values.insert(all.values.end(), one.values.begin(), one.values.end());
    }
    val cap = val::object();
    cap.set("vertices", buffer_of(all.vertices));
    cap.set("values", have_values() ? buffer_of(all.values) : val::null());
    cap.set("triangles", array_of(triangles));
    return cap;
  }
  val tets(const val& box) const {
    TetsInBox all;
    std::vector<float> values;
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      TetsInBox one = tets_in_box(drawn_[i].surface(), box_of(box), kMostTets / drawn_.size());
      for (TetVertex& vertex : one.vertices) vertex.range = std::uint8_t(i);
      all.vertices.insert(all.vertices.end(), one.vertices.begin(), one.vertices.end());
      if (!drawn_[i].values().empty()) {
        const std::vector<float> its = values_of(one.points, drawn_[i].values());
        values.insert(values.end(), its.begin(), its.end());
      }
      all.count += one.count;
      all.out_of += one.out_of;
    }
    val tets = val::object();
    tets.set("vertices", buffer_of(all.vertices));
    tets.set("values", have_values() ? buffer_of(values) : val::null());
    tets.set("count", double(all.count));
    tets.set("outOf", double(all.out_of));
    return tets;
  }

  // What a Volume of messages.ts has of the core, and has no values without want_values(true); and the order of its
  // tetrahedra. None once drop_volume() was called.
  val volume() {
    volume_ = {};
    if (have_values())
      for (const DrawnRange& range : drawn_) volume_.add(range.surface(), range.values());
    val volume = val::object();
    volume.set("points", buffer_of(volume_.points()));
    volume.set("tets", buffer_of(volume_.tets()));
    return volume;
  }
  val volume_order(const val& eye) const { return buffer_of(volume_.order(three(eye))); }
  void drop_volume() { volume_ = {}; }

  // Of a 'probed' of messages.ts.
  [[nodiscard]] val probe(const val& point) const {
    const auto found = session_.mesh() == nullptr ? std::nullopt : values_at(*session_.mesh(), three(point));
    if (!found) return val::null();
    std::vector<double> values{found->field};
    values.insert(values.end(), found->channels.begin(), found->channels.end());
    return array_of(values);
  }

  // The mesh as a file of the format of this path's extension: its bytes, or a text that says why there are none.
  [[nodiscard]] val save(const std::string& path) const {
    std::vector<std::byte> file;
    const auto written = write_mesh(path, session_.mesh()->mesh(), [&](std::span<const std::byte> bytes) -> Result<void> {
      file.insert(file.end(), bytes.begin(), bytes.end());
      return {};
    });
    return written ? buffer_of(file) : val(written.error().message);
  }
  std::string digest() const { return mesh_digest(session_.mesh()->mesh()); }

 private:
  template <class T>
  static std::string text_of(const Result<T>& result) {
    return result ? std::string() : result.error().message;
  }

  // Of the last surface.
  [[nodiscard]] std::uint64_t surface_triangles() const {
    std::uint64_t triangles = 0;
    for (const DrawnRange& range : drawn_) triangles += range.surface().triangles();
    return triangles;
  }

  // What a camera sees of the last surface; none if that would take too long.
  [[nodiscard]] std::optional<DepthMap> depth_map(const Camera& camera) const {
    const std::uint64_t triangles = surface_triangles();
    if (triangles == 0 || triangles > kMostTrianglesOfMap) return {};
    DepthBuffer buffer(camera);
    for (const DrawnRange& range : drawn_) range.surface().draw(buffer);
    return buffer.map();
  }

  // A range is drawn for each of the mesh's fronts.
  void fit_to_mesh() {
    if (session_.mesh() == nullptr) return;
    const std::vector<Front>& fronts = session_.mesh()->fronts();
    while (drawn_.size() > fronts.size()) drawn_.pop_back();
    while (drawn_.size() < fronts.size()) drawn_.emplace_back(fronts[drawn_.size()]);
  }

  // Whether the last update made values; empty meshes have none either way.
  [[nodiscard]] bool have_values() const {
    return std::any_of(drawn_.begin(), drawn_.end(), [](const DrawnRange& range) { return !range.values().empty(); });
  }

  [[nodiscard]] std::optional<DrawnRange::WantedValues> wanted_values() const {
    if (!wants_values_) return {};
    const std::vector<ChannelValues>& channels = session_.mesh()->channels();
    const auto found = std::find_if(channels.begin(), channels.end(), [this](const ChannelValues& one) { return one.channel().name == channel_; });
    return DrawnRange::WantedValues{found == channels.end() ? nullptr : &*found};
  }

  ViewingSession session_;
  std::deque<DrawnRange> drawn_;  // none before the first mesh; of the ranges that are shown, in their order
  std::size_t ranges_sent_ = 0;   // with the last surface
  std::optional<Refine> refine_;  // of the last look()
  VolumeTets volume_;             // the last volume()'s
  std::vector<std::uint8_t> inbox_;
  ClientSession::Event event_;  // of the last message
  bool wants_values_ = false;
  std::string channel_;  // whose values are wanted; empty: the field's
  bool stale_ = true;    // the mesh may have changed since the last surface
  bool is_previewing_ = false;
};

}  // namespace

EMSCRIPTEN_BINDINGS(intervale) {
  emscripten::function("palettes", &palettes);
  emscripten::class_<Viewer>("Viewer")
      .constructor<const std::string&>()
      .function("look", &Viewer::look)
      .function("preview", &Viewer::preview)
      .function("levelCounts", &Viewer::level_counts)
      .function("connected", &Viewer::connected)
      .function("disconnected", &Viewer::disconnected)
      .function("inbox", &Viewer::inbox)
      .function("receive", &Viewer::receive)
      .function("takeMessages", &Viewer::take_messages)
      .function("wasOpened", &Viewer::was_opened)
      .function("isNewMesh", &Viewer::is_new_mesh)
      .function("updates", &Viewer::updates)
      .function("done", &Viewer::done)
      .function("standIn", &Viewer::stand_in)
      .function("isStale", &Viewer::is_stale)
      .function("faultCode", &Viewer::fault_code)
      .function("progress", &Viewer::progress)
      .function("wantValues", &Viewer::want_values)
      .function("updateSurface", &Viewer::update_surface)
      .function("cap", &Viewer::cap)
      .function("tets", &Viewer::tets)
      .function("volume", &Viewer::volume)
      .function("volumeOrder", &Viewer::volume_order)
      .function("dropVolume", &Viewer::drop_volume)
      .function("probe", &Viewer::probe)
      .function("save", &Viewer::save)
      .function("digest", &Viewer::digest);
}

}  // namespace intervale

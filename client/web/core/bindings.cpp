// The client core as the browser's worker sees it: bytes of messages in, bytes of messages and buffers to draw from
// out. No I/O but for the meshes that are to be saved, which are written to files in memory.
//
// Texts that are returned say what went wrong; empty ones, that nothing did. Buffers that are returned are the
// caller's.
#include <emscripten/bind.h>
#include <emscripten/val.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/view/boundary_surface.h"
#include "client/view/coarse_front.h"
#include "client/view/cross_section.h"
#include "client/view/point_values.h"
#include "client/view/tets_in_box.h"
#include "client/view/viewing_session.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/mesh_digest.h"
#include "common/view/palette.h"

namespace intervale {
namespace {

using emscripten::val;

constexpr std::uint64_t kMostTets = 200'000;  // drawn one by one

ViewingSession::Clock::time_point time_of(double milliseconds) {
  return ViewingSession::Clock::time_point(
      std::chrono::duration_cast<ViewingSession::Clock::duration>(std::chrono::duration<double, std::milli>(milliseconds)));
}

template <class T>
val buffer_of(const std::vector<T>& items) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(items.data());
  return val(emscripten::typed_memory_view(items.size() * sizeof(T), bytes)).call<val>("slice")["buffer"];
}

template <class Array>
val array_of(const Array& items) {
  val array = val::array();
  for (std::size_t i = 0; i < items.size(); ++i) array.set(i, double(items[i]));
  return array;
}

std::array<double, 3> three(const val& array) { return {array[0].as<double>(), array[1].as<double>(), array[2].as<double>()}; }
Box box_of(const val& box) { return {three(box["min"]), three(box["max"])}; }

// null: as much as there is.
std::uint64_t limit_of(const val& number) {
  return number.isNull() || number.isUndefined() ? UINT64_MAX : std::uint64_t(std::max(0.0, number.as<double>()));
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
    if (!view["range"].isNull()) wanted.shown.ranges = {{view["range"][0].as<double>(), view["range"][1].as<double>()}};
    if (!view["region"].isNull()) wanted.region = box_of(view["region"]);
    wanted.budget = {limit_of(view["maxTets"]), limit_of(view["maxUpdates"])};
    stale_ = true;  // a budget hides and shows at once
    is_previewing_ = false;
    coarse_.reset();
    return text_of(session_.look(wanted));
  }
  // The range that is shown until the next look(). levels: how many of the finest ones are left out (coarse_front.h).
  std::string preview(const val& range, int levels) {
    if (!surface_) return {};
    const RangeRequest request{.ranges = {{range[0].as<double>(), range[1].as<double>()}}, .refine = {}};
    stale_ = is_previewing_ = true;
    if (levels == 0) {
      coarse_.reset();
      return text_of(session_.preview(request));
    }
    const ShownRanges shown = resolve(session_.mesh()->description(), request);
    if (auto held = check_held(session_.mesh()->description(), shown); !held) return text_of(held);
    if (!coarse_ || coarse_->levels != levels) coarse_.emplace(*session_.mesh(), levels);
    coarse_->front.set_range(shown.front().range, shown.front().refine);
    return {};
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
    if (event_.is_new_mesh) {
      coarse_.reset();
      surface_.emplace(session_.mesh()->front());
    }
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
    progress.set("triangles", surface_ ? double(drawn().triangles()) : 0.0);
    progress.set("updatesToGo", double(stats.updates_to_go));
    progress.set("remainingError", stats.remaining_error);
    progress.set("remainingPixels", session_.remaining_pixels());
    progress.set("done", done());
    progress.set("full", stats.is_full);
    progress.set("volume", surface_ ? drawn().volume() : 0.0);
    const bool rests = surface_ && done() && !is_previewing_ && !stale_;  // the bound takes about as long as the surface
    progress.set("volumeBound", rests ? val(surface_->volume_bound()) : val::null());
    progress.set("reconnects", double(stats.connections > 0 ? stats.connections - 1 : 0));
    progress.set("repeated", client && stats.updates > client->updates() ? double(stats.updates - client->updates()) : 0.0);
    return progress;
  }

  // Whether pieces, caps and tetrahedra have `values`, from the next update_surface() on: the field's at each vertex, as
  // floats in its units; otherwise null. Pieces that have not changed since then come with update_surface() of all.
  void want_values(bool wanted) { wants_values_ = wanted; }

  // A SurfaceChange of messages.ts without its version: what changed since the last one, or everything.
  val update_surface(bool edges, bool all) {
    stale_ = false;
    const bool is_other = std::exchange(coarse_is_drawn_, coarse_.has_value()) != coarse_.has_value();
    BoundarySurface& surface = coarse_ ? coarse_->surface : *surface_;
    const BoundarySurface::Change change = all || is_other ? surface.all() : surface.update();
    values_ = wants_values_ ? point_values(surface) : std::vector<float>();
    val pieces = val::array();
    for (const std::uint32_t id : change.pieces) {
      const SurfacePiece p = surface.piece(id, edges);
      val piece = val::object();
      piece.set("id", p.id);
      piece.set("vertices", buffer_of(p.vertices));
      piece.set("values", values_at(p.points));
      piece.set("indices", buffer_of(p.indices));
      piece.set("edges", edges ? buffer_of(p.edges) : val::null());
      piece.set("triangles", array_of(p.triangles));
      piece.set("edgeCounts", array_of(p.edge_counts));
      piece.set("min", array_of(p.min));
      piece.set("max", array_of(p.max));
      pieces.call<void>("push", piece);
    }
    val result = val::object();
    result.set("reset", change.reset);
    result.set("pieces", pieces);
    result.set("removed", array_of(change.removed));
    return result;
  }

  // What is cut and shown one by one fits the last surface: is_stale() must be false.
  [[nodiscard]] bool is_stale() const { return stale_ || !surface_; }
  // Of a Cap, and of Tets, in messages.ts.
  val cap(const val& plane) const {
    const CrossSection section = cross_section(drawn(), {three(plane["normal"]), plane["offset"].as<double>()}, values_);
    val cap = val::object();
    cap.set("vertices", buffer_of(section.vertices));
    cap.set("values", !values_.empty() ? buffer_of(section.values) : val::null());
    cap.set("triangles", double(section.vertices.size() / 3));
    return cap;
  }
  val tets(const val& box) const {
    const TetsInBox found = tets_in_box(drawn(), box_of(box), kMostTets);
    val tets = val::object();
    tets.set("vertices", buffer_of(found.vertices));
    tets.set("values", values_at(found.points));
    tets.set("count", double(found.count));
    tets.set("outOf", double(found.out_of));
    return tets;
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

  [[nodiscard]] val values_at(const std::vector<PointId>& points) const {
    return !values_.empty() ? buffer_of(values_of(points, values_)) : val::null();
  }

  // The surface of the mesh, or of what stands in for it.
  [[nodiscard]] const BoundarySurface& drawn() const { return coarse_ ? coarse_->surface : *surface_; }

  struct Coarse {
    Coarse(const StreamClient& client, int left_out) : levels(left_out), front(coarse_front(client, left_out)), surface(front) {}
    int levels;
    Front front;
    BoundarySurface surface;
  };
  ViewingSession session_;
  std::optional<BoundarySurface> surface_;
  std::optional<Coarse> coarse_;  // in a preview of less than the mesh
  bool coarse_is_drawn_ = false;
  std::vector<std::uint8_t> inbox_;
  ClientSession::Event event_;  // of the last message
  bool wants_values_ = false;
  std::vector<float> values_;  // by PointId, of the last surface, if they were wanted
  bool stale_ = true;          // the mesh may have changed since the last surface
  bool is_previewing_ = false;
};

}  // namespace

EMSCRIPTEN_BINDINGS(intervale) {
  emscripten::function("palettes", &palettes);
  emscripten::class_<Viewer>("Viewer")
      .constructor<const std::string&>()
      .function("look", &Viewer::look)
      .function("preview", &Viewer::preview)
      .function("connected", &Viewer::connected)
      .function("disconnected", &Viewer::disconnected)
      .function("inbox", &Viewer::inbox)
      .function("receive", &Viewer::receive)
      .function("takeMessages", &Viewer::take_messages)
      .function("wasOpened", &Viewer::was_opened)
      .function("isNewMesh", &Viewer::is_new_mesh)
      .function("updates", &Viewer::updates)
      .function("done", &Viewer::done)
      .function("isStale", &Viewer::is_stale)
      .function("faultCode", &Viewer::fault_code)
      .function("progress", &Viewer::progress)
      .function("wantValues", &Viewer::want_values)
      .function("updateSurface", &Viewer::update_surface)
      .function("cap", &Viewer::cap)
      .function("tets", &Viewer::tets)
      .function("save", &Viewer::save)
      .function("digest", &Viewer::digest);
}

}  // namespace intervale

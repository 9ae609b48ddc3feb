// The mesh of a front, indexed.
//
// Which points it has is known before its tetrahedra: a cut is a point until its edge is split, by the diamond whose
// spine that is; and a centre inside the range stays a point. Only on the far faces of a box that clamps (domain.h),
// where edges may fall together or vanish, the tetrahedra decide.
#include <algorithm>
#include <array>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cassert>
#include <utility>

#include "common/front/front.h"
#include "common/front/front_mesher.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Tet = FrontMesher::Tet;
using Position = FrontMesher::Position;

class FrontMesh {
 public:
  FrontMesh(const FrontState& state, const ParallelFor& parallel, std::span<const MeshChannel> channels)
      : state_(state),
        channels_(channels),
        mesher_(state),
        is_mirrored_(state.grid.affine.is_mirrored()),
        parallel_(parallel),
        shown_(numbers_of_shown(state)),
        pieces_((shown_.size() + kPiece - 1) / kPiece),
        used_(state.points, std::uint8_t(0)),
        number_(state.points) {}

  Mesh make() {
    parallel_(pieces_, [this](std::size_t piece) { use_edges(piece); });
    parallel_(pieces_, [this](std::size_t piece) { drop_spines(piece); });
    if (!state_.domain.is_whole()) use_border();
    std::uint32_t points = 0;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      number_[i] = points;
      points += used_[i];
    }
    for (const auto& [id, same] : same_) number_[id] = number_[same];

    Mesh mesh;
    mesh.points.resize(points);
    mesh.surface.resize(points);
    mesh.value.resize(points);
    mesh.tets.resize(state_.tet_count);
    mesh.channels.resize(channels_.size());
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      mesh.channels[i] = {channels_[i].name, channels_[i].unit, channels_[i].components, {}};
      mesh.channels[i].value.resize(std::size_t(points) * channels_[i].components);
    }
    parallel_(pieces_, [&](std::size_t piece) { place_points(piece, mesh); });
    place_tets(mesh);
    return mesh;
  }

 private:
  static constexpr std::size_t kPiece = 32;  // supercubes
  static constexpr std::size_t kPiecesAtOnce = 16;

  // The supercubes of which something is shown. The first has the corners.
  static std::vector<std::size_t> numbers_of_shown(const FrontState& state) {
    std::vector<std::size_t> numbers;
    std::size_t number = 0;
    for (const FrontState::Block& block : state.blocks) {
      if (block.shown != 0) numbers.push_back(number);
      ++number;
    }
    return numbers;
  }

  // Calls visit(number) for the supercubes of a piece.
  template <class Visit>
  void for_each_supercube(std::size_t piece, const Visit& visit) const {
    const std::size_t end = std::min(shown_.size(), (piece + 1) * kPiece);
    for (std::size_t i = piece * kPiece; i < end; ++i) visit(shown_[i]);
  }

  // Marks all points that splits brought, but for those on the border.
  void use_edges(std::size_t piece) {
    std::vector<FrontMesher::Point> points;
    std::vector<FrontMesher::Run> runs;
    for_each_supercube(piece, [&](std::size_t number) {
      if (!mesher_.is_at_border(number)) {
        mesher_.append_runs(number, runs);
        return;
      }
      points.clear();
      mesher_.append_points(number, points);
      for (const FrontMesher::Point& p : points) used_[p.id] = !p.on_border;
    });
    for (const FrontMesher::Run& run : runs) std::fill_n(used_.begin() + run.first, run.count, std::uint8_t(1));
  }

  // Takes back those on edges that were split.
  void drop_spines(std::size_t piece) {
    std::vector<FrontMesher::Run> runs;
    for_each_supercube(piece, [&](std::size_t number) { mesher_.append_removed_runs(number, runs); });
    for (const FrontMesher::Run& run : runs) std::fill_n(used_.begin() + run.first, run.count, std::uint8_t(0));
  }

  // Marks the points of the border that tetrahedra use; of those at one place, the first stands for all.
  void use_border() {
    FrontMesher::Tets tets;
    std::vector<FrontMesher::Point> points;
    for (const std::size_t number : shown_) {
      if (!mesher_.is_at_border(number)) continue;
      mesher_.append_points(number, points);
      tets.clear();
      mesher_.append_tets(number, tets);
      for (const Tet& tet : tets) {
        for (const PointId id : tet) used_[id] = 1;
      }
    }
    struct Key {
      Position position;
      Surface surface;
      bool operator==(const Key&) const = default;
    };
    struct Hash {
      std::size_t operator()(const Key& k) const {
        std::uint64_t h = std::uint64_t(k.surface);
        for (const std::int32_t c : k.position) h = (h ^ std::uint32_t(c)) * 0x9e3779b97f4a7c15u;
        return std::size_t(h ^ h >> 32);
      }
    };
    boost::unordered_flat_map<Key, PointId, Hash> first_at;
    for (const FrontMesher::Point& p : points) {
      if (!p.on_border || !used_[p.id]) continue;
      const auto [place, is_new] = first_at.try_emplace(Key{p.position, p.surface}, p.id);
      if (is_new) continue;
      used_[p.id] = 0;
      same_.emplace_back(p.id, place->second);
    }
  }

  void place_points(std::size_t piece, Mesh& mesh) const {
    constexpr double kStep = 1.0 / FrontMesher::kSteps;
    const Affine& affine = state_.grid.affine;
    std::vector<FrontMesher::Point> points;
    std::vector<FrontMesher::Ends> ends;
    for_each_supercube(piece, [&](std::size_t number) {
      points.clear();
      ends.clear();
      mesher_.append_points(number, points, used_, channels_.empty() ? nullptr : &ends);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const FrontMesher::Point& p = points[i];
        if (!used_[p.id]) continue;
        const std::uint32_t n = number_[p.id];
        if (!channels_.empty()) place_channels(ends[i], n, mesh);
        mesh.points[n] = affine.point({p.position[0] * kStep, p.position[1] * kStep, p.position[2] * kStep});
        mesh.surface[n] = p.surface;
        if (p.surface != Surface::inside) mesh.value[n] = p.surface == Surface::alpha ? state_.values.range.alpha : state_.values.range.beta;
      }
      place_values(number, mesh);
    });
  }

  void place_channels(const FrontMesher::Ends& ends, std::size_t point, Mesh& mesh) const {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      const std::size_t n = channels_[i].components;
      FrontMesher::set_values(channels_[i], ends, std::span(mesh.channels[i].value).subspan(point * n, n));
    }
  }

  // The values of a supercube's centres that are points.
  void place_values(std::size_t number, Mesh& mesh) const {
    const auto place_centre = [&](const FrontState::Block& block, Slot slot) {
      const PointId id = block.split_at(slot).centre();
      if (used_[id]) mesh.value[number_[id]] = state_.values.format.value(block.key[slot]);
    };
    const FrontState::Block& block = mesher_.block(number);
    for (const Slot slot : set_bits<Slot>(block.shown & block.inside)) place_centre(block, slot);
    if (number == 0 && state_.origin.side(Slot()) == Side::inside) place_centre(state_.origin, Slot());
  }

  // A few pieces at a time: their tetrahedra are copied to their place while they are still in a cache.
  void place_tets(Mesh& mesh) const {
    std::array<FrontMesher::Tets, kPiecesAtOnce> tets;
    std::array<std::size_t, kPiecesAtOnce + 1> place{};
    for (std::size_t first = 0; first < pieces_; first += kPiecesAtOnce) {
      const std::size_t some = std::min(pieces_ - first, kPiecesAtOnce);
      parallel_(some, [&](std::size_t i) {
        tets[i].clear();
        for_each_supercube(first + i, [&](std::size_t number) { mesher_.append_tets(number, tets[i], number_); });
        for (std::size_t t = 0; is_mirrored_ && t < tets[i].size(); ++t) std::swap(tets[i][t][2], tets[i][t][3]);
      });
      for (std::size_t i = 0; i < some; ++i) place[i + 1] = place[i] + tets[i].size();
      assert(place[some] <= mesh.tets.size() && "splits and merges kept count");
      parallel_(some, [&](std::size_t i) { std::copy(tets[i].begin(), tets[i].end(), mesh.tets.begin() + std::ptrdiff_t(place[i])); });
      place[0] = place[some];
    }
  }

  const FrontState& state_;
  const std::span<const MeshChannel> channels_;
  const FrontMesher mesher_;
  const bool is_mirrored_;  // what is positive in samples is not in the world
  const ParallelFor& parallel_;
  std::vector<std::size_t> shown_;
  std::size_t pieces_;
  MeshArray<std::uint8_t> used_;                   // by PointId: 1 for those of the mesh
  MeshArray<std::uint32_t> number_;                // in the mesh, by PointId
  std::vector<std::pair<PointId, PointId>> same_;  // points that are the same as an earlier one
};

}  // namespace

Mesh Front::mesh(const ParallelFor& parallel, std::span<const MeshChannel> channels) const { return FrontMesh(state_, parallel, channels).make(); }

}  // namespace intervale

// The mesh of a front, indexed.
//
// Which points it has is known before its tetrahedra: a cut is one as long as its edge is, which is until the diamond is split whose spine that is;
// and a centre inside the range stays one. Only on the far faces of a box that clamps (domain.h), where edges can be one edge or none, do the
// tetrahedra themselves have to say.
#include <algorithm>
#include <cassert>

#include "common/front/front.h"
#include "common/front/front_patches.h"

namespace intervale {
namespace {

using Tet = FrontPatches::Tet;
using Position = FrontPatches::Position;

class FrontMesh {
 public:
  FrontMesh(const Front& front, const ParallelFor& parallel)
      : front_(front),
        patches_(front),
        parallel_(parallel),
        pieces_((patches_.supercubes() + kPiece - 1) / kPiece),
        used_(patches_.names()),
        number_(patches_.names()) {}

  Mesh make() {
    parallel_(pieces_, [this](std::size_t piece) { use_edges(piece); });
    parallel_(pieces_, [this](std::size_t piece) { drop_spines(piece); });
    if (!patches_.domain().is_whole()) use_border();
    std::uint32_t points = 0;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      number_[i] = points;
      points += used_[i];
    }
    for (const auto& [point, same] : same_) number_[point] = number_[same];

    Mesh mesh;
    mesh.points.resize(points);
    mesh.surface.resize(points);
    mesh.tets.resize(front_.tet_count());
    const Grid& grid = patches_.grid();
    parallel_(pieces_, [&](std::size_t piece) {
      for_each_supercube(piece, [&](std::size_t b) {
        patches_.for_each_point(b, [&](std::uint32_t point, const Position& p, Surface surface, bool) {
          if (!used_[point]) return;
          const std::uint32_t n = number_[point];
          for (int i = 0; i < 3; ++i) mesh.points[n][i] = grid.origin[i] + grid.spacing[i] * p[i] * (1.0 / FrontPatches::kSteps);
          mesh.surface[n] = surface;
        });
      });
    });
    // A few pieces at a time: what they make goes to its place while it is still in a cache.
    std::array<std::vector<Tet>, kPiecesAtOnce> tets;
    std::array<std::size_t, kPiecesAtOnce + 1> place{};
    for (std::size_t first = 0; first < pieces_; first += kPiecesAtOnce) {
      const std::size_t some = std::min(pieces_ - first, kPiecesAtOnce);
      parallel_(some, [&](std::size_t i) {
        tets[i].clear();
        for_each_supercube(first + i, [&](std::size_t b) { patches_.emit(b, number_, tets[i]); });
      });
      for (std::size_t i = 0; i < some; ++i) place[i + 1] = place[i] + tets[i].size();
      assert(place[some] <= mesh.tets.size() && "splits and merges kept count");
      parallel_(some, [&](std::size_t i) { std::copy(tets[i].begin(), tets[i].end(), mesh.tets.begin() + std::ptrdiff_t(place[i])); });
      place[0] = place[some];
    }
    return mesh;
  }

 private:
  static constexpr std::size_t kPiece = 32;  // supercubes
  static constexpr std::size_t kPiecesAtOnce = 64;

  // Calls visit(number) for the supercubes of a piece.
  template <class Visit>
  void for_each_supercube(std::size_t piece, const Visit& visit) const {
    const std::size_t end = std::min(patches_.supercubes(), (piece + 1) * kPiece);
    for (std::size_t b = piece * kPiece; b < end; ++b) visit(b);
  }

  // All points that splits brought, but for those on the border.
  void use_edges(std::size_t piece) {
    for_each_supercube(piece, [&](std::size_t b) {
      if (patches_.is_at_border(b)) {
        patches_.for_each_point(b, [this](std::uint32_t point, const Position&, Surface, bool border) { used_[point] = !border; });
      } else {
        patches_.for_each_run(b, [this](std::uint32_t first, std::uint32_t n) { std::fill_n(used_.begin() + first, n, std::uint8_t(1)); });
      }
    });
  }

  // Less those on edges that were split.
  void drop_spines(std::size_t piece) {
    for_each_supercube(piece, [&](std::size_t b) {
      patches_.for_each_lost_run(b, [this](std::uint32_t first, std::uint32_t n) { std::fill_n(used_.begin() + first, n, std::uint8_t(0)); });
    });
  }

  // Points of the border: those that tetrahedra use, and of those at one place the first for all.
  void use_border() {
    std::vector<Tet> tets;
    for (std::size_t b = 0; b < patches_.supercubes(); ++b) {
      if (!patches_.is_at_border(b)) continue;
      tets.clear();
      patches_.emit(b, FrontPatches::Themselves{}, tets);
      for (const Tet& tet : tets) {
        for (std::uint32_t point : tet) used_[point] = 1;
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
    boost::unordered_flat_map<Key, std::uint32_t, Hash> there;
    const auto unite = [&](std::uint32_t point, const Position& p, Surface surface, bool border) {
      if (!border || !used_[point]) return;
      const auto [place, is_new] = there.try_emplace(Key{p, surface}, point);
      if (is_new) return;
      used_[point] = 0;
      same_.emplace_back(point, place->second);
    };
    for (std::size_t b = 0; b < patches_.supercubes(); ++b) {
      if (patches_.is_at_border(b)) patches_.for_each_point(b, unite);
    }
  }

  const Front& front_;
  const FrontPatches patches_;
  const ParallelFor& parallel_;
  std::size_t pieces_;
  std::vector<std::uint8_t> used_;                             // by point: 1 for those of the mesh
  std::vector<std::uint32_t> number_;                          // in the mesh, by point
  std::vector<std::pair<std::uint32_t, std::uint32_t>> same_;  // points that are the same as an earlier one
};

}  // namespace

Mesh Front::mesh(const ParallelFor& parallel) const { return FrontMesh(*this, parallel).make(); }

}  // namespace intervale

#include "client/view/boundary_surface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "common/util/bits.h"
#include "common/util/tetrahedron.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

using Tet = FrontMesher::Tet;
using Position = FrontMesher::Position;

// Volumes are summed up in cubes of samples / kSteps.
constexpr double kStepsCubed = double(FrontMesher::kSteps) * FrontMesher::kSteps * FrontMesher::kSteps;

constexpr int kCellsAcross = 8;  // pieces along the virtual grid's side, at most
constexpr int kLeastCell = 16;   // samples

// Appends the edges of triangles, each once; returns how many.
std::size_t add_edges(std::span<const std::uint32_t> triangles, std::vector<std::uint32_t>& edges) {
  std::vector<std::uint64_t> pairs;
  pairs.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[i + k], triangles[i + (k + 1) % 3]);
      pairs.push_back(std::uint64_t(low) << 32 | high);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const std::uint64_t pair : pairs) {
    edges.push_back(std::uint32_t(pair >> 32));
    edges.push_back(std::uint32_t(pair));
  }
  return pairs.size();
}

}  // namespace

BoundarySurface::BoundarySurface(const Front& front) : mesher_(front.state()), is_mirrored_(front.state().grid.affine.is_mirrored()) {
  const Affine inverse = front.state().grid.affine.inverse();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3 normal{};
    normal[axis] = 1;
    box_normals_[axis] = normalized(inverse.transposed(normal));
  }
}

// The room that everything has stays: what follows takes about as much.
void BoundarySurface::forget_all() {
  for (Part& part : parts_) {
    part.shown = 0;
    part.triangles.clear();
  }
  for (auto& members : members_) members.clear();
  std::fill(normal_.begin(), normal_.end(), NormalSum{});
  std::fill(drawn_.begin(), drawn_.end(), std::uint8_t(0));
  known_ = 0;
  triangles_ = 0;
  point_generation_ = mesher_.state().point_generation;
}

std::uint32_t BoundarySurface::piece_of(std::size_t number) const {
  const int cell = std::max(std::countr_zero(unsigned(kLeastCell)), mesher_.state().domain.levels() - std::countr_zero(unsigned(kCellsAcross)));
  const int up = mesher_.block(number).scale + 2;
  const Vertex p = mesher_.block(number).position;
  const auto along = [&](std::int32_t at) { return std::uint32_t(std::uint64_t(at) << up >> cell); };
  return along(p.x) + (kCellsAcross + 1) * (along(p.y) + (kCellsAcross + 1) * along(p.z));
}

// What the parents of diamonds left for them is no longer there, or there again.
void BoundarySurface::mark_parents(std::size_t number, std::uint64_t slots, std::vector<std::uint8_t>& dirty) const {
  const FrontState& front = mesher_.state();
  const int scale = mesher_.block(number).scale, root_scale = front.domain.levels();
  const Vertex position = mesher_.block(number).position;
  const auto mark = [&](int of_scale, Vertex at) {
    if (const std::uint32_t found = front.find_number(of_scale, at); found != FrontState::kNone) dirty[found] = 1;
  };
  for (const Slot slot : set_bits<Slot>(slots)) {
    const Diamond d(centre_of(scale, position, slot), scale, kTypeOfSlot[slot]);
    if (d.centre == front.domain.root()) {
      mark(root_scale, {});
      continue;
    }
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex c = d.parent(k);
      if ((c.x | c.y | c.z) <= 0) continue;
      const int up = scale_of(c) + 2;
      mark(up - 2, {c.x >> up, c.y >> up, c.z >> up});
    }
  }
}

// By number of the supercube: whether what it left is to be made again.
std::vector<std::uint8_t> BoundarySurface::find_changes() {
  const std::size_t count = mesher_.state().blocks.size(), before = std::exchange(known_, count);
  std::vector<std::uint8_t> dirty(count);
  const auto grow = [points = mesher_.state().points](auto& items) {  // by less than doubling, for these are most of a viewer's memory
    if (items.capacity() < points) items.reserve(points + points / 8);
    items.resize(points);
  };
  grow(position_);
  grow(kinds_);
  grow(normal_);
  grow(vertex_of_);
  parts_.resize(count);
  for (std::size_t i = before; i < count; ++i) {
    parts_[i].piece = piece_of(i);
    if (parts_[i].piece >= members_.size()) {
      members_.resize(parts_[i].piece + 1);
      drawn_.resize(parts_[i].piece + 1);
    }
    members_[parts_[i].piece].push_back(std::uint32_t(i));
    dirty[i] = 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t shown = mesher_.block(i).shown, changed = shown ^ parts_[i].shown;
    if (changed == 0 && i < before) continue;
    dirty[i] = 1;
    parts_[i].shown = shown;
    if (before != 0) mark_parents(i, changed, dirty);  // otherwise all are to be made
    points_.clear();
    mesher_.append_points(i, points_);
    const bool is_border = is_at_border(i);
    for (const FrontMesher::Point& p : points_) {
      position_[p.id] = p.position;
      kinds_[p.id] = kinds_of(p, is_border);
    }
  }
  return dirty;
}

double BoundarySurface::volume_of(const Tet& tet) const {
  const Position &o = position_[tet[0]], &a = position_[tet[1]], &b = position_[tet[2]], &c = position_[tet[3]];
  const auto from = [&o](const Position& p) { return Vec3{double(p[0] - o[0]), double(p[1] - o[1]), double(p[2] - o[2])}; };
  return triple_product(from(a), from(b), from(c)) / 6;
}

// Six times the volume under each triangle as seen from the middle of the box, with its sign: over a closed surface this
// sums up to what it encloses.
double BoundarySurface::volume_under(const std::vector<Triangle>& triangles) const {
  const Vertex last = mesher_.state().domain.last();
  const Position middle{last.x * (FrontMesher::kSteps / 2), last.y * (FrontMesher::kSteps / 2), last.z * (FrontMesher::kSteps / 2)};
  const auto from_middle = [&](PointId point) {
    const Position& p = position_[point];
    return Vec3{double(p[0] - middle[0]), double(p[1] - middle[1]), double(p[2] - middle[2])};
  };
  double sum = 0;
  for (const Triangle& t : triangles) sum += triple_product(from_middle(t.points[0]), from_middle(t.points[1]), from_middle(t.points[2]));
  return sum / 6;
}

// A bit for each kind of what the point lies on. is_border: whether it may lie on the box.
std::uint8_t BoundarySurface::kinds_of(const FrontMesher::Point& point, bool is_border) const {
  unsigned kinds = point.surface == Surface::alpha ? 1u << kAlpha : point.surface == Surface::beta ? 1u << kBeta : 0;
  if (!is_border) return std::uint8_t(kinds);
  const Vertex last = mesher_.state().domain.last();
  const std::array<std::int32_t, 3> far{last.x * FrontMesher::kSteps, last.y * FrontMesher::kSteps, last.z * FrontMesher::kSteps};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int32_t at = point.position[axis];
    kinds |= unsigned(at == 0) << (kBox + 2 * axis) | unsigned(at == far[axis]) << (kBox + 2 * axis + 1);
  }
  return std::uint8_t(kinds);
}

Surface BoundarySurface::surface(PointId id) const {
  const unsigned kinds = kinds_[id];
  return (kinds >> kAlpha & 1) != 0 ? Surface::alpha : (kinds >> kBeta & 1) != 0 ? Surface::beta : Surface::inside;
}

bool BoundarySurface::is_at_border(std::size_t number) const {
  const Vertex p = mesher_.block(number).position, last = mesher_.state().domain.last();
  const auto reaches = [up = mesher_.block(number).scale + 2](std::int32_t at, std::int32_t end) {
    return at == 0 || std::int64_t(at + 1) << up >= end;
  };
  return reaches(p.x, last.x) || reaches(p.y, last.y) || reaches(p.z, last.z);
}

void BoundarySurface::add_normals(const std::vector<Triangle>& triangles, int sign) {
  const Affine& affine = mesher_.state().grid.affine;
  for (const Triangle& t : triangles) {
    if (t.kind >= kBox) continue;
    std::array<Vec3, 3> corners{};  // from the first one
    const Position& first = position_[t.points[0]];
    for (std::size_t k = 1; k < 3; ++k) {
      const Position& p = position_[t.points[k]];
      corners[k] = affine.direction({double(p[0] - first[0]), double(p[1] - first[1]), double(p[2] - first[2])});
    }
    const auto added = angle_weighted_normals(corners, quick_arc_tangent);
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) normal_[t.points[k]][i] += sign * added[k][i];
  }
}

void BoundarySurface::remake(std::size_t number) {
  Part& part = parts_[number];
  add_normals(part.triangles, -1);
  triangles_ -= part.triangles.size();
  find_triangles(number);
  // Exactly as much room as they need, if less than half of it is needed.
  if (part.triangles.capacity() > 2 * triangles_made_.size()) part.triangles = std::vector<Triangle>();
  part.triangles.assign(triangles_made_.begin(), triangles_made_.end());
  part.volume = volume_under(part.triangles);
  part.has_bound = false;
  add_normals(part.triangles, 1);
  triangles_ += part.triangles.size();
}

void BoundarySurface::find_bound(std::size_t number, Part& part) {
  part.has_bound = true;
  part.bound = 0;
  tets_.clear();
  halves_.clear();
  mesher_.append_halves(number, tets_, halves_);
  std::size_t first = 0;
  for (const FrontMesher::Half& half : halves_) {
    double inside = 0;  // volumes in samples / kSteps, cubed
    for (; first < half.end; ++first) inside += volume_of(tets_[first]);
    const auto from = [&c = half.corners](int k) { return Vec3{double(c[k].x - c[0].x), double(c[k].y - c[0].y), double(c[k].z - c[0].z)}; };
    const double whole = std::abs(triple_product(from(1), from(2), from(3))) / 6 * kStepsCubed;
    part.bound += std::max(inside, whole - inside);
  }
}

// Makes in triangles_made_ what a supercube left of the boundary.
void BoundarySurface::find_triangles(std::size_t number) {
  triangles_made_.clear();
  faces_.clear();
  mesher_.append_faces(number, faces_);
  const auto lod = std::uint8_t(mesher_.block(number).scale);
  for (auto& [points, surface] : faces_) {
    if (is_mirrored_) std::swap(points[1], points[2]);
    triangles_made_.push_back({points, std::uint8_t(surface == Surface::alpha ? kAlpha : kBeta), lod});
  }
  if (is_at_border(number)) add_box_faces(number);
}

void BoundarySurface::add_box_faces(std::size_t number) {
  const auto lod = std::uint8_t(mesher_.block(number).scale);
  tets_.clear();
  mesher_.append_tets(number, tets_);
  for (const Tet& tet : tets_) {
    std::array<unsigned, 4> kinds;
    for (std::size_t k = 0; k < 4; ++k) kinds[k] = kinds_[tet[k]];
    for (const auto& face : kTetFaces) {
      const unsigned common = kinds[face[0]] & kinds[face[1]] & kinds[face[2]];
      if (common < 1u << kBox || (common & (1u << kAlpha | 1u << kBeta)) != 0) continue;
      std::array<PointId, 3> points{tet[face[0]], tet[face[1]], tet[face[2]]};
      if (is_mirrored_) std::swap(points[1], points[2]);
      triangles_made_.push_back({points, std::uint8_t(std::countr_zero(common)), lod});
    }
  }
}

bool BoundarySurface::is_empty(std::uint32_t piece) const {
  return std::all_of(members_[piece].begin(), members_[piece].end(), [this](std::uint32_t number) { return parts_[number].triangles.empty(); });
}

SurfaceVertex BoundarySurface::vertex(PointId point, const Triangle& t) const {
  const Position& p = position_[point];
  SurfaceVertex v{float(p[0]) / FrontMesher::kSteps, float(p[1]) / FrontMesher::kSteps, float(p[2]) / FrontMesher::kSteps};
  Vec3 normal{};
  if (t.kind >= kBox) {
    normal = scaled((t.kind - kBox) % 2 == 0 ? -1 : 1, box_normals_[std::size_t(t.kind - kBox) / 2]);
  } else {
    const NormalSum& sum = normal_[point];
    normal = {double(sum[0]), double(sum[1]), double(sum[2])};
    const double squared = dot(normal, normal);
    normal = scaled(squared > 0 ? 1 / std::sqrt(squared) : 0, normal);
  }
  const auto coded = [](double c) { return std::int8_t(nearest_int(127 * c)); };
  v.nx = coded(normal[0]);
  v.ny = coded(normal[1]);
  v.nz = coded(normal[2]);
  v.lod = t.lod;
  return v;
}

// Appends triangles of one kind, with their vertices. points: of the piece's vertices.
void BoundarySurface::add_triangles(const std::vector<const Triangle*>& triangles, std::vector<PointId>& points, SurfacePiece& piece) {
  const std::size_t first = points.size();  // of this kind's vertices
  for (const Triangle* t : triangles) {
    for (const PointId point : t->points) {
      // A sparse set (Briggs and Torczon 1993): vertex_of_ is not cleared; its entry counts if that vertex is this
      // point's.
      std::uint32_t& number = vertex_of_[point];
      if (number < first || number >= points.size() || points[number] != point) {
        number = std::uint32_t(points.size());
        points.push_back(point);
        piece.vertices.push_back(vertex(point, *t));
      }
      piece.indices.push_back(number);
      auto& lod = piece.vertices[number].lod;
      lod = std::min(lod, t->lod);
    }
  }
}

SurfacePiece BoundarySurface::piece(std::uint32_t id, bool edges) {
  std::array<std::size_t, kKinds> counts{};
  std::size_t triangles = 0;
  for (const std::uint32_t number : members_[id]) {
    triangles += parts_[number].triangles.size();
    for (const Triangle& t : parts_[number].triangles) ++counts[t.kind];
  }
  std::array<std::vector<const Triangle*>, kKinds> by_kind;
  for (std::size_t kind = 0; kind < kKinds; ++kind) by_kind[kind].reserve(counts[kind]);
  for (const std::uint32_t number : members_[id]) {
    for (const Triangle& t : parts_[number].triangles) by_kind[t.kind].push_back(&t);
  }
  SurfacePiece piece;
  piece.id = id;
  std::vector<PointId> points;  // of the vertices: about one for two triangles
  points.reserve(triangles);
  piece.vertices.reserve(triangles);
  piece.indices.reserve(3 * triangles);
  for (int kind = 0; kind < kKinds; ++kind) {
    const int group = std::min(kind, kBox);
    const std::size_t first = piece.indices.size();
    add_triangles(by_kind[kind], points, piece);
    piece.triangles[group] += std::uint32_t(by_kind[kind].size());
    if (edges) piece.edge_counts[group] += std::uint32_t(add_edges(std::span(piece.indices).subspan(first), piece.edges));
  }
  piece.points = std::move(points);
  if (piece.vertices.empty()) return piece;
  piece.min = piece.max = {piece.vertices[0].x, piece.vertices[0].y, piece.vertices[0].z};
  for (const SurfaceVertex& v : piece.vertices) {
    const std::array<float, 3> p{v.x, v.y, v.z};
    for (int i = 0; i < 3; ++i) {
      piece.min[i] = std::min(piece.min[i], p[i]);
      piece.max[i] = std::max(piece.max[i], p[i]);
    }
  }
  return piece;
}

BoundarySurface::Change BoundarySurface::update() {
  Change change;
  if (mesher_.state().point_generation != point_generation_ || known_ == 0) {
    forget_all();
    change.reset = true;
  }
  const std::vector<std::uint8_t> dirty = find_changes();
  std::vector<std::uint8_t> pieces(members_.size());
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    if (!dirty[i]) continue;
    change.is_other_mesh = true;
    remake(i);
    pieces[parts_[i].piece] = 1;
  }
  for (std::uint32_t id = 0; id < pieces.size(); ++id) {
    if (!pieces[id]) continue;
    const bool was_there = std::exchange(drawn_[id], std::uint8_t(!is_empty(id))) != 0;
    if (drawn_[id]) {
      change.pieces.push_back(id);
    } else if (was_there) {
      change.removed.push_back(id);
    }
  }
  return change;
}

BoundarySurface::Change BoundarySurface::all() {
  (void)update();
  Change change;
  change.reset = change.is_other_mesh = true;
  for (std::uint32_t id = 0; id < members_.size(); ++id) {
    if (drawn_[id]) change.pieces.push_back(id);
  }
  return change;
}

double BoundarySurface::samples_in_world() const { return mesher_.state().grid.affine.determinant() / kStepsCubed; }

double BoundarySurface::volume() const {
  double sum = 0;
  for (const Part& part : parts_) sum += part.volume;
  return sum * samples_in_world();
}

double BoundarySurface::volume_bound() {
  double sum = 0;
  for (std::size_t number = 0; number < known_; ++number) {
    if (!parts_[number].has_bound) find_bound(number, parts_[number]);
    sum += parts_[number].bound;
  }
  return sum * std::abs(samples_in_world());
}

}  // namespace intervale

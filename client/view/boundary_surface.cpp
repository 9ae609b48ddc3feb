#include "client/view/boundary_surface.h"

#include <algorithm>
#include <bit>
#include <cassert>
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

}  // namespace

// Adds what triangles contribute to the normals at their corners, or takes it back.
class BoundarySurface::NormalAdder {
 public:
  NormalAdder(BoundarySurface& surface, int sign) : surface_(surface), sign_(sign) {}
  // Those on alpha and beta. What was added counts after flush().
  void add(const Part& part) {
    for (const Triangle& t : std::span(part.triangles).first(part.end[kBeta])) {
      if (count_ == kLanes) flush();
      const Position &p0 = surface_.position(t[0]), &p1 = surface_.position(t[1]), &p2 = surface_.position(t[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sides_.first[axis][count_] = float(p1[axis] - p0[axis]);
        sides_.second[axis][count_] = float(p2[axis] - p0[axis]);
      }
      triangles_[count_++] = t;
    }
  }
  void flush() {
    surface_.corner_normals_.sum(sides_, sums_);
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        NormalSum& normal = surface_.points_[triangles_[i][k]].normal;
        for (std::size_t axis = 0; axis < 3; ++axis) normal[axis] += sign_ * sums_[k][axis][i];
      }
    }
    count_ = 0;
  }

 private:
  BoundarySurface& surface_;
  const int sign_;
  std::size_t count_ = 0;  // of triangles that wait
  Lanes<Triangle> triangles_{};
  CornerNormals::Sides sides_;
  CornerNormals::Sums sums_{};
};

BoundarySurface::BoundarySurface(const Front& front)
    : mesher_(front.state()), is_mirrored_(front.state().grid.affine.is_mirrored()), corner_normals_(front.state().grid.affine) {
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
    part.end = {};
  }
  for (auto& members : members_) members.clear();
  points_.clear();
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
  grow(points_);
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
    if (shown == 0) continue;
    mesh_points_.clear();
    mesher_.append_points(i, mesh_points_);
    const bool is_border = is_at_border(i);
    for (const FrontMesher::Point& p : mesh_points_) {
      points_[p.id].position = p.position;
      points_[p.id].kinds = kinds_of(p, is_border);
    }
  }
  return dirty;
}

double BoundarySurface::volume_of(const Tet& tet) const {
  const Position &o = position(tet[0]), &a = position(tet[1]), &b = position(tet[2]), &c = position(tet[3]);
  const auto from = [&o](const Position& p) { return Vec3{double(p[0] - o[0]), double(p[1] - o[1]), double(p[2] - o[2])}; };
  return triple_product(from(a), from(b), from(c)) / 6;
}

// The volume between each triangle and the plane across z through the middle of the box, with its sign: over a closed
// surface this sums up to what it encloses. In steps, cubed.
double BoundarySurface::volume_under(const Part& part) const {
  const std::int64_t middle = std::int64_t(mesher_.state().domain.last().z) * (FrontMesher::kSteps / 2);
  double sum = 0;
  for (const Triangle& t : part.triangles) {
    const Position &p = position(t[0]), &q = position(t[1]), &r = position(t[2]);
    // Twice the area seen along z, and three times the mean distance
    const std::int64_t area = std::int64_t(q[0] - p[0]) * (r[1] - p[1]) - std::int64_t(q[1] - p[1]) * (r[0] - p[0]);
    const std::int64_t height = std::int64_t(p[2]) + q[2] + r[2] - 3 * middle;
    sum += double(area) * double(height);
  }
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
  const unsigned kinds = points_[id].kinds;
  return (kinds >> kAlpha & 1) != 0 ? Surface::alpha : (kinds >> kBeta & 1) != 0 ? Surface::beta : Surface::inside;
}

bool BoundarySurface::is_at_border(std::size_t number) const {
  const Vertex p = mesher_.block(number).position, last = mesher_.state().domain.last();
  const auto reaches = [up = mesher_.block(number).scale + 2](std::int32_t at, std::int32_t end) {
    return at == 0 || std::int64_t(at + 1) << up >= end;
  };
  return reaches(p.x, last.x) || reaches(p.y, last.y) || reaches(p.z, last.z);
}

// Makes what the supercubes that are dirty left of the boundary.
void BoundarySurface::remake(const std::vector<std::uint8_t>& dirty) {
  NormalAdder take_back(*this, -1), add(*this, 1);
  for (std::size_t number = 0; number < dirty.size(); ++number) {
    if (dirty[number] != 0) take_back.add(parts_[number]);
  }
  take_back.flush();
  for (std::size_t number = 0; number < dirty.size(); ++number) {
    if (dirty[number] == 0) continue;
    Part& part = parts_[number];
    triangles_ -= part.triangles.size();
    find_triangles(number);
    keep_triangles(part);
    triangles_ += part.triangles.size();
    part.volume = volume_under(part);
    part.has_bound = false;
    add.add(part);
  }
  add.flush();
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

// Finds what a supercube left of the boundary.
void BoundarySurface::find_triangles(std::size_t number) {
  for (auto& triangles : found_) triangles.clear();
  faces_.clear();
  mesher_.append_faces(number, faces_);
  for (auto& [points, surface] : faces_) {
    if (is_mirrored_) std::swap(points[1], points[2]);
    found_[surface == Surface::alpha ? kAlpha : kBeta].push_back(points);
  }
  if (is_at_border(number)) find_box_faces(number);
}

void BoundarySurface::find_box_faces(std::size_t number) {
  tets_.clear();
  mesher_.append_tets(number, tets_);
  for (const Tet& tet : tets_) {
    std::array<unsigned, 4> kinds;
    for (std::size_t k = 0; k < 4; ++k) kinds[k] = points_[tet[k]].kinds;
    for (const auto& face : kTetFaces) {
      const unsigned common = kinds[face[0]] & kinds[face[1]] & kinds[face[2]];
      if (common < 1u << kBox || (common & (1u << kAlpha | 1u << kBeta)) != 0) continue;
      Triangle points{tet[face[0]], tet[face[1]], tet[face[2]]};
      if (is_mirrored_) std::swap(points[1], points[2]);
      found_[std::size_t(std::countr_zero(common))].push_back(points);
    }
  }
}

// In place of what the part had, in order of kinds: exactly as much room as they need, if less than half of its room is
// needed.
void BoundarySurface::keep_triangles(Part& part) {
  std::size_t count = 0;
  for (const auto& triangles : found_) count += triangles.size();
  assert(count <= 0xffff && "each of a supercube's diamonds has a few dozen at most");
  if (part.triangles.capacity() > 2 * count) part.triangles = std::vector<Triangle>();
  part.triangles.clear();
  part.triangles.reserve(count);
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    part.triangles.insert(part.triangles.end(), found_[kind].begin(), found_[kind].end());
    part.end[kind] = std::uint16_t(part.triangles.size());
  }
}

bool BoundarySurface::is_empty(std::uint32_t piece) const {
  return std::all_of(members_[piece].begin(), members_[piece].end(), [this](std::uint32_t number) { return parts_[number].triangles.empty(); });
}

BoundarySurface::Change BoundarySurface::update() {
  Change change;
  if (mesher_.state().point_generation != point_generation_ || known_ == 0) {
    forget_all();
    change.reset = true;
  }
  const std::vector<std::uint8_t> dirty = find_changes();
  remake(dirty);
  std::vector<std::uint8_t> pieces(members_.size());
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    if (!dirty[i]) continue;
    change.is_other_mesh = true;
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

void BoundarySurface::draw(DepthBuffer& buffer) const {
  const Affine& affine = mesher_.state().grid.affine;
  const auto corner = [&](PointId id) {
    const FrontMesher::Position& p = points_[id].position;
    return affine.point({double(p[0]) / FrontMesher::kSteps, double(p[1]) / FrontMesher::kSteps, double(p[2]) / FrontMesher::kSteps});
  };
  for (const Part& part : parts_) {
    for (const Triangle& t : part.triangles) buffer.draw({corner(t[0]), corner(t[1]), corner(t[2])});
  }
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

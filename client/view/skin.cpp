#include "client/view/skin.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/util/bits.h"
#include "common/util/tetrahedron.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

using Tet = FrontPatches::Tet;
using Position = FrontPatches::Position;

constexpr int kCellsAcross = 8;  // pieces along the virtual grid's side, at most
constexpr int kLeastCell = 16;   // samples

// To 1e-4 (Abramowitz and Stegun 4.4.45), several times faster than std::acos.
double arc_cosine(double x) {
  const double a = std::min(1.0, std::abs(x));
  const double angle = std::sqrt(1 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - 0.0187293 * a)));
  return x < 0 ? std::numbers::pi - angle : angle;
}

}  // namespace

void Skin::forget_all() {
  position_.clear();
  surface_.clear();
  normal_.clear();
  there_.clear();
  parts_.clear();
  members_.clear();
  drawn_.clear();
  triangles_ = 0;
  renamed_ = front_->renamed();
}

std::uint32_t Skin::piece_of(std::size_t number) const {
  const int cell = std::max(std::countr_zero(unsigned(kLeastCell)), patches_.domain().levels() - std::countr_zero(unsigned(kCellsAcross)));
  const int up = patches_.scale(number) + 2;
  const Vertex p = patches_.position(number);
  const auto along = [&](std::int32_t at) { return std::uint32_t(std::uint64_t(at) << up >> cell); };
  return along(p.x) + (kCellsAcross + 1) * (along(p.y) + (kCellsAcross + 1) * along(p.z));
}

// What the parents of diamonds left for them is no longer there, or there again.
void Skin::mark_parents(std::size_t number, std::uint64_t slots, std::vector<std::uint8_t>& dirty) const {
  const int scale = patches_.scale(number), levels = patches_.domain().levels();
  const Vertex position = patches_.position(number);
  const auto mark = [&](int of_scale, Vertex at) {
    if (const auto found = patches_.find(of_scale, at)) dirty[*found] = 1;
  };
  for (const int slot : set_bits(slots)) {
    const Diamond d(centre_of(scale, position, slot), scale, kTypeOfSlot[slot]);
    if (d.centre == patches_.domain().root()) {
      mark(levels, {});
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
std::vector<std::uint8_t> Skin::find_changes() {
  const std::size_t count = patches_.supercubes(), before = parts_.size();
  std::vector<std::uint8_t> dirty(count);
  const auto grow = [names = patches_.names()](auto& items) {  // by less than doubling, for these are most of a viewer's memory
    if (items.capacity() < names) items.reserve(names + names / 8);
    items.resize(names);
  };
  grow(position_);
  grow(surface_);
  grow(normal_);
  grow(there_);
  parts_.resize(count);
  for (std::size_t i = before; i < count; ++i) {
    parts_[i].piece = piece_of(i);
    const std::size_t pieces = std::max<std::size_t>(members_.size(), parts_[i].piece + 1);
    members_.resize(pieces);
    drawn_.resize(pieces);
    members_[parts_[i].piece].push_back(std::uint32_t(i));
    dirty[i] = 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t shown = patches_.shown(i), changed = shown ^ parts_[i].shown;
    if (changed == 0 && i < before) continue;
    dirty[i] = 1;
    parts_[i].shown = shown;
    mark_parents(i, changed, dirty);
    patches_.for_each_point(i, [this](std::uint32_t name, const Position& p, Surface surface, bool) {
      position_[name] = p;
      surface_[name] = surface;
    });
  }
  return dirty;
}

double Skin::volume_of(const Tet& tet) const {
  const Position &o = position_[tet[0]], &a = position_[tet[1]], &b = position_[tet[2]], &c = position_[tet[3]];
  const auto from = [&o](const Position& p) { return Vec3{double(p[0] - o[0]), double(p[1] - o[1]), double(p[2] - o[2])}; };
  return triple_product(from(a), from(b), from(c)) / 6;
}

int Skin::kind_of(const std::array<std::uint32_t, 3>& points, bool at_border) const {
  const Surface s = surface_[points[0]];
  if (s != Surface::inside && surface_[points[1]] == s && surface_[points[2]] == s) return s == Surface::alpha ? 0 : 1;
  if (!at_border) return -1;
  const Vertex last = patches_.domain().last();
  const std::array<std::int32_t, 3> far{last.x * FrontPatches::kSteps, last.y * FrontPatches::kSteps, last.z * FrontPatches::kSteps};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t at = position_[points[0]][axis];
    if (position_[points[1]][axis] != at || position_[points[2]][axis] != at) continue;
    if (at == 0) return 2 + 2 * axis;
    if (at == far[axis]) return 3 + 2 * axis;
  }
  return -1;
}

void Skin::add_normals(const std::vector<Triangle>& triangles, int sign) {
  const auto& spacing = patches_.grid().spacing;
  for (const Triangle& t : triangles) {
    if (t.kind > 1) continue;
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Position& p = position_[t.points[k]];
      corners[k] = {p[0] * spacing[0], p[1] * spacing[1], p[2] * spacing[2]};
    }
    const auto added = angle_weighted_normals(corners, arc_cosine);
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) normal_[t.points[k]][i] += sign * added[k][i];
  }
}

void Skin::remake(std::size_t number) {
  Part& part = parts_[number];
  add_normals(part.triangles, -1);
  triangles_ -= part.triangles.size();
  part.triangles.clear();
  part.volume = part.bound = 0;
  tets_.clear();
  // Volumes in samples / kSteps, cubed, until the end.
  double half = -1;  // of the last half, if it can change; else below 0
  std::size_t half_first = 0;
  const auto end_half = [&](std::size_t end) {
    double inside = 0;
    for (; half_first < end; ++half_first) inside += volume_of(tets_[half_first]);
    part.volume += inside;
    if (half >= 0) part.bound += std::max(inside, half - inside);
  };
  patches_.emit(number, FrontPatches::Themselves{}, tets_, [&](const FrontPatches::Half& h, std::size_t first) {
    end_half(first);
    half = -1;
    if (!h.can_change) return;
    const auto from = [&h](int k) {
      return Vec3{double(h.corners[k].x - h.corners[0].x), double(h.corners[k].y - h.corners[0].y), double(h.corners[k].z - h.corners[0].z)};
    };
    half = std::abs(triple_product(from(1), from(2), from(3))) / 6 * std::pow(double(FrontPatches::kSteps), 3);
  });
  end_half(tets_.size());

  const Vertex p = patches_.position(number), last = patches_.domain().last();
  const auto reaches = [up = patches_.scale(number) + 2](std::int32_t at, std::int32_t end) { return at == 0 || std::int64_t(at + 1) << up >= end; };
  const bool at_border = reaches(p.x, last.x) || reaches(p.y, last.y) || reaches(p.z, last.z);
  const auto level = std::uint8_t(patches_.scale(number));
  for (const Tet& tet : tets_) {
    for (const auto& face : kTetFaces) {
      const std::array<std::uint32_t, 3> points{tet[face[0]], tet[face[1]], tet[face[2]]};
      const int kind = kind_of(points, at_border);
      if (kind >= 0) part.triangles.push_back({points, std::uint8_t(kind), level});
    }
  }
  part.triangles.shrink_to_fit();
  add_normals(part.triangles, 1);
  triangles_ += part.triangles.size();
}

bool Skin::is_empty(std::uint32_t piece) const {
  return std::all_of(members_[piece].begin(), members_[piece].end(), [this](std::uint32_t number) { return parts_[number].triangles.empty(); });
}

SkinPiece Skin::piece(std::uint32_t id, bool edges) {
  std::array<std::vector<const Triangle*>, kKinds> by_kind;
  for (const std::uint32_t number : members_[id]) {
    for (const Triangle& t : parts_[number].triangles) by_kind[t.kind].push_back(&t);
  }
  SkinPiece piece;
  piece.id = id;
  std::vector<std::uint32_t> names;  // of the vertices
  std::vector<std::uint64_t> pairs;
  for (int kind = 0; kind < kKinds; ++kind) {
    if (by_kind[kind].empty()) continue;
    const int group = std::min(kind, 2);
    const std::size_t first = names.size();  // of this kind's vertices
    pairs.clear();
    for (const Triangle* t : by_kind[kind]) {
      std::array<std::uint32_t, 3> corner;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t name = t->points[k];
        // A sparse set (Briggs and Torczon 1993): what is said of a name counts if it is said back.
        if (there_[name] < first || there_[name] >= names.size() || names[there_[name]] != name) {
          there_[name] = std::uint32_t(names.size());
          names.push_back(name);
          const Position& p = position_[name];
          SkinVertex v{float(p[0]) / FrontPatches::kSteps, float(p[1]) / FrontPatches::kSteps, float(p[2]) / FrontPatches::kSteps};
          std::array<std::int8_t, 3> n{};
          if (kind > 1) {
            n[(kind - 2) / 2] = kind % 2 == 0 ? -127 : 127;
          } else {
            const NormalSum& sum = normal_[name];
            const Vec3 normal = normalized({double(sum[0]), double(sum[1]), double(sum[2])});
            for (int i = 0; i < 3; ++i) n[i] = std::int8_t(std::lrint(127 * normal[i]));
          }
          v.nx = n[0];
          v.ny = n[1];
          v.nz = n[2];
          v.level = t->level;
          piece.vertices.push_back(v);
        }
        corner[k] = there_[name];
        auto& level = piece.vertices[corner[k]].level;
        level = std::min(level, t->level);
      }
      piece.indices.insert(piece.indices.end(), corner.begin(), corner.end());
      if (!edges) continue;
      for (int k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(corner[k], corner[(k + 1) % 3]);
        pairs.push_back(std::uint64_t(low) << 32 | high);
      }
    }
    piece.triangles[group] += std::uint32_t(by_kind[kind].size());
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    for (const std::uint64_t pair : pairs) {
      piece.edges.push_back(std::uint32_t(pair >> 32));
      piece.edges.push_back(std::uint32_t(pair));
    }
    piece.edge_counts[group] += std::uint32_t(pairs.size());
  }
  if (piece.vertices.empty()) return piece;
  piece.min = piece.max = {piece.vertices[0].x, piece.vertices[0].y, piece.vertices[0].z};
  for (const SkinVertex& v : piece.vertices) {
    const std::array<float, 3> p{v.x, v.y, v.z};
    for (int i = 0; i < 3; ++i) {
      piece.min[i] = std::min(piece.min[i], p[i]);
      piece.max[i] = std::max(piece.max[i], p[i]);
    }
  }
  return piece;
}

Skin::Change Skin::update() {
  Change change;
  if (front_->renamed() != renamed_ || parts_.empty()) {
    forget_all();
    change.reset = true;
  }
  const std::vector<std::uint8_t> dirty = find_changes();
  std::vector<std::uint8_t> pieces(members_.size());
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    if (!dirty[i]) continue;
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

Skin::Change Skin::all() {
  (void)update();
  Change change;
  change.reset = true;
  for (std::uint32_t id = 0; id < members_.size(); ++id) {
    if (drawn_[id]) change.pieces.push_back(id);
  }
  return change;
}

double Skin::volume() const {
  double sum = 0;
  for (const Part& part : parts_) sum += part.volume;
  const auto& s = patches_.grid().spacing;
  return sum * s[0] * s[1] * s[2] / std::pow(double(FrontPatches::kSteps), 3);
}

double Skin::volume_bound() const {
  double sum = 0;
  for (const Part& part : parts_) sum += part.bound;
  const auto& s = patches_.grid().spacing;
  return sum * s[0] * s[1] * s[2] / std::pow(double(FrontPatches::kSteps), 3);
}

std::size_t Skin::memory_bytes() const {
  std::size_t bytes = position_.capacity() * sizeof(Position) + surface_.capacity() + normal_.capacity() * sizeof(NormalSum) +
                      there_.capacity() * sizeof(std::uint32_t) + parts_.capacity() * sizeof(Part);
  for (const Part& part : parts_) bytes += part.triangles.capacity() * sizeof(Triangle);
  return bytes;
}

}  // namespace intervale

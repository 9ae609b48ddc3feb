#include "common/front.h"

#include <cassert>
#include <limits>
#include <string>

namespace intervale {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::int32_t kSteps = 512;  // of a point's coordinate in one sample
constexpr int kFinest = 3;            // the slab of class 2 with h = 1
constexpr int kSlabShift = 30;

std::uint64_t key(Vertex v) { return std::uint64_t(id_of(v)); }

}  // namespace

Front::Front(const Grid& grid, const Base& base) : grid_(grid), domain_(grid.dims) {
  slabs_[0].stride = 8 + 19;
  slabs_[1].stride = 6 + 13;
  slabs_[2].stride = kMaxVertices + kMaxEdges;
  slabs_[kFinest].stride = kMaxVertices + kMaxEdges + 1 + kMaxVertices;
  const Diamond root(domain_.root());
  const std::uint32_t handle = obtain(root.centre);
  auto [h, p] = record(handle);
  const unsigned vertices = Domain::vertices(*root.row, h->tets), edges = Domain::edges(*root.row, h->tets);
  for (int v = 0; v < root.row->vertices; ++v) {
    h->sides |= std::uint32_t(base.side[v]) << (2 * v);
    if ((vertices >> v & 1) && base.side[v] == Side::inside) p[v] = add_vertex(root.vertex(v));
  }
  for (int e = 0; e < root.row->edges; ++e) {
    const auto [a, b] = edge_ends(e, root.row->belt);
    if (edges >> e & 1) p[root.row->vertices + e] = add_cuts(root.vertex(a), root.vertex(b), base.side[a], base.side[b], base.cuts[e].q);
  }
  h->received = h->tets;
  tet_count_ = count_tets(*h, *root.row);
}

std::optional<Front::Handle> Front::find(Vertex centre) const {
  const auto found = diamonds_.find(key(centre));
  if (found == diamonds_.end()) return {};
  const Header& h = header(found->second);
  if (h.split || h.received != h.tets || h.centre != centre) return {};
  if (h.straddles && domain_.is_idle(Diamond(centre))) return {};
  return Handle{found->second};
}

DiamondContext Front::context(Handle handle) const {
  const Header& h = header(std::uint32_t(handle));
  DiamondContext c;
  c.row = &diamond_type(h.type);
  const DiamondType& row = *c.row;
  c.vertices = h.straddles ? Domain::vertices(row, h.tets) : (1u << row.vertices) - 1;
  c.sides = h.sides;
  for (int v = 0; v < row.vertices && h.straddles; ++v) {
    if (!c.has(v)) c.sides &= ~(3u << (2 * v));
  }
  const std::uint32_t edges = h.straddles ? Domain::edges(row, h.tets) : (1u << row.edges) - 1;
  const std::uint32_t* const p = points(std::uint32_t(handle)) + row.vertices;
  const int shift = scale_of(h.centre);
  for (int e = 0; e < row.edges; ++e) {
    const auto [a, b] = edge_ends(e, row.belt);
    const Side from = side(h, a), to = side(h, b);
    if (from == to || !(edges >> e & 1)) continue;
    const auto place = [&, a = a](std::uint32_t point) {
      if (h.straddles) return place_on_edge(h, row, e, points_[point]);
      const EdgeStep step = row.edge_step[e];
      const Offset f = row.vertex[a];
      const std::int32_t u = step.axis == 0   ? h.centre.x + (f.x << shift)
                             : step.axis == 1 ? h.centre.y + (f.y << shift)
                                              : h.centre.z + (f.z << shift);
      const std::int32_t q = step.axis == 0 ? points_[point].x : step.axis == 1 ? points_[point].y : points_[point].z;
      const std::int32_t far = step.step < 0 ? u * kSteps - q : q - u * kSteps;
      return far >> (shift + ((step.step & 1) == 0 ? 1 : 0));
    };
    std::uint32_t point = p[e];
    if (alpha_cuts(from, to)) c.cut[e][0] = std::uint16_t(place(point++));
    if (beta_cuts(from, to)) c.cut[e][1] = std::uint16_t(place(point));
  }
  return c;
}

Cuts Front::split(Handle handle, Side centre_side, std::span<const std::uint8_t> cuts) {
  const Header h = header(std::uint32_t(handle));  // a copy: making the children moves records
  const Diamond d(h.centre);
  const DiamondType& row = *d.row;
  assert(int(cuts.size()) == context(handle).count_cuts(centre_side).all && "the caller counted");
  tet_count_ += count_halves(h, row, centre_side) - std::uint64_t(count_tets(h, row));

  // The new points, then the old ones, by local numbers.
  std::uint32_t vertex[kMaxVertices + 1], edge[kMaxEdges + kMaxVertices];
  auto [mine, p] = record(std::uint32_t(handle));
  std::copy_n(p, row.vertices, vertex);
  std::copy_n(p + row.vertices, row.edges, edge);
  vertex[kCentre] = centre_side == Side::inside ? add_vertex(d.centre) : kNone;
  const unsigned vertices = h.straddles ? Domain::vertices(row, h.tets) : (1u << row.vertices) - 1;
  const std::uint8_t* q = cuts.data();
  for (int v = 0; v < row.vertices; ++v) {
    edge[kSubdivision + v] = kNone;
    const int n = vertices >> v & 1 ? cut_count(centre_side, side(h, v)) : 0;
    if (n == 0) continue;
    edge[kSubdivision + v] = add_cuts(d.centre, d.vertex(v), centre_side, side(h, v), q);
    q += n;
  }
  const Cuts spine = cuts_of(h, row, 0, edge[0]);
  drop_points(edge[0], spine.count, is_border(d.vertex(0)) || is_border(d.vertex(1)));

  if (!d.has_children()) {
    mine->split = true;
    mine->sides |= std::uint32_t(centre_side) << (2 * kCentre);
    std::uint32_t* const added = p + row.vertices + row.edges;
    added[0] = vertex[kCentre];
    std::copy_n(edge + kSubdivision, row.vertices, added + 1);
    return spine;
  }
  if (h.straddles) {
    Retired& kept = retired_[key(h.centre)];
    kept.header = h;
    std::copy_n(p, row.vertices + row.edges, kept.points.data());
  }
  diamonds_.erase(key(h.centre));
  release(std::uint32_t(handle));
  const std::uint32_t sides = h.sides | std::uint32_t(centre_side) << (2 * kCentre);
  for (int k = 0; k < row.children; ++k) {
    const Duet& duet = row.child[k];
    unsigned handed = 0;
    bool exists[2];
    for (int i = 0; i < 2; ++i) {
      exists[i] = !h.straddles || ((h.tets >> duet.half[i].tet & 1) && half_exists(h, row, duet.half[i].tet, duet.half[i].end));
      if (exists[i]) handed |= 1u << duet.half[i].child_tet;
    }
    if (handed == 0) continue;
    const Record child = record(obtain(d.child(k)));
    Header* const c = child.header;
    std::uint32_t* const cp = child.points;
    std::uint32_t* const ce = cp + diamond_type(c->type).vertices;
    c->received = std::uint8_t(c->received | handed);
    const auto hand = [&](const auto& vertex_from, const auto& vertex_to, const auto& edge_from, const auto& edge_to) {
      for (std::size_t i = 0; i < vertex_from.size(); ++i) {
        const int from = vertex_from[i], to = vertex_to[i];
        cp[to] = vertex[from];
        c->sides = (c->sides & ~(3u << (2 * to))) | (sides >> (2 * from) & 3) << (2 * to);
      }
      for (std::size_t i = 0; i < edge_from.size(); ++i) ce[edge_to[i]] = edge[edge_from[i]];
    };
    if (exists[0] && exists[1]) {
      hand(duet.vertex_from, duet.vertex_to, duet.edge_from, duet.edge_to);
    } else {
      const Duet::Half& half = duet.half[exists[0] ? 0 : 1];
      hand(half.vertex_from, half.vertex_to, half.edge_from, half.edge_to);
    }
  }
  return spine;
}

bool Front::merge(Vertex centre, const Cuts& spine) {
  if (!domain_.contains(domain_.clamp(centre)) || (centre.x | centre.y | centre.z) == 0 || scale_of(centre) >= domain_.levels()) return false;
  const Diamond d(centre);
  const DiamondType& row = *d.row;
  std::uint32_t vertex[kMaxVertices + 1], edge[kMaxEdges + kMaxVertices];
  std::fill(std::begin(vertex), std::end(vertex), kNone);
  std::fill(std::begin(edge), std::end(edge), kNone);
  std::uint32_t sides = 0, handle = kNone;
  if (!d.has_children()) {
    const auto found = diamonds_.find(key(centre));
    if (found == diamonds_.end() || !header(found->second).split) return false;
    handle = found->second;
    auto [h, p] = record(handle);
    sides = h->sides;
    std::copy_n(p, row.vertices, vertex);
    std::copy_n(p + row.vertices, row.edges, edge);
    const std::uint32_t* const added = p + row.vertices + row.edges;
    vertex[kCentre] = added[0];
    std::copy_n(added + 1, row.vertices, edge + kSubdivision);
    h->split = false;
    h->sides &= ~(3u << (2 * kCentre));
  } else {
    if (diamonds_.contains(key(centre))) return false;  // not split
    Header probe;
    probe.centre = centre;
    probe.tets = std::uint8_t(domain_.tets(d));
    probe.straddles = !domain_.is_interior(d);
    // Which halves each child has from this diamond; all of those children must be there, unsplit.
    std::array<std::uint32_t, kMaxChildren> child;
    std::array<std::uint8_t, kMaxChildren> handed{};
    bool any = false;
    for (int k = 0; k < row.children; ++k) {
      for (const Duet::Half& half : row.child[k].half) {
        if ((probe.tets >> half.tet & 1) && half_exists(probe, row, half.tet, half.end)) handed[k] = std::uint8_t(handed[k] | 1u << half.child_tet);
      }
      child[k] = kNone;
      if (handed[k] == 0) continue;
      const auto found = diamonds_.find(key(d.child(k)));
      if (found == diamonds_.end()) return false;
      const Header& c = header(found->second);
      if (c.split || (c.received & handed[k]) != handed[k]) return false;
      child[k] = found->second;
      any = true;
    }
    if (!any) return false;
    if (probe.straddles) {
      // Where the clamped centre leaves the clamped spine, a tetrahedron can have lost both halves: its points are known from before.
      const auto kept = retired_.find(key(centre));
      if (kept == retired_.end()) return false;
      sides = kept->second.header.sides;
      std::copy_n(kept->second.points.data(), row.vertices, vertex);
      std::copy_n(kept->second.points.data() + row.vertices, row.edges, edge);
      retired_.erase(kept);
    }
    for (int k = 0; k < row.children; ++k) {
      if (child[k] == kNone) continue;
      auto [c, cp] = record(child[k]);
      const std::uint32_t* const ce = cp + diamond_type(c->type).vertices;
      for (const Duet::Half& half : row.child[k].half) {
        if (!(handed[k] >> half.child_tet & 1)) continue;
        for (int i = 0; i < 4; ++i) {
          const int from = half.vertex_from[i], to = half.vertex_to[i];
          vertex[from] = cp[to];
          sides = (sides & ~(3u << (2 * from))) | (c->sides >> (2 * to) & 3) << (2 * from);
        }
        for (int i = 0; i < 6; ++i) edge[half.edge_from[i]] = ce[half.edge_to[i]];
      }
      c->received = std::uint8_t(c->received & ~handed[k]);
      if (c->received == 0) {
        diamonds_.erase(key(c->centre));
        release(child[k]);
      }
    }
    handle = obtain(centre);
    auto [h, p] = record(handle);
    h->sides = sides & ~(3u << (2 * kCentre));
    h->received = h->tets;
    std::copy_n(vertex, row.vertices, p);
    std::copy_n(edge, row.edges, p + row.vertices);
  }
  // The points that splitting added go; the spine's come back.
  const Side centre_side = Side(sides >> (2 * kCentre) & 3);
  const bool border = is_border(centre);
  if (centre_side == Side::inside) drop_points(vertex[kCentre], 1, border);
  for (int v = 0; v < row.vertices; ++v) {
    if (edge[kSubdivision + v] == kNone) continue;
    drop_points(edge[kSubdivision + v], cut_count(centre_side, Side(sides >> (2 * v) & 3)), border || is_border(d.vertex(v)));
  }
  auto [h, p] = record(handle);
  p[row.vertices] = add_cuts(d.vertex(0), d.vertex(1), side(*h, 0), side(*h, 1), spine.q);
  tet_count_ += count_tets(*h, row) - std::uint64_t(count_halves(*h, row, centre_side));
  return true;
}

Mesh Front::mesh() const {
  Mesh mesh;
  mesh.tets.reserve(tet_count_);
  std::vector<std::uint32_t> number(points_.size(), kNone);
  for_each_tet([&](std::array<std::uint32_t, 4> tet) {
    for (std::uint32_t& point : tet) {
      std::uint32_t& n = number[point];
      if (n == kNone) {
        n = std::uint32_t(mesh.points.size());
        const Point& q = points_[point];
        mesh.points.push_back({grid_.origin[0] + grid_.spacing[0] * q.x / kSteps, grid_.origin[1] + grid_.spacing[1] * q.y / kSteps,
                               grid_.origin[2] + grid_.spacing[2] * q.z / kSteps});
        mesh.surface.push_back(q.surface);
      }
      point = n;
    }
    mesh.tets.push_back(tet);
  });
  return mesh;
}

std::size_t Front::memory_bytes() const {
  std::size_t n = points_.capacity() * sizeof(Point) + diamonds_.bucket_count() * 17 + border_points_.bucket_count() * (sizeof(PointKey) + 5) +
                  retired_.bucket_count() * (sizeof(Retired) + 9);
  for (const Slab& s : slabs_) n += s.headers.capacity() * sizeof(Header) + s.points.capacity() * 4 + s.unused.capacity() * 4;
  for (const auto& u : unused_points_) n += u.capacity() * 4;
  return n;
}

Front::Record Front::record(std::uint32_t handle) {
  Slab& slab = slabs_[handle >> kSlabShift];
  const std::size_t i = handle & ((1u << kSlabShift) - 1);
  return {&slab.headers[i], slab.points.data() + i * slab.stride};
}

const Front::Header& Front::header(std::uint32_t handle) const { return slabs_[handle >> kSlabShift].headers[handle & ((1u << kSlabShift) - 1)]; }

const std::uint32_t* Front::points(std::uint32_t handle) const {
  const Slab& slab = slabs_[handle >> kSlabShift];
  return slab.points.data() + std::size_t(handle & ((1u << kSlabShift) - 1)) * slab.stride;
}

std::uint32_t Front::obtain(Vertex centre) {
  const auto [place, is_new] = diamonds_.try_emplace(key(centre), 0);
  if (!is_new) return place->second;
  const Diamond d(centre);
  const unsigned which = d.has_children() ? d.row->cls : kFinest;
  Slab& slab = slabs_[which];
  std::size_t i = slab.headers.size();
  if (slab.unused.empty()) {
    slab.headers.emplace_back();
    slab.points.resize(slab.points.size() + slab.stride, kNone);
  } else {
    i = slab.unused.back();
    slab.unused.pop_back();
    std::fill_n(slab.points.data() + i * slab.stride, slab.stride, kNone);
  }
  Header& h = slab.headers[i];
  h = Header{};
  h.centre = centre;
  h.type = std::uint8_t(d.type);
  h.straddles = !domain_.is_interior(d);
  h.tets = std::uint8_t(domain_.tets(d));
  place->second = which << kSlabShift | std::uint32_t(i);
  return place->second;
}

void Front::release(std::uint32_t handle) {
  Slab& slab = slabs_[handle >> kSlabShift];
  slab.headers[handle & ((1u << kSlabShift) - 1)].received = 0;
  slab.unused.push_back(handle & ((1u << kSlabShift) - 1));
}

TetShape Front::shape(const Header& h, const DiamondType& row, int tet) const {
  if (!h.straddles) return row.shape[tet];
  const auto local = row.tet(tet);
  return shape_of(domain_.positions(Diamond(h.centre), local), local, row.belt);
}

TetShape Front::half_shape(const Header& h, const DiamondType& row, int tet, int end) const {
  if (!h.straddles) return row.half_shape[tet][end];
  auto local = row.tet(tet);
  local[1 - end] = kCentre;
  return shape_of(domain_.positions(Diamond(h.centre), local), local, row.belt);
}

bool Front::half_exists(const Header& h, const DiamondType& row, int tet, int end) const {
  if (!h.straddles) return true;
  auto local = row.tet(tet);
  local[1 - end] = kCentre;
  return Domain::exists(domain_.positions(Diamond(h.centre), local));
}

// On an axis that clamps, at or beyond the last sample. Only edges with such an end can share their place with another edge.
bool Front::is_border(Vertex v) const {
  const std::int32_t n = 1 << domain_.levels();
  const Vertex last = domain_.last();
  return (last.x < n && v.x >= last.x) || (last.y < n && v.y >= last.y) || (last.z < n && v.z >= last.z);
}

std::uint32_t Front::add_points(const Point* points, int count, bool border) {
  if (border) {
    const auto [place, is_new] = border_points_.try_emplace(PointKey{points[0], points[count - 1]}, std::uint32_t(points_.size()));
    if (is_new) points_.insert(points_.end(), points, points + count);
    return place->second;
  }
  auto& unused = unused_points_[count - 1];
  if (unused.empty()) {
    points_.insert(points_.end(), points, points + count);
    return std::uint32_t(points_.size() - count);
  }
  const std::uint32_t first = unused.back();
  unused.pop_back();
  std::copy_n(points, count, points_.begin() + first);
  return first;
}

std::uint32_t Front::add_vertex(Vertex v) {
  const Vertex c = domain_.clamp(v);
  const Point p{c.x * kSteps, c.y * kSteps, c.z * kSteps, Surface::inside};
  return add_points(&p, 1, is_border(v));
}

std::uint32_t Front::add_cuts(Vertex a, Vertex b, Side from, Side to, const std::uint8_t* q) {
  Point points[2];
  int n = 0;
  const Vertex ca = domain_.clamp(a), cb = domain_.clamp(b);
  const auto cut = [&](Surface surface) {
    const std::int32_t t = 2 * q[n] + 1;
    points[n++] = {ca.x * kSteps + (cb.x - ca.x) * t, ca.y * kSteps + (cb.y - ca.y) * t, ca.z * kSteps + (cb.z - ca.z) * t, surface};
  };
  if (alpha_cuts(from, to)) cut(Surface::alpha);
  if (beta_cuts(from, to)) cut(Surface::beta);
  return n == 0 ? kNone : add_points(points, n, is_border(a) || is_border(b));
}

// Points of the border stay: they are few, and who else uses them is not known here.
void Front::drop_points(std::uint32_t first, int count, bool border) {
  if (count > 0 && !border) unused_points_[count - 1].push_back(first);
}

Cuts Front::cuts_of(const Header& h, const DiamondType& row, int edge, std::uint32_t first) const {
  const auto [a, b] = edge_ends(edge, row.belt);
  Cuts cuts;
  cuts.count = std::uint8_t(cut_count(side(h, a), side(h, b)));
  if (first == kNone) cuts.count = 0;
  for (int i = 0; i < cuts.count; ++i) cuts.q[i] = std::uint8_t(place_on_edge(h, row, edge, points_[first + i]) / 2);
  return cuts;
}

std::int32_t Front::place_on_edge(const Header& h, const DiamondType& row, int edge, const Point& p) const {
  const auto [a, b] = edge_ends(edge, row.belt);
  const Diamond d(h.centre);
  const Vertex u = domain_.clamp(d.vertex(a)), v = domain_.clamp(d.vertex(b));
  return u.x != v.x ? (p.x - u.x * kSteps) / (v.x - u.x) : u.y != v.y ? (p.y - u.y * kSteps) / (v.y - u.y) : (p.z - u.z * kSteps) / (v.z - u.z);
}

unsigned Front::count_tets(const Header& h, const DiamondType& row) const {
  const TetCases& cases = tet_cases();
  unsigned n = 0;
  for (int t = 0; t < row.tets; ++t) {
    if (!(h.received >> t & 1)) continue;
    const TetShape s = shape(h, row, t);
    n += cases.count(s.order, shape_sides(s, h.sides));
  }
  return n;
}

unsigned Front::count_halves(const Header& h, const DiamondType& row, Side centre) const {
  const TetCases& cases = tet_cases();
  const std::uint32_t sides = h.sides | std::uint32_t(centre) << (2 * kCentre);
  unsigned n = 0;
  for (int t = 0; t < row.tets; ++t) {
    for (int end = 0; end < 2 && (h.tets >> t & 1); ++end) {
      if (!half_exists(h, row, t, end)) continue;
      const TetShape s = half_shape(h, row, t, end);
      n += cases.count(s.order, shape_sides(s, sides));
    }
  }
  return n;
}

}  // namespace intervale

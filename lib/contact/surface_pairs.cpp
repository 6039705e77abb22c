#include "contact/surface_pairs.h"

#include "base/vector_at.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe {

namespace {

constexpr double crease = 0.5;      ///< cosine of the angle from where on an edge is sharp
constexpr double was_inside = 0.02; ///< of an edge
constexpr double tie = 1e-12;       ///< of an edge: distances that are one

bool is_triangle(const Facet& f) {
  return corner_count(f) == 3;
}

/// The triangle's point nearest to p.
std::array<double, 3> nearest_weights(const Vec3& p, const Facet& f, std::span<const Vec3> at) {
  PlacedInstrument point;
  point.a = p;
  return nearest_points(point, CorePart::first_end, {at[f[0]], at[f[1]], at[f[2]]}, 3)->weights;
}

Vec3 point_of(const Facet& f, const std::array<double, 3>& weights, std::span<const Vec3> at) {
  return weights[0] * at[f[0]] + weights[1] * at[f[1]] + weights[2] * at[f[2]];
}

Box3 grown(Box3 box, double by) {
  box.min -= {by, by, by};
  box.max += {by, by, by};
  return box;
}

bool holds(const Box3& box, const Vec3& p) {
  return near(Box3{p, p}, box);
}

/// Whether the triangle's own box, grown by `reach`, holds p.
bool may_reach(const Vec3& p, const Facet& f, std::span<const Vec3> at, double reach) {
  for (int a = 0; a < 3; ++a)
    if (std::min({at[f[0]][a], at[f[1]][a], at[f[2]][a]}) > p[a] + reach ||
        std::max({at[f[0]][a], at[f[1]][a], at[f[2]][a]}) < p[a] - reach)
      return false;
  return true;
}

} // namespace

SurfacePairs::SurfacePairs(const Model& model, std::vector<SurfaceMeeting> meetings)
    : model_(model), meetings_(std::move(meetings)), facets_(model) {
  const auto meets = [&](std::uint32_t node) {
    return std::ranges::any_of(meetings_, [&](const SurfaceMeeting& m) {
      return m.one.holds(node) || m.other.holds(node);
    });
  };
  double sum = 0;
  std::size_t count = 0;
  for (const Facet& f : facets_.facets()) {
    if (!is_triangle(f) || !meets(f[0]))
      continue;
    surface_.insert(surface_.end(), f.begin(), f.end());
    for (std::size_t c = 0; c < 3; ++c)
      sum += norm(model.nodes[f[c]].position - model.nodes[f[(c + 1) % 3]].position);
    count += 3;
  }
  std::ranges::sort(surface_);
  surface_.erase(std::ranges::unique(surface_).begin(), surface_.end());
  edge_ = count > 0 ? sum / static_cast<double>(count) : 0;
  for (const Node& node : model.nodes)
    rest_.push_back(node.position);
}

std::vector<Vec3> SurfacePairs::places_of(std::span<const double> displacement) const {
  std::vector<Vec3> at(rest_);
  for (std::size_t i = 0; 3 * i < displacement.size(); ++i)
    at[i] += vector_at(displacement, i);
  return at;
}

bool SurfacePairs::may_touch(std::span<const double> places, std::span<const double> velocity,
                             double h) const {
  struct Part {
    Box3 box;
    double fastest = 0;
  };
  const auto part_of = [&](const NodeRange& range) {
    Part part;
    for (auto i = std::ranges::lower_bound(surface_, range.first);
         i != surface_.end() && *i < range.end; ++i) {
      part.box.add(vector_at(places, *i));
      const Vec3 v = vector_at(velocity, *i);
      part.fastest = std::max(part.fastest, dot(v, v));
    }
    return part;
  };
  return std::ranges::any_of(meetings_, [&](const SurfaceMeeting& m) {
    if (m.itself())
      return true;
    const Part a = part_of(m.one), b = part_of(m.other);
    return near(a.box, b.box, edge_ + 2 * h * (std::sqrt(a.fastest) + std::sqrt(b.fastest)));
  });
}

Vec3 SurfacePairs::face_normal(const Facet& f, std::span<const Vec3> at) const {
  return cross(at[f[1]] - at[f[0]], at[f[2]] - at[f[0]]);
}

/// Mean by areas, of unit length or 0.
Vec3 SurfacePairs::node_normal(std::uint32_t node, std::span<const Vec3> at) const {
  Vec3 sum;
  for (const std::uint32_t number : facets_.at_node(node))
    if (const Facet& f = facets_.facets()[number]; is_triangle(f))
      sum += face_normal(f, at);
  const double size = norm(sum);
  return size > 0 ? sum / size : Vec3{};
}

Vec3 SurfacePairs::normal_at(const Facet& f, const std::array<double, 3>& weights,
                             std::span<const Vec3> at) const {
  const Vec3 own = face_normal(f, at);
  const double area = norm(own);
  Vec3 sum;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(weights[c] > 0))
      continue;
    Vec3 corner;
    for (const std::uint32_t number : facets_.at_node(f[c]))
      if (const Facet& g = facets_.facets()[number]; is_triangle(g)) {
        const Vec3 n = face_normal(g, at);
        if (dot(n, own) > crease * norm(n) * area)
          corner += n;
      }
    if (const double size = norm(corner); size > 0)
      sum += weights[c] / size * corner;
  }
  const double size = norm(sum);
  return size > 0 ? sum / size : area > 0 ? own / area : Vec3{};
}

/// Whether a triangle is one of those around a node, or shares a node with them.
bool SurfacePairs::around(std::uint32_t node, const Facet& f) const {
  return std::ranges::any_of(f, [&](std::uint32_t corner) {
    return std::ranges::any_of(facets_.at_node(node), [&](std::uint32_t number) {
      return std::ranges::find(facets_.facets()[number], corner) != facets_.facets()[number].end();
    });
  });
}

void SurfacePairs::find_side(std::uint32_t meeting, bool first, std::span<const Vec3> at,
                             std::span<const Vec3> was, double margin,
                             std::vector<SurfacePair>& found) const {
  const SurfaceMeeting& m = meetings_[meeting];
  const NodeRange &nodes = first ? m.one : m.other, &wall = first ? m.other : m.one;
  const bool itself = m.itself();
  Box3 box; // of the wall
  for (auto i = std::ranges::lower_bound(surface_, wall.first);
       i != surface_.end() && *i < wall.end; ++i)
    box.add(at[*i]);
  box = grown(box, edge_);
  for (auto i = std::ranges::lower_bound(surface_, nodes.first);
       i != surface_.end() && *i < nodes.end; ++i) {
    const std::uint32_t node = *i;
    const Vec3& p = at[node];
    if (!holds(box, p))
      continue;
    const Vec3 own = node_normal(node, at);
    std::optional<SurfacePair> best;
    double least = edge_, facing = 0;
    facets_.visit_near(grown(Box3{p, p}, edge_), [&](std::uint32_t number) {
      const Facet& f = facets_.facets()[number];
      if (!wall.holds(f[0]) || !is_triangle(f) || !may_reach(p, f, at, least))
        return;
      const double against = dot(face_normal(f, at), own);
      if (!(against < 0) || (itself && around(node, f)))
        return;
      const std::array<double, 3> weights = nearest_weights(p, f, at);
      const double distance = norm(p - point_of(f, weights, at));
      if (!(distance < least - tie * edge_) &&
          !(distance <= least + tie * edge_ && best && against < facing))
        return;
      SurfacePair pair{meeting, node, first, f, weights, normal_at(f, weights, at), 0};
      if (itself) {
        const Vec3 before = was[node] - point_of(f, weights, was);
        if (dot(normal_at(f, weights, was), before) < -was_inside * edge_)
          return;
      }
      best = pair;
      least = std::min(least, distance);
      facing = against;
    });
    if (!best)
      continue;
    const Vec3 off = p - point_of(best->piece, best->weights, at);
    best->gap = dot(best->normal, off);
    if (!(best->gap < margin))
      continue;
    // Beside an edge it is not behind the triangle.
    if (best->gap < 0 && !(norm(off - best->gap * best->normal) <= -best->gap + tie * edge_))
      continue;
    found.push_back(*best);
  }
}

std::vector<SurfacePair> SurfacePairs::find(std::span<const double> displacement,
                                            std::span<const double> was, double margin) {
  facets_.set_shape(model_, displacement);
  const std::vector<Vec3> at = places_of(displacement), before = places_of(was);
  std::vector<SurfacePair> found;
  for (std::uint32_t k = 0; k < meetings_.size(); ++k) {
    find_side(k, true, at, before, margin, found);
    if (!meetings_[k].itself())
      find_side(k, false, at, before, margin, found);
  }
  return found;
}

void SurfacePairs::follow(SurfacePair& pair, std::span<const Vec3> at) const {
  const Vec3& p = at[pair.node];
  const SurfaceMeeting& m = meetings_[pair.meeting];
  const Vec3 own = node_normal(pair.node, at);
  double least = HUGE_VAL;
  Facet piece = pair.piece;
  std::array<double, 3> weights{};
  const auto look = [&](const Facet& f) {
    const std::array<double, 3> some = nearest_weights(p, f, at);
    const double distance = norm(p - point_of(f, some, at));
    if (!(distance < least - (f == pair.piece ? 0 : tie * edge_)))
      return;
    least = distance;
    piece = f;
    weights = some;
  };
  look(pair.piece);
  for (const std::uint32_t corner : pair.piece)
    for (const std::uint32_t number : facets_.at_node(corner)) {
      const Facet& f = facets_.facets()[number];
      if (f != pair.piece && is_triangle(f) && dot(face_normal(f, at), own) < 0 &&
          !(m.itself() && around(pair.node, f)))
        look(f);
    }
  pair.piece = piece;
  pair.weights = weights;
  pair.normal = normal_at(piece, weights, at);
  pair.gap = dot(pair.normal, p - point_of(piece, weights, at));
}

} // namespace gewebe

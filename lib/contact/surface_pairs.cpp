#include "contact/surface_pairs.h"

#include "base/vector_at.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace gewebe {

namespace {

constexpr double crease = 0.5;      ///< cosine of the angle from where on an edge is sharp
constexpr double was_inside = 0.02; ///< of an edge
constexpr std::uint32_t no_edge = UINT32_MAX;
constexpr double on_it = 1e-3; ///< of an edge: nearer, nothing is beside
constexpr double tie = 1e-12;  ///< of an edge: distances that are one

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

SurfacePair node_pair(std::uint32_t meeting, bool first, int side, std::uint32_t node,
                      const Facet& f, const std::array<double, 3>& w) {
  return {meeting, first, false, side, {node, f[0], f[1], f[2]}, {1, -w[0], -w[1], -w[2]},
          {},      0,     false, false};
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
    : meetings_(std::move(meetings)), facets_(model), in_element_(model.nodes.size()) {
  const auto meets = [&](std::uint32_t node) {
    return std::ranges::any_of(meetings_, [&](const SurfaceMeeting& m) {
      return m.one.holds(node) || m.other.holds(node);
    });
  };
  for (const Tetrahedron& t : model.tetrahedra)
    for (const std::uint32_t corner : t)
      in_element_[corner] = 1;
  for (const Node& node : model.nodes)
    rest_.push_back(node.position);
  double sum = 0;
  std::vector<Vec3> middles;
  for (std::uint32_t number = 0; number < facets_.facets().size(); ++number) {
    const Facet& f = facets_.facets()[number];
    if (!is_triangle(f) || !meets(f[0]))
      continue;
    touching_.push_back(number);
    middles.push_back(rest_[f[0]] + rest_[f[1]] + rest_[f[2]]);
    surface_.insert(surface_.end(), f.begin(), f.end());
    for (std::size_t c = 0; c < 3; ++c)
      sum += norm(rest_[f[c]] - rest_[f[(c + 1) % 3]]);
  }
  std::ranges::sort(surface_);
  surface_.erase(std::ranges::unique(surface_).begin(), surface_.end());
  edge_ = touching_.empty() ? 0 : sum / (3.0 * static_cast<double>(touching_.size()));
  looks_.resize(meetings_.size());
  tree_ = BoxTree(middles);
  add_edges();
}

void SurfacePairs::add_edges() {
  own_edges_.resize(touching_.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (std::size_t k = 0; k < touching_.size(); ++k) {
    const Facet& f = facets_.facets()[touching_[k]];
    for (std::size_t c = 0; c < 3; ++c) {
      own_edges_[k][c] = no_edge;
      const auto ends = std::minmax(f[c], f[(c + 1) % 3]);
      const auto number = static_cast<std::uint32_t>(edges_.size());
      const auto [at, fresh] = known.try_emplace({ends.first, ends.second}, number);
      if (!fresh) {
        edges_[at->second].facets[1] = touching_[k];
        continue;
      }
      own_edges_[k][c] = number;
      edges_.push_back({ends.first, ends.second, {touching_[k], touching_[k]}});
    }
  }
}

std::vector<Vec3> SurfacePairs::places_of(std::span<const double> displacement) const {
  std::vector<Vec3> at(rest_);
  for (std::size_t i = 0; 3 * i < displacement.size(); ++i)
    at[i] += vector_at(displacement, i);
  return at;
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

void SurfacePairs::fit_tree(std::span<const Vec3> at, std::span<const Vec3> more) {
  std::vector<Box3> boxes(touching_.size());
  for (std::size_t k = 0; k < touching_.size(); ++k)
    for (const std::uint32_t corner : facets_.facets()[touching_[k]]) {
      boxes[k].add(at[corner]);
      if (!more.empty())
        boxes[k].add(more[corner]);
    }
  tree_.fit(boxes);
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
    Vec3 off;
    double least = edge_, facing = 0;
    tree_.visit_near(grown(Box3{p, p}, edge_), [&](std::uint32_t number) {
      const Facet& f = facets_.facets()[touching_[number]];
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
      if (itself) {
        const Vec3 before = was[node] - point_of(f, weights, was);
        if (dot(normal_at(f, weights, was), before) < -was_inside * edge_)
          return;
      }
      best = node_pair(meeting, first, 1, node, f, weights);
      best->normal = normal_at(f, weights, at);
      off = p - point_of(f, weights, at);
      least = std::min(least, distance);
      facing = against;
    });
    if (!best)
      continue;
    best->gap = dot(best->normal, off);
    if (!(best->gap < margin))
      continue;
    if (is_beside(*best, off, at))
      continue;
    found.push_back(*best);
  }
}

std::vector<SurfacePair> SurfacePairs::find(std::span<const double> displacement,
                                            std::span<const double> was, double margin) {
  const std::vector<Vec3> at = places_of(displacement), before = places_of(was);
  fit_tree(at, {});
  std::vector<SurfacePair> found;
  for (std::uint32_t k = 0; k < meetings_.size(); ++k) {
    find_side(k, true, at, before, margin, found);
    if (!meetings_[k].itself())
      find_side(k, false, at, before, margin, found);
  }
  return found;
}

void SurfacePairs::follow(SurfacePair& pair, std::span<const Vec3> at) const {
  if (pair.edges)
    follow_edges(pair, at);
  else
    follow_node(pair, at);
}

void SurfacePairs::follow_node(SurfacePair& pair, std::span<const Vec3> at) const {
  const std::uint32_t node = pair.nodes[0];
  const Vec3& p = at[node];
  const SurfaceMeeting& m = meetings_[pair.meeting];
  const Vec3 own = node_normal(node, at);
  const Facet before{pair.nodes[1], pair.nodes[2], pair.nodes[3]};
  double least = HUGE_VAL;
  Facet piece = before;
  std::array<double, 3> weights{};
  const auto look = [&](const Facet& f) {
    const std::array<double, 3> some = nearest_weights(p, f, at);
    const double distance = norm(p - point_of(f, some, at));
    if (!(distance < least - (f == before ? 0 : tie * edge_)))
      return;
    least = distance;
    piece = f;
    weights = some;
  };
  look(before);
  if (!pair.more)
    for (const std::uint32_t corner : before)
      for (const std::uint32_t number : facets_.at_node(corner)) {
        const Facet& f = facets_.facets()[number];
        if (f != before && is_triangle(f) && dot(face_normal(f, at), own) < 0 &&
            !(m.itself() && around(node, f)))
          look(f);
      }
  const bool more = pair.more;
  pair = node_pair(pair.meeting, pair.first_side, pair.side, node, piece, weights);
  pair.more = more;
  if (more) {
    const Vec3 across = face_normal(piece, at);
    pair.normal = pair.side * (across / norm(across));
  } else {
    pair.normal = pair.side * normal_at(piece, weights, at);
  }
  const Vec3 off = p - point_of(piece, weights, at);
  pair.gap = dot(pair.normal, off);
  pair.apart = is_beside(pair, off, at);
}

bool SurfacePairs::is_beside(const SurfacePair& pair, const Vec3& off,
                             std::span<const Vec3> at) const {
  if (!(pair.gap < 0) || norm(off) <= on_it * edge_)
    return false;
  if (!(norm(off - pair.gap * pair.normal) <= -pair.gap + tie * edge_))
    return true;
  std::uint32_t corner = 0;
  int count = 0;
  const auto is_on = [&](const Facet& f) {
    for (std::size_t c = 1; c < 4; ++c)
      if (pair.share[c] != 0 && std::ranges::find(f, pair.nodes[c]) == f.end())
        return false;
    return true;
  };
  for (std::size_t c = 1; c < 4; ++c)
    if (pair.share[c] != 0) {
      corner = pair.nodes[c];
      ++count;
    }
  if (count == 3)
    return false;
  Vec3 sum; // which side of an edge or a corner is outside
  for (const std::uint32_t number : facets_.at_node(corner))
    if (const Facet& f = facets_.facets()[number]; is_triangle(f) && is_on(f)) {
      const Vec3 n = face_normal(f, at);
      if (const double size = norm(n); size > 0)
        sum += n / size;
    }
  return pair.side * dot(off, sum) >= 0;
}

} // namespace gewebe

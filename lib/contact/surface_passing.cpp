// What surfaces have passed of each other within a step: nodes and triangles, edges and edges.

#include "contact/surface_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace gewebe {

namespace {

constexpr double edge_of_piece = 1e-6; ///< of its size: so far beside it is inside yet
constexpr double beyond_end = 0.05;    ///< of an edge: so far beyond its ends a pair that met stays
constexpr double parallel = 1e-6;      ///< square of the sine between edges that cross nowhere
constexpr double edge_depth = 10;      ///< of the depth of nodes
constexpr double band = 3; ///< of the depth: so far behind it may have come from outside

/// Two points of a way, and between.
struct Way {
  Vec3 from, to;
  Vec3 at(double t) const { return from + t * (to - from); }
};

/// When the volume that a, b and c span on their straight ways vanishes, ascending, in [0, 1].
std::vector<double> flat_times(const Way& a, const Way& b, const Way& c) {
  const Vec3 a1 = a.to - a.from, b1 = b.to - b.from, c1 = c.to - c.from;
  const Vec3 bc = cross(b.from, c.from), mixed = cross(b1, c.from) + cross(b.from, c1),
             last = cross(b1, c1);
  const double k0 = dot(a.from, bc), k1 = dot(a1, bc) + dot(a.from, mixed),
               k2 = dot(a1, mixed) + dot(a.from, last), k3 = dot(a1, last);
  const auto value = [&](double t) { return k0 + t * (k1 + t * (k2 + t * k3)); };
  std::array<double, 4> ends{0, 1, 1, 1};
  std::size_t count = 1;
  // Where its slope k1 + 2 k2 t + 3 k3 t² vanishes.
  const double root = k2 * k2 - 3 * k3 * k1;
  if (root >= 0) {
    const double q = -(k2 + std::copysign(std::sqrt(root), k2));
    for (const double t : {q / (3 * k3), k1 / q})
      if (t > 0 && t < 1)
        ends[count++] = t;
  }
  std::sort(ends.begin() + 1, ends.begin() + static_cast<std::ptrdiff_t>(count));
  ends[count++] = 1;
  std::vector<double> times;
  for (std::size_t k = 0; k + 1 < count; ++k) {
    double low = ends[k], high = ends[k + 1];
    const bool up = value(high) > 0;
    if ((value(low) > 0) == up)
      continue;
    for (int n = 0; n < 60; ++n) {
      const double middle = low + (high - low) / 2;
      ((value(middle) > 0) == up ? high : low) = middle;
    }
    times.push_back(high);
  }
  return times;
}

/// The first time of an odd number of times that two pieces met, else none.
template <class Inside>
std::optional<double> first_passing(const std::vector<double>& times, Inside&& inside) {
  std::optional<double> first;
  bool odd = false;
  for (const double t : times)
    if (inside(t)) {
      first = first ? first : t;
      odd = !odd;
    }
  return odd ? first : std::nullopt;
}

/// Where two lines are nearest, as parts of their ways from a to b and from c to d.
std::optional<std::array<double, 2>> nearest_parts(const Vec3& a, const Vec3& b, const Vec3& c,
                                                   const Vec3& d) {
  const Vec3 one = b - a, two = d - c, between = a - c;
  const double aa = dot(one, one), ee = dot(two, two), ab = dot(one, two), ar = dot(one, between),
               er = dot(two, between), square = aa * ee - ab * ab;
  if (!(square > parallel * aa * ee))
    return std::nullopt;
  return std::array{(ab * er - ar * ee) / square, (aa * er - ab * ar) / square};
}

bool within(const std::array<double, 2>& parts, double tolerance) {
  return std::ranges::all_of(
      parts, [&](double part) { return part >= -tolerance && part <= 1 + tolerance; });
}

std::array<double, 4> shares(const std::array<double, 2>& parts) {
  return {1 - parts[0], parts[0], parts[1] - 1, -parts[1]};
}

} // namespace

Vec3 SurfacePairs::edge_normal(const Edge& e, std::span<const Vec3> at) const {
  Vec3 sum;
  for (const std::uint32_t number : e.facets) {
    const Vec3 n = face_normal(facets_.facets()[number], at);
    if (const double size = norm(n); size > 0)
      sum += n / size;
  }
  return sum;
}

void SurfacePairs::nodes_passed(std::uint32_t meeting, bool first, std::span<const Vec3> at,
                                std::span<const Vec3> was, double depth,
                                std::vector<SurfacePair>& found) const {
  const SurfaceMeeting& m = meetings_[meeting];
  const NodeRange &nodes = first ? m.one : m.other, &wall = first ? m.other : m.one;
  for (auto i = std::ranges::lower_bound(surface_, nodes.first);
       i != surface_.end() && *i < nodes.end; ++i) {
    const std::uint32_t node = *i;
    const Way p{was[node], at[node]};
    Box3 box;
    box.add(p.from);
    box.add(p.to);
    std::array<std::optional<std::pair<double, SurfacePair>>, 2> earliest; // by side
    tree_.visit_near(box, [&](std::uint32_t number) {
      const Facet& f = facets_.facets()[touching_[number]];
      if (!wall.holds(f[0]))
        return;
      const std::array<Way, 3> corner{Way{was[f[0]], at[f[0]]}, Way{was[f[1]], at[f[1]]},
                                      Way{was[f[2]], at[f[2]]}};
      const auto from_first = [&](const Way& w) {
        return Way{w.from - corner[0].from, w.to - corner[0].to};
      };
      const Way to_node = from_first(p), one = from_first(corner[1]), two = from_first(corner[2]);
      const int side = dot(to_node.from, cross(one.from, two.from)) < 0 ? -1 : 1;
      if (side < 0 && !(m.itself() && is_net(node) && is_net(f[0])))
        return;
      const Vec3 across = cross(one.to, two.to);
      const double area = norm(across), gap = side * dot(to_node.to, across) / area;
      if (!(gap < (side > 0 ? -depth : 0)) || (m.itself() && around(node, f)))
        return;
      std::array<double, 3> weights{};
      const auto met = first_passing(flat_times(to_node, one, two), [&](double t) {
        const Vec3 a = corner[0].at(t), u = corner[1].at(t) - a, v = corner[2].at(t) - a,
                   w = p.at(t) - a, n = cross(u, v);
        const double square = dot(n, n), second = dot(cross(w, v), n) / square,
                     third = dot(cross(u, w), n) / square;
        if (!(second >= -edge_of_piece && third >= -edge_of_piece &&
              second + third <= 1 + edge_of_piece))
          return false;
        weights = {std::max(0.0, 1 - second - third), std::max(0.0, second), std::max(0.0, third)};
        return true;
      });
      auto& best = earliest[side > 0 ? 0 : 1];
      if (!met || (best && best->first <= *met))
        return;
      best = {*met,
              {meeting,
               first,
               false,
               side,
               {node, f[0], f[1], f[2]},
               {1, -weights[0], -weights[1], -weights[2]},
               side / area * across,
               gap,
               false,
               false}};
    });
    for (const auto& best : earliest)
      if (best)
        found.push_back(best->second);
  }
}

void SurfacePairs::edges_passed(std::uint32_t meeting, std::span<const Vec3> at,
                                std::span<const Vec3> was, double depth,
                                std::vector<SurfacePair>& found) const {
  const SurfaceMeeting& m = meetings_[meeting];
  for (std::uint32_t k = 0; k < edges_.size(); ++k) {
    const Edge& e = edges_[k];
    if (!m.one.holds(e.a))
      continue;
    const Way a{was[e.a], at[e.a]}, b{was[e.b], at[e.b]};
    Box3 box;
    for (const Way& w : {a, b}) {
      box.add(w.from);
      box.add(w.to);
    }
    const auto look = [&](std::uint32_t other) {
      const Edge& g = edges_[other];
      if (!m.other.holds(g.a) || (m.itself() && other <= k))
        return;
      const Way c{was[g.a], at[g.a]}, d{was[g.b], at[g.b]};
      const auto off = [](const Way& from, const Way& to) {
        return Way{to.from - from.from, to.to - from.to};
      };
      const Way one = off(a, b), two = off(c, d), between = off(c, a);
      const Vec3 across = cross(one.from, two.from), then = cross(one.to, two.to);
      const double before = dot(between.from, across);
      int side = before < 0 ? -1 : 1;
      // Outside of both: where the second one's triangles face the first one's.
      const double out = dot(across, edge_normal(g, was)), in = dot(across, edge_normal(e, was));
      const bool outside =
          out * in < 0 && (side * out > 0 || std::abs(before) <= band * depth * norm(across));
      if (outside)
        side = out < 0 ? -1 : 1;
      else if (!(m.itself() && is_net(e.a) && is_net(g.a)))
        return;
      const double size = norm(then), gap = side * dot(between.to, then) / size;
      if (!(gap < (outside ? -depth : 0)))
        return;
      if (m.itself() && std::ranges::any_of(std::array{e.a, e.b}, [&](std::uint32_t end) {
            return std::ranges::any_of(facets_.at_node(end), [&](std::uint32_t number) {
              return std::ranges::any_of(facets_.facets()[number], [&](std::uint32_t corner) {
                return corner == g.a || corner == g.b;
              });
            });
          }))
        return;
      std::array<double, 2> parts{};
      const auto cross_at = [&](double t) {
        const auto there = nearest_parts(a.at(t), b.at(t), c.at(t), d.at(t));
        if (!there || !within(*there, edge_of_piece))
          return false;
        parts = *there;
        return true;
      };
      const auto met = first_passing(flat_times(between, one, two), cross_at);
      // One that was behind already, by less than counts.
      if (!met && !(outside && side * before < 0 && cross_at(1)))
        return;
      found.push_back({meeting,
                       true,
                       true,
                       side,
                       {e.a, e.b, g.a, g.b},
                       shares(parts),
                       side / size * then,
                       gap,
                       false,
                       false});
    };
    tree_.visit_near(box, [&](std::uint32_t number) {
      for (const std::uint32_t other : own_edges_[number])
        if (other != UINT32_MAX)
          look(other);
    });
  }
}

std::vector<SurfacePair> SurfacePairs::find_passed(std::span<const double> displacement,
                                                   std::span<const double> was, double depth) {
  const std::vector<Vec3> at = places_of(displacement), before = places_of(was);
  fit_tree(at, before);
  std::vector<SurfacePair> found;
  for (std::uint32_t k = 0; k < meetings_.size(); ++k) {
    nodes_passed(k, true, at, before, depth, found);
    if (!meetings_[k].itself())
      nodes_passed(k, false, at, before, depth, found);
  }
  if (!found.empty()) // most edges pass with their nodes
    return found;
  for (std::uint32_t k = 0; k < meetings_.size(); ++k)
    edges_passed(k, at, before, edge_depth * depth, found);
  return found;
}

void SurfacePairs::follow_edges(SurfacePair& pair, std::span<const Vec3> at) const {
  const Vec3 &a = at[pair.nodes[0]], &b = at[pair.nodes[1]], &c = at[pair.nodes[2]],
             &d = at[pair.nodes[3]];
  const auto parts = nearest_parts(a, b, c, d);
  if (!parts || !within(*parts, beyond_end)) {
    pair.apart = true;
    return;
  }
  const Vec3 across = cross(b - a, d - c);
  pair.apart = false;
  pair.share = shares(*parts);
  pair.normal = pair.side / norm(across) * across;
  pair.gap = dot(pair.normal, a - c);
}

} // namespace gewebe

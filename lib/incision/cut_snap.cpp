#include "incision/cut_snap_internal.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

namespace gewebe::incision {
namespace {

/// A node stands on the blade if a crossing is nearer than this share of its edge.
constexpr double there_already = 1e-9;

/// Of an angle of 0 to 60 degrees, by its series: the same on every processor, which a library's is
/// not.
double cosine(double degrees) {
  const double x = degrees * (std::numbers::pi / 180), square = x * x;
  double term = 1, sum = 1;
  for (int n = 2; n <= 24; n += 2) {
    term *= -square / (n * (n - 1));
    sum += term;
  }
  return sum;
}

/// A crossing seen from an end of its edge.
struct Approach {
  double share = 0; // of the edge
  std::uint32_t edge = 0, end = 0;

  auto operator<=>(const Approach&) const = default;
};

/// A face at a node, by its other corners.
struct FaceAt {
  std::uint32_t low = 0, high = 0, tet = 0;

  bool same_face(const FaceAt& other) const { return low == other.low && high == other.high; }
  auto operator<=>(const FaceAt&) const = default;
};

class Snapper {
public:
  Snapper(const tetrahedra::TetMesh& mesh, const CutRegion& region, const BladeCutOptions& options)
      : mesh_(mesh), region_(region), options_(options) {
    for (const std::uint32_t node : region.nodes)
      result_.points.push_back(mesh.points[node]);
    result_.along.assign(region.nodes.size(), no_crossing);
    result_.on.resize(region.nodes.size());
    held_.resize(region.nodes.size());
    for (const std::uint32_t node : options.held) {
      const auto at = std::ranges::lower_bound(region.nodes, node);
      if (at != region.nodes.end() && *at == node)
        held_[static_cast<std::size_t>(at - region.nodes.begin())] = true;
    }
    const double bound = cosine(options.least_angle);
    limit_.reserve(region.tets.size());
    for (const RegionTet& tet : region.tets) {
      const double before = sharpness_of(tet.corners);
      if (!(before <= 1.5))
        throw Error("tetrahedron " + std::to_string(tet.number) +
                    " near the blade has no positive volume");
      limit_.push_back(std::max(bound, before));
    }
    edges_of_nodes();
  }

  SnappedRegion snap() {
    snap_near();
    cure();
    return std::move(result_);
  }

private:
  const Vec3& place(std::uint32_t node) const {
    const std::size_t nodes = result_.points.size();
    return node < nodes ? result_.points[node] : region_.edges[node - nodes].point;
  }
  double sharpness_of(const Tetrahedron& t) const {
    return sharpness(place(t[0]), place(t[1]), place(t[2]), place(t[3]));
  }
  bool active(const CrossedEdge& edge) const {
    return !result_.on[edge.ends[0]] && !result_.on[edge.ends[1]];
  }
  double share_from(std::uint32_t edge, std::uint32_t end) const {
    const double share = region_.edges[edge].share;
    return end == 0 ? share : 1 - share;
  }

  void edges_of_nodes() {
    first_.assign(region_.nodes.size() + 1, 0);
    for (const CrossedEdge& edge : region_.edges)
      for (const std::uint32_t end : edge.ends)
        ++first_[end + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    edges_.resize(2 * region_.edges.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t e = 0; e < region_.edges.size(); ++e)
      for (std::uint32_t end = 0; end < 2; ++end)
        edges_[next[region_.edges[e].ends[end]]++] = {share_from(e, end), e, end};
  }

  /// The crossing that is nearest in space among those within `share` of their edges.
  std::optional<Approach> nearest(std::uint32_t node, double share) const {
    std::optional<Approach> best;
    double distance = HUGE_VAL;
    for (std::uint32_t n = first_[node]; n < first_[node + 1]; ++n) {
      const Approach& approach = edges_[n];
      const CrossedEdge& edge = region_.edges[approach.edge];
      if (!(approach.share < share) || !active(edge))
        continue;
      if (approach.share * edge.length < distance) {
        distance = approach.share * edge.length;
        best = approach;
      }
    }
    return best;
  }

  /// Nodes that can be moved onto the blade are, the nearest first.
  void snap_near() {
    std::vector<std::pair<Approach, std::uint32_t>> order;
    for (std::uint32_t node = 0; node < region_.nodes.size(); ++node)
      if (const std::optional<Approach> approach = nearest(node, options_.snap))
        order.emplace_back(*approach, node);
    std::ranges::sort(order);
    for (const auto& [before, node] : order)
      if (const std::optional<Approach> approach = nearest(node, options_.snap))
        if (approach->share <= there_already || can_move(*approach))
          move(*approach);
  }

  /// Crossings of tetrahedra that would become too sharp are given up for nodes, the nearest first.
  /// Each time there is one crossing less; without any a tetrahedron is as sharp as it was, or as
  /// moving has made it within its limit.
  void cure() {
    std::vector<bool> waiting(region_.tets.size());
    for (std::size_t r = 0; r < waiting.size(); ++r)
      waiting[r] = region_.tets[r].has_crossing();
    for (bool any = true; any;) {
      any = false;
      for (std::uint32_t r = 0; r < waiting.size(); ++r) {
        if (!waiting[r])
          continue;
        waiting[r] = false;
        while (options_.along_faces ? is_split(r) : !(worst_part(r) <= limit_[r])) {
          const std::uint32_t node = give_up_one(r);
          for (const std::uint32_t other : region_.star_of(node))
            if (region_.tets[other].has_crossing() && other != r)
              waiting[other] = any = true;
        }
      }
    }
  }

  bool is_split(std::uint32_t r) const {
    return std::ranges::any_of(region_.tets[r].crossing, [&](std::uint32_t e) {
      return e != no_crossing && active(region_.edges[e]);
    });
  }

  double worst_part(std::uint32_t r) const {
    const RegionTet& tet = region_.tets[r];
    const std::vector<EdgeNode> nodes = edge_nodes(region_, result_.on, tet);
    double worst = 0;
    if (!nodes.empty())
      split_tetrahedron(tet.corners, nodes, [&](const Tetrahedron& part) {
        worst = std::max(worst, sharpness_of(part));
      });
    return worst;
  }

  std::uint32_t give_up_one(std::uint32_t r) {
    std::vector<Approach> ways;
    for (const std::uint32_t e : region_.tets[r].crossing)
      if (e != no_crossing && active(region_.edges[e]))
        for (std::uint32_t end = 0; end < 2; ++end)
          ways.push_back({share_from(e, end), e, end});
    std::ranges::sort(ways);
    for (const Approach& way : ways)
      if (way.share <= 0.5 && can_move(way)) {
        move(way);
        return region_.edges[way.edge].ends[way.end];
      }
    keep(ways.front());
    return region_.edges[ways.front().edge].ends[ways.front().end];
  }

  void move(const Approach& way) {
    const CrossedEdge& edge = region_.edges[way.edge];
    const std::uint32_t node = edge.ends[way.end];
    result_.on[node] = true;
    if (way.share <= there_already)
      return;
    result_.points[node] = edge.point;
    result_.along[node] = way.edge;
    ++result_.moved;
  }

  void keep(const Approach& way) {
    const CrossedEdge& edge = region_.edges[way.edge];
    result_.on[edge.ends[way.end]] = true;
    if (way.share <= there_already)
      return;
    ++result_.kept;
    result_.largest_miss = std::max(result_.largest_miss, way.share * edge.length);
  }

  bool can_move(const Approach& way) {
    const CrossedEdge& edge = region_.edges[way.edge];
    const std::uint32_t node = edge.ends[way.end];
    if (options_.along_faces || held_[node] ||
        !within_planes(node, edge.point - result_.points[node]))
      return false;
    const Vec3 before = result_.points[node];
    result_.points[node] = edge.point;
    const bool good = std::ranges::all_of(region_.star_of(node), [&](std::uint32_t r) {
      return sharpness_of(region_.tets[r].corners) <= limit_[r];
    });
    result_.points[node] = before;
    return good;
  }

  /// Does a step of a node lie in the planes of all faces on the boundary, or between materials, at
  /// it, and leave their area as it is? Then no volume passes from one side to the other, and the
  /// node doesn't run ahead of the front of an earlier wound.
  bool within_planes(std::uint32_t node, const Vec3& step) const {
    std::vector<FaceAt> faces;
    for (const std::uint32_t r : region_.star_of(node)) {
      const Tetrahedron& t = region_.tets[r].corners;
      for (std::size_t k = 0; k < 4; ++k) {
        if (t[k] == node)
          continue;
        std::array<std::uint32_t, 2> others{};
        std::size_t count = 0;
        for (const std::uint8_t c : tetrahedra::tetrahedron_faces[k])
          if (t[c] != node)
            others[count++] = t[c];
        const auto [low, high] = std::minmax(others[0], others[1]);
        faces.push_back({low, high, r});
      }
    }
    std::ranges::sort(faces);
    double area = 0, area_after = 0;
    for (std::size_t n = 0; n < faces.size();) {
      std::size_t end = n + 1;
      while (end < faces.size() && faces[end].same_face(faces[n]))
        ++end;
      const bool within = end - n == 2 && same_material(faces[n].tet, faces[n + 1].tet);
      if (!within) {
        if (!in_plane(node, faces[n], step))
          return false;
        area += norm(normal_of(faces[n], result_.points[node]));
        area_after += norm(normal_of(faces[n], result_.points[node] + step));
      }
      n = end;
    }
    constexpr double rounding = 1e-13;
    return std::fabs(area_after - area) <= rounding * area;
  }

  Vec3 normal_of(const FaceAt& face, const Vec3& p) const {
    return cross(result_.points[face.low] - p, result_.points[face.high] - p);
  }

  bool same_material(std::uint32_t r, std::uint32_t s) const {
    return mesh_.material.empty() ||
           mesh_.material[region_.tets[r].number] == mesh_.material[region_.tets[s].number];
  }

  bool in_plane(std::uint32_t node, const FaceAt& face, const Vec3& step) const {
    const Vec3 &p = result_.points[node], &a = result_.points[face.low],
               &b = result_.points[face.high];
    const Vec3 normal = normal_of(face, p);
    double size = norm(step) + norm(a - p) + norm(b - p);
    for (int axis = 0; axis < 3; ++axis)
      size = std::max({size, std::fabs(p[axis]), std::fabs(a[axis]), std::fabs(b[axis])});
    constexpr double rounding = 1e-15;
    return std::fabs(dot(normal, step)) <= rounding * size * norm(normal);
  }

  const tetrahedra::TetMesh& mesh_;
  const CutRegion& region_;
  const BladeCutOptions& options_;
  std::vector<bool> held_;
  std::vector<double> limit_;        // of the sharpness of each tetrahedron's parts
  std::vector<std::uint32_t> first_; // edges_[first_[n] … first_[n+1]) are those of a local node
  std::vector<Approach> edges_;
  SnappedRegion result_;
};

} // namespace

std::vector<EdgeNode> edge_nodes(const CutRegion& region, const std::vector<bool>& on,
                                 const RegionTet& tet) {
  std::vector<EdgeNode> nodes;
  for (const std::uint32_t e : tet.crossing) {
    if (e == no_crossing)
      continue;
    const auto& ends = region.edges[e].ends;
    if (!on[ends[0]] && !on[ends[1]])
      nodes.push_back({ends, static_cast<std::uint32_t>(region.nodes.size()) + e});
  }
  std::ranges::sort(nodes, {}, [&](const EdgeNode& n) {
    return region.edges[n.node - region.nodes.size()].rank;
  });
  return nodes;
}

SnappedRegion snap_region(const tetrahedra::TetMesh& mesh, const CutRegion& region,
                          const BladeCutOptions& options) {
  return Snapper(mesh, region, options).snap();
}

} // namespace gewebe::incision

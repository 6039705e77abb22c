#include "shading/occlusion.h"

#include "base/parallel.h"
#include "shading/angles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace gewebe {
namespace {

struct Facet {
  Vec3 corner, edge1, edge2;
};

/// Boxes of facets, halved at the median along their longest side.
class FacetTree {
public:
  explicit FacetTree(std::vector<Facet> facets) : facets_(std::move(facets)) {
    if (facets_.empty())
      return;
    std::vector<Item> items(facets_.size());
    for (std::size_t n = 0; n < items.size(); ++n) {
      const Facet& f = facets_[n];
      for (const Vec3& p : {f.corner, f.corner + f.edge1, f.corner + f.edge2})
        items[n].box.add(p);
      items[n].middle = (items[n].box.min + items[n].box.max) * 0.5;
      items[n].number = static_cast<std::uint32_t>(n);
    }
    nodes_.reserve(2 * items.size() / leaf_size + 2);
    build(items);
    std::vector<Facet> sorted;
    sorted.reserve(items.size());
    for (const Item& item : items)
      sorted.push_back(facets_[item.number]);
    facets_ = std::move(sorted);
  }

  /// The distance to the first facet, `most` if there is none nearer.
  /// \pre `along` is a unit vector
  double first_hit(const Vec3& from, const Vec3& along, double most) const {
    if (nodes_.empty())
      return most;
    const Vec3 inverse{1 / along.x, 1 / along.y, 1 / along.z}; // infinite along an axis
    std::array<std::uint32_t, 64> later; // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::size_t count = 0;
    double nearest = most;
    std::uint32_t at = 0;
    if (!(entry(nodes_[0], from, inverse) < nearest))
      return most;
    for (;;) {
      const Node& node = nodes_[at];
      if (node.count > 0) {
        for (std::uint32_t n = node.first; n < node.first + node.count; ++n)
          nearest = std::min(nearest, hit(facets_[n], from, along, nearest));
      } else {
        std::uint32_t near = at + 1, far = node.first;
        double t_near = entry(nodes_[near], from, inverse),
               t_far = entry(nodes_[far], from, inverse);
        if (t_far < t_near) {
          std::swap(near, far);
          std::swap(t_near, t_far);
        }
        if (t_near < nearest) {
          if (t_far < nearest)
            later[count++] = far;
          at = near;
          continue;
        }
      }
      do {
        if (count == 0)
          return nearest;
        at = later[--count];
      } while (!(entry(nodes_[at], from, inverse) < nearest));
    }
  }

private:
  static constexpr std::size_t leaf_size = 4;
  struct Node {
    Box3 box;
    std::uint32_t first = 0, count = 0; ///< facets; without, `first` is the second child
  };
  struct Item {
    Box3 box;
    Vec3 middle;
    std::uint32_t number = 0;
  };

  void build(std::span<Item> items, std::size_t begin = 0) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    Box3 middles;
    for (const Item& item : items) {
      nodes_[at].box.add(item.box.min);
      nodes_[at].box.add(item.box.max);
      middles.add(item.middle);
    }
    if (items.size() <= leaf_size) {
      nodes_[at].first = static_cast<std::uint32_t>(begin);
      nodes_[at].count = static_cast<std::uint32_t>(items.size());
      return;
    }
    const Vec3 size = middles.max - middles.min;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t half = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                     [axis](const Item& a, const Item& b) {
                       return a.middle[axis] != b.middle[axis] ? a.middle[axis] < b.middle[axis]
                                                               : a.number < b.number;
                     });
    build(items.first(half), begin);
    nodes_[at].first = static_cast<std::uint32_t>(nodes_.size());
    build(items.subspan(half), begin + half);
  }

  /// Where the ray comes into the box, 0 from inside, infinite where it misses.
  static double entry(const Node& node, const Vec3& from, const Vec3& inverse) {
    double enter = 0, leave = HUGE_VAL;
    for (int a = 0; a < 3; ++a) {
      const double one = (node.box.min[a] - from[a]) * inverse[a];
      const double other = (node.box.max[a] - from[a]) * inverse[a];
      if (std::isnan(one) || std::isnan(other)) // 0 · ∞: the ray runs in a side
        continue;
      const double low = one < other ? one : other, high = one < other ? other : one;
      enter = low > enter ? low : enter;
      leave = high < leave ? high : leave;
    }
    // Slack for rounding: a facet may lie in a side of its box.
    return enter <= leave * (1 + 1e-12) ? enter : HUGE_VAL;
  }

  /// Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997; both sides.
  static double hit(const Facet& f, const Vec3& from, const Vec3& along, double most) {
    const Vec3 p = cross(along, f.edge2);
    const double det = dot(f.edge1, p);
    if (det == 0)
      return most;
    const Vec3 to = from - f.corner;
    constexpr double slack = 1e-9; // so that no ray slips through between two facets
    const double u = dot(to, p) / det;
    if (!(u >= -slack && u <= 1 + slack))
      return most;
    const Vec3 q = cross(to, f.edge1);
    const double v = dot(along, q) / det, t = dot(f.edge2, q) / det;
    return v >= -slack && u + v <= 1 + slack && t > 0 && t < most ? t : most;
  }

  std::vector<Facet> facets_;
  std::vector<Node> nodes_;
};

/// Around +z, distributed as the cosine.
std::array<Vec3, occlusion_rays> directions() {
  constexpr double golden_angle = 137.50776405003785;
  std::array<Vec3, occlusion_rays> all;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const double square = (static_cast<double>(n) + 0.5) / occlusion_rays;
    const double r = std::sqrt(square);
    const auto [c, s] = cos_sin(golden_angle * static_cast<double>(n));
    all[n] = {r * c, r * s, std::sqrt(1 - square)};
  }
  return all;
}

/// Two unit vectors across n (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
std::pair<Vec3, Vec3> across(const Vec3& n) {
  const double sign = n.z < 0 ? -1 : 1, a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

std::vector<bool> used_points(const Occluder& surface) {
  std::vector<bool> used(surface.points.size());
  for (const Triangle& t : surface.triangles)
    for (const std::uint32_t corner : t)
      used[corner] = true;
  return used;
}

} // namespace

std::vector<std::vector<float>> openness(std::span<const Occluder> surfaces, double radius,
                                         const Context& context) {
  std::vector<std::vector<float>> result;
  std::vector<Facet> facets;
  for (const Occluder& surface : surfaces) {
    result.emplace_back(surface.points.size(), 1.0F);
    for (const auto& [a, b, c] : surface.triangles)
      facets.push_back({surface.points[a], surface.points[b] - surface.points[a],
                        surface.points[c] - surface.points[a]});
  }
  if (!(radius > 0))
    return result;
  const FacetTree tree(std::move(facets));
  const std::array<Vec3, occlusion_rays> rays = directions();
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const Occluder& surface = surfaces[s];
    const std::vector<bool> used = used_points(surface);
    parallel_blocks(context, surface.points.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const Vec3& n = surface.normals[p];
        if (!used[p] || n == Vec3{})
          continue;
        const auto [x, y] = across(n);
        const Vec3 from = surface.points[p] + n * (occlusion_lift * radius);
        double hidden = 0;
        for (const Vec3& ray : rays) {
          const Vec3 along = x * ray.x + y * ray.y + n * ray.z;
          hidden += 1 - tree.first_hit(from, along, radius) / radius;
        }
        result[s][p] = static_cast<float>(1 - hidden / occlusion_rays);
      }
    });
  }
  return result;
}

double occlusion_bytes(double triangles) {
  return triangles * (2 * 72.0 + 80 + 28); // facets twice while they are sorted, items, nodes
}

} // namespace gewebe

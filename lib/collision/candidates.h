#pragma once
// Broad phase: pairs of primitives that may come close on the way from x0 to x1.

#include "collision/bvh.h"
#include "collision/ccd.h"
#include "collision/surface.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::collision {

/// Pairs of primitives, by their vertices. Pairs of edges cover points of edges and edges of
/// triangles. Pairs of a point with an edge or a point therefore have only primitives that are part
/// of no larger one.
struct Candidates {
  std::vector<std::array<std::uint32_t, 2>> point_point;    ///< p < q
  std::vector<std::array<std::uint32_t, 3>> point_edge;     ///< p, e0, e1
  std::vector<std::array<std::uint32_t, 4>> edge_edge;      ///< a0, a1, b0, b1
  std::vector<std::array<std::uint32_t, 4>> point_triangle; ///< p, t0, t1, t2

  std::size_t size() const noexcept {
    return point_point.size() + point_edge.size() + edge_edge.size() + point_triangle.size();
  }
  void clear() {
    point_point.clear();
    point_edge.clear();
    edge_edge.clear();
    point_triangle.clear();
  }
};

/// Numbers of an edge and a triangle of the surface.
struct Intersection {
  std::uint32_t edge = 0, triangle = 0;
  bool operator==(const Intersection&) const = default;
};

/// Bounding volume hierarchies over the primitives of each owner. They are valid while the topology
/// of the surface stays the same.
class BroadPhase {
public:
  /// \pre complete_surface(surface)
  explicit BroadPhase(const CollisionSurface& surface);

  /// Finds pairs of primitives whose distance at x0 exceeds d_min + reach by no more than their
  /// relative motion to x1. Their owners must be allowed to touch. Pairs with a vertex in common
  /// are left out, and so are pairs of fixed primitives, and pairs where one owner holds the other.
  /// \param surface  that of the constructor
  /// \param reach  mm
  /// \param allowed  owners beyond the table touch nothing
  /// \param candidates  overwritten; keeps its memory. Order: by pairs of owners, then by number
  void find(const CollisionSurface& surface, std::span<const Vec3> x0, std::span<const Vec3> x1,
            double reach, const AllowedPairs& allowed, Candidates& candidates);
  /// Gaps (distance minus d_min) at x0 of the candidates found last, one list behind the other.
  std::span<const double> gaps() const noexcept { return gaps_; }

  /// Finds edges that intersect triangles at x, for owners that may touch. Pairs with a vertex in
  /// common are left out. The test is exact and includes touching. Primitives with a radius are
  /// left out.
  /// \param most  largest number of intersections
  std::vector<Intersection> find_intersections(const CollisionSurface& surface,
                                               std::span<const Vec3> x, const AllowedPairs& allowed,
                                               std::size_t most);

private:
  /// Neighbouring primitives, by ranges of Primitives::grouped and Primitives::corners.
  struct Group {
    std::uint32_t first = 0, last = 0, first_corner = 0, last_corner = 0;
    Box3 box;
  };
  struct Primitives {
    std::vector<std::uint32_t> number; ///< ascending
    std::vector<Box3> boxes;
    Bvh tree;
    bool current = false;      ///< the tree belongs to the present x0, x1
    std::vector<Group> groups; ///< of many primitives
    std::vector<std::uint32_t> grouped,
        corners;              ///< places in `number`; vertices, each once a group
    bool grouped_now = false; ///< the boxes of groups belong to x0, x1
  };
  /// Primitives of one list that are near the box of another owner.
  struct Near {
    std::vector<std::uint32_t> place; ///< in Primitives::number
    std::vector<Box3> boxes;
  };
  struct Owner {
    Primitives points, edges, triangles, lone_points, lone_edges;
    Box3 box;
  };
  /// Sets the boxes of all owners. Trees are refitted when they are needed.
  template <class BoxOf>
  void set_boxes(const BoxOf& box_of);
  template <class BoxOf, class VerticesOf>
  void refit(Primitives& primitives, const BoxOf& box_of, const VerticesOf& vertices_of);
  template <class VerticesOf>
  void make_groups(std::span<const Vec3> x, Primitives& primitives, const VerticesOf& vertices_of);
  /// Finds primitives whose boxes meet `other`, by the boxes of groups alone where they are many.
  /// \return whether they are few; else the tree serves better
  template <class BoxOf, class VerticesOf>
  bool find_near(Primitives& primitives, const Box3& other, std::span<const Vec3> x,
                 const BoxOf& box_of, const VerticesOf& vertices_of, Near& near);
  /// Numbers of the primitives of both whose boxes meet, ascending.
  void find_pairs(const Primitives& a, const Primitives& b);
  void find_near_pairs(const Primitives& a, const Primitives& b);

  std::vector<Owner> owners_;
  std::array<Near, 2> near_;                        ///< of the two lists of find_near_pairs
  std::vector<std::array<std::uint32_t, 2>> pairs_; ///< of find_pairs
  std::vector<double> gaps_;
};

/// Vertices of all candidates, ascending, each once.
std::vector<std::uint32_t> vertices_of(const Candidates& candidates);

/// Largest step in [0, t_max] along which a pair keeps its separation. \param first  vertices of
/// its first side \param separation  d_min is added to the sum of the pair's radii
template <std::size_t n>
double collision_free_step(const CollisionSurface& surface,
                           const std::array<std::uint32_t, n>& vertices, std::size_t first,
                           std::span<const Vec3> x0, std::span<const Vec3> x1,
                           const Separation& separation, double t_max);

/// Largest step in [0, t_max] along which all candidates keep their separation.
/// \param separation  d_min is added to the sum of the pair's radii
double collision_free_step(const CollisionSurface& surface, const Candidates& candidates,
                           std::span<const Vec3> x0, std::span<const Vec3> x1,
                           const Separation& separation, double t_max = 1);

/// d_min of a pair: the sum of both radii.
inline double radius_sum(const CollisionSurface& surface, std::uint32_t first,
                         std::uint32_t second) {
  return surface.radius[first] + surface.radius[second];
}

} // namespace gewebe::collision

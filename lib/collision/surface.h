#pragma once
// Surface for collision detection: vertices of all bodies and instruments, and the points, edges
// and triangles between them, as plain arrays.

#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::collision {

inline constexpr std::uint32_t no_owner = UINT32_MAX;

/// A sphere is one point with a radius, a capsule one edge with a radius, a mesh its triangles.
struct CollisionSurface {
  std::vector<Vec3> rest; ///< by vertex, mm
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::uint32_t, 2>> edges; ///< each once, those of triangles too
  std::vector<std::uint32_t> points;               ///< vertices that can touch triangles
  /// By vertex: body or instrument, from 0 on. Vertices of one primitive have one owner.
  std::vector<std::uint32_t> owner;
  /// By vertex, mm: distance of the surface from points, edges and triangles. All vertices of an
  /// owner have the same radius. d_min of a pair is the sum of both radii.
  std::vector<double> radius;
  std::vector<std::uint8_t> fixed; ///< by vertex: 1 if it never moves; empty: all move
  /// By vertex: the owner that holds it, or no_owner; empty: none is held. Primitives with a held
  /// vertex do not touch its holder.
  std::vector<std::uint32_t> holder;
  // Set by complete_surface, which also completes the members above:
  std::vector<std::uint32_t> lone_edges;  ///< numbers of edges of no triangle
  std::vector<std::uint32_t> lone_points; ///< points of no edge
  /// Triangles of vertex v: triangles_around[first_around[v]] up to that of first_around[v + 1].
  std::vector<std::uint32_t> first_around, triangles_around;
  /// By triangle: what its edges (k, k + 1), then its vertices count in a sum over triangles, so
  /// that a closed flat surface counts once wherever a point is next to it (inclusion and
  /// exclusion: less the edges, more the vertices). Empty: nothing.
  std::vector<std::array<double, 6>> overlap;

  std::size_t size() const noexcept { return rest.size(); }
  bool is_fixed(std::uint32_t vertex) const { return !fixed.empty() && fixed[vertex] != 0; }
  std::span<const std::uint32_t> triangles_of(std::uint32_t vertex) const {
    return std::span(triangles_around)
        .subspan(first_around[vertex], first_around[vertex + 1] - first_around[vertex]);
  }
  bool is_held(std::uint32_t vertex, std::uint32_t by) const {
    return !holder.empty() && holder[vertex] == by;
  }
};

/// Completes a surface. Adds the edges of triangles, and makes `edges` ascending and unique.
/// `points` becomes all vertices that are part of a primitive or were listed. `owner` and `radius`
/// become 0 if they are empty. Fills lone_edges, lone_points, the triangles
/// around vertices, and their overlap.
/// \throws Error if a vertex is out of range or used twice in a primitive, or lists of vertices
/// differ in length
void complete_surface(CollisionSurface& surface);

/// Symmetric table over pairs of owners: pairs that may touch, or friction coefficients.
template <class T>
class OwnerTable {
public:
  OwnerTable() = default;
  OwnerTable(std::size_t owners, T value) : owners_(owners), value_(owners * owners, value) {}
  std::size_t owners() const noexcept { return owners_; }
  T at(std::size_t a, std::size_t b) const { return value_[a * owners_ + b]; }
  void set(std::size_t a, std::size_t b, T value) {
    value_[a * owners_ + b] = value;
    value_[b * owners_ + a] = value;
  }

private:
  std::size_t owners_ = 0;
  std::vector<T> value_;
};

/// Pairs of owners that may touch; the diagonal is contact of an owner with itself.
using AllowedPairs = OwnerTable<std::uint8_t>;

} // namespace gewebe::collision

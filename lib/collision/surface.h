#pragma once
// Collision surface: vertices of all bodies and instruments with their points, edges and triangles,
// as plain arrays.

#include "base/vec3.h"

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
  std::vector<std::uint32_t> points;               ///< vertices that meet triangles
  /// By vertex: body or instrument, from 0 on. Vertices of one primitive have one owner.
  std::vector<std::uint32_t> owner;
  /// By vertex, mm: what the surface lies outside of points, edges and triangles. One of each
  /// owner. d_min of a pair is the sum of both sides'.
  std::vector<double> radius;
  std::vector<std::uint8_t> fixed; ///< by vertex: 1 if it never moves; empty: all move
  /// By vertex: the owner that holds it, or no_owner; empty: none is held. What has a held vertex
  /// does not meet its holder.
  std::vector<std::uint32_t> holder;
  // By complete_surface, as is what precedes where noted there:
  std::vector<std::uint32_t> lone_edges;  ///< numbers of edges of no triangle
  std::vector<std::uint32_t> lone_points; ///< points of no edge

  std::size_t size() const noexcept { return rest.size(); }
  bool is_fixed(std::uint32_t vertex) const { return !fixed.empty() && fixed[vertex] != 0; }
  bool is_held(std::uint32_t vertex, std::uint32_t by) const {
    return !holder.empty() && holder[vertex] == by;
  }
};

/// Adds the edges of triangles, makes `edges` ascending and unique, `points` all vertices that are
/// part of anything or were listed, `owner` and `radius` 0 where they are empty; fills lone_edges
/// and lone_points.
/// \throws Error where a vertex is out of range, used twice in a primitive, or lists of vertices
/// differ in length
void complete_surface(CollisionSurface& surface);

/// Symmetric table over pairs of owners: who may meet, or friction coefficients.
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

/// Who may meet; the diagonal is contact of an owner with itself.
using AllowedPairs = OwnerTable<std::uint8_t>;

} // namespace gewebe::collision

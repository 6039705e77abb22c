#pragma once
// The edges of triangles, with the faces that meet in each and the way they run along it: what all
// queries of neighbours, borders and orientation need. Two forms of one sort: EdgeSides for one
// pass over all edges, EdgeTable for access by number.

#include "base/context.h"
#include "geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Such a face has no area. It has no edges in the tables below, for its sides cancel.
inline bool has_equal_corners(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/// Corner k of a face is 3 face + k; in the order of the face the next and the previous one.
inline std::uint32_t next_corner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}
inline std::uint32_t previous_corner(std::uint32_t corner) {
  return corner % 3 == 0 ? corner + 2 : corner - 1;
}

/// A face at an edge, which joins the points low < high. Sides are ordered by high, then face.
class EdgeSide {
public:
  EdgeSide() = default;
  EdgeSide(std::uint32_t high, std::uint32_t corner, bool backward)
      : bits_(std::uint64_t{high} << 32 | std::uint64_t{corner} << 1 | (backward ? 1U : 0U)) {}

  std::uint32_t high() const { return static_cast<std::uint32_t>(bits_ >> 32); }
  /// The corner of the face that lies opposite to the edge.
  std::uint32_t corner() const { return static_cast<std::uint32_t>(bits_) >> 1; }
  std::uint32_t face() const { return static_cast<std::uint32_t>(bits_) / 6; }
  /// Does the face run along the edge from high to low?
  bool backward() const { return (bits_ & 1) != 0; }
  /// The corners of the face at the ends of the edge.
  std::uint32_t low_corner() const {
    return backward() ? previous_corner(corner()) : next_corner(corner());
  }
  std::uint32_t high_corner() const {
    return backward() ? next_corner(corner()) : previous_corner(corner());
  }

  friend bool operator<(const EdgeSide& a, const EdgeSide& b) { return a.bits_ < b.bits_; }

private:
  std::uint64_t bits_ = 0;
};

/// How many more of these faces run from low to high than the other way: 0 where they make a chain
/// that goes on across the edge.
inline int surplus(std::span<const EdgeSide> edge) {
  int forward = 0;
  for (const EdgeSide& side : edge)
    forward += side.backward() ? -1 : 1;
  return forward;
}

/// The sides of all faces in the order of their edges (by low, then high), in each by face: a
/// bucket for each smaller end, 8 bytes a side and 4 a point. Time grows with points and faces (a
/// bucket of n sides is sorted in n log n).
class EdgeSides {
public:
  /// On context.threads; without a context on one.
  /// \pre corners are below `points`   \throw Error if there are more than 2^31 / 3 triangles
  EdgeSides(std::size_t points, std::span<const Triangle> triangles);
  EdgeSides(std::size_t points, std::span<const Triangle> triangles, const Context& context);

  /// Calls visit(low, std::span<const EdgeSide>) for each edge.
  template <class Visit>
  void for_each_edge(Visit&& visit) const {
    for_each_edge(0, points(), visit);
  }
  /// For those whose smaller ends are in [begin_point, end_point).
  template <class Visit>
  void for_each_edge(std::size_t begin_point, std::size_t end_point, Visit&& visit) const {
    for (std::size_t low = begin_point; low < end_point; ++low)
      for (std::uint32_t begin = first_[low], stop = first_[low + 1]; begin < stop;) {
        std::uint32_t end = begin + 1;
        while (end < stop && sides_[end].high() == sides_[begin].high())
          ++end;
        visit(static_cast<std::uint32_t>(low), std::span(&sides_[begin], end - begin));
        begin = end;
      }
  }
  /// Of all edges.
  std::size_t size() const { return sides_.size(); }
  /// Of the edges whose smaller ends are before a point.
  std::size_t size_before(std::size_t point) const { return first_[point]; }
  std::size_t points() const { return first_.size() - 1; }

private:
  void sort_buckets(std::size_t begin, std::size_t end);

  std::vector<std::uint32_t> first_; ///< by low
  std::vector<EdgeSide> sides_;
};

/// Edge e joins ends[e][0] < ends[e][1]; edges ascend by their ends. The faces in an edge are given
/// by the corner that lies opposite: corners[first[e] … first[e+1]) holds 3 face + k, ascending.
struct EdgeTable {
  std::vector<std::array<std::uint32_t, 2>> ends;
  std::vector<std::uint32_t> first; ///< one more than edges
  std::vector<std::uint32_t> corners;

  std::size_t size() const { return ends.size(); }
  std::span<const std::uint32_t> around(std::size_t edge) const {
    return {corners.data() + first[edge], corners.data() + first[edge + 1]};
  }

  static constexpr std::size_t no_edge = SIZE_MAX;
  /// The edge with these ends, the smaller one first, or no_edge. Time grows with log(edges).
  std::size_t find(const std::array<std::uint32_t, 2>& wanted) const;
};

/// Threads, \pre and \throw as EdgeSides
EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count);
EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count,
                     const Context& context);

} // namespace gewebe::mesh

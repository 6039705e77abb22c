#pragma once
// Tables of the faces and edges of tetrahedra, with the tetrahedra at each: the base of all
// algorithms for neighbours and the boundary.

#include "geometry/mesh.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::tetrahedra {

/// Such a tetrahedron has no volume. It has no faces and edges in the tables below.
inline bool has_equal_corners(const Tetrahedron& t) {
  return t[0] == t[1] || t[0] == t[2] || t[0] == t[3] || t[1] == t[2] || t[1] == t[3] ||
         t[2] == t[3];
}

/// A tetrahedron at a face, whose corners are low < middle < high. Face k of a tetrahedron
/// (opposite to its corner k) has the number 4 tetrahedron + k.
struct TetFace {
  std::uint32_t middle = 0, high = 0, number = 0;

  std::uint32_t tetrahedron() const { return number / 4; }
  std::uint32_t opposite() const { return number % 4; }
  bool same_face(const TetFace& other) const {
    return middle == other.middle && high == other.high;
  }
  friend bool operator<(const TetFace& a, const TetFace& b) {
    return a.middle != b.middle ? a.middle < b.middle
           : a.high != b.high   ? a.high < b.high
                                : a.number < b.number;
  }
};

/// A tetrahedron at an edge, which joins low < high. Edge k of a tetrahedron (tetrahedron_edges)
/// has the number 6 tetrahedron + k.
struct TetEdge {
  std::uint32_t high = 0, number = 0;

  std::uint32_t tetrahedron() const { return number / 6; }
  std::uint32_t edge() const { return number % 6; }
  bool same_edge(const TetEdge& other) const { return high == other.high; }
  friend bool operator<(const TetEdge& a, const TetEdge& b) {
    return a.high != b.high ? a.high < b.high : a.number < b.number;
  }
};

/// The corners of face number 4 t + k, counter-clockwise seen from outside a tetrahedron of
/// positive volume.
inline Triangle corners_of_face(const Tetrahedron& t, std::uint32_t k) {
  const auto& face = tetrahedron_faces[k];
  return {t[face[0]], t[face[1]], t[face[2]]};
}

/// All faces by their corners, in each by number: a bucket for each smallest corner, 12 bytes a
/// face and 4 a point. Time grows with points and tetrahedra (a bucket of n is sorted in n log n).
class TetFaces {
public:
  /// \pre corners are below `points`   \throw Error if there are more than 2^30 tetrahedra
  TetFaces(std::size_t points, std::span<const Tetrahedron> tetrahedra);

  /// Calls visit(low, std::span<const TetFace>) for each face.
  template <class Visit>
  void for_each_face(Visit&& visit) const {
    for (std::size_t low = 0; low + 1 < first_.size(); ++low)
      for (std::uint32_t begin = first_[low], stop = first_[low + 1]; begin < stop;) {
        std::uint32_t end = begin + 1;
        while (end < stop && sides_[end].same_face(sides_[begin]))
          ++end;
        visit(static_cast<std::uint32_t>(low), std::span(&sides_[begin], end - begin));
        begin = end;
      }
  }

private:
  std::vector<std::uint32_t> first_; // of each point's bucket
  std::vector<TetFace> sides_;
};

/// The same for edges: 8 bytes an edge of a tetrahedron and 4 a point.
class TetEdges {
public:
  /// \pre corners are below `points`   \throw Error if there are more than 2^32 / 6 tetrahedra
  TetEdges(std::size_t points, std::span<const Tetrahedron> tetrahedra);

  /// Calls visit(low, std::span<const TetEdge>) for each edge.
  template <class Visit>
  void for_each_edge(Visit&& visit) const {
    for (std::size_t low = 0; low + 1 < first_.size(); ++low)
      for (std::uint32_t begin = first_[low], stop = first_[low + 1]; begin < stop;) {
        std::uint32_t end = begin + 1;
        while (end < stop && sides_[end].same_edge(sides_[begin]))
          ++end;
        visit(static_cast<std::uint32_t>(low), std::span(&sides_[begin], end - begin));
        begin = end;
      }
  }

private:
  std::vector<std::uint32_t> first_;
  std::vector<TetEdge> sides_;
};

} // namespace gewebe::tetrahedra

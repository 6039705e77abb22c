#pragma once
// Link of a node: intersection of the tetrahedra of one of its pieces with a small sphere.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::incision {

/// A surface of triangles on the sphere: one for each tetrahedron at the node, with an edge for
/// each face and a vertex for each edge of the solid there.
class NodeLink {
public:
  /// An edge of the solid at the node: its other end, and which of that node's pieces.
  using Vertex = std::array<std::uint32_t, 2>;
  struct Face {
    std::array<Vertex, 2> ends{};
    std::uint32_t number = 0; ///< as the caller has it
    bool open = false;        ///< has a tetrahedron of the piece on one side only
    bool old = false;         ///< has been so before
  };

  /// The three faces of a tetrahedron at the node.
  void add(const std::array<Face, 3>& faces);

  /// V - E + F: 1 of a disc, 2 of the whole sphere. Less where the boundary is in several loops, or
  /// one loop comes to a vertex more than once. \pre it is connected
  int euler_number() const;

  /// Faces that, opened, part a ring into two discs: two ways between its two loops, or one where
  /// they meet in a vertex; each of the fewest faces, at most `most`. One of the loops must have
  /// been open before. None of any other link, or where there is no way.
  std::vector<std::uint32_t> ways_across(std::size_t most) const;

private:
  std::vector<Face> faces_;
  std::size_t tetrahedra_ = 0;
};

} // namespace gewebe::incision

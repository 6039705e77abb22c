#include "stuffing/stencils_internal.h"

#include "stuffing/bcc_internal.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <vector>

namespace gewebe::stuffing {
namespace {

using Nodes = std::array<StencilNode, 4>;

Vec3 place(const StencilNode& node) {
  const auto corner = [](unsigned i) {
    return bcc::position(bcc::cell_point(bcc::cell_tetrahedra[0][i]));
  };
  return node.is_cut() ? (corner(node.inner()) + corner(node.outer())) / 2 : corner(node.code);
}

void add(std::vector<Nodes>& tetrahedra, Nodes nodes) {
  if (tetrahedra::tetrahedron_volume(place(nodes[0]), place(nodes[1]), place(nodes[2]),
                                     place(nodes[3])) < 0)
    std::swap(nodes[2], nodes[3]);
  tetrahedra.push_back(nodes);
}

/// Of two inner corners of a face with the outer corner n the one at which the diagonal of the
/// quadrilateral between starts. It depends on the face alone, so that both tetrahedra at it agree;
/// for one outer corner it is an order of the inner ones, so that diagonals never go round a prism.
unsigned diagonal_corner(unsigned p, unsigned q, unsigned n, const DiagonalOrder& order) {
  return order[n][p] < order[n][q] ? p : q;
}

/// A prism with triangles `top` and `bottom`, node k over node k; from[i][j] says that the
/// diagonal between columns i and j starts at the top of column i. Empty if the diagonals go round.
std::vector<Nodes> cut_prism(const std::array<StencilNode, 3>& top,
                             const std::array<StencilNode, 3>& bottom,
                             const std::array<std::array<bool, 3>, 3>& from) {
  std::vector<Nodes> result;
  for (const bool upper : {true, false})
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      if (from[k][i] != upper || from[k][j] != upper)
        continue;
      // Both diagonals beside column k meet at its top (bottom): it sees the face beyond.
      const StencilNode apex = upper ? top[k] : bottom[k];
      const auto& far = upper ? bottom : top;
      add(result, {apex, far[0], far[1], far[2]});
      const std::size_t start = from[i][j] ? i : j, end = from[i][j] ? j : i;
      add(result, {apex, top[start], bottom[end], top[end]});
      add(result, {apex, top[start], bottom[end], bottom[start]});
      return result;
    }
  return result;
}

struct Corners {
  std::vector<unsigned> inner, zero, outer;
};

/// One inner corner's end of the tetrahedron, or with no outer corner all of it.
std::vector<Nodes> one_piece(const Corners& corners) {
  std::vector<StencilNode> nodes;
  for (const unsigned p : corners.inner)
    nodes.push_back(StencilNode::corner(p));
  for (const unsigned n : corners.outer)
    nodes.push_back(StencilNode::cut(corners.inner[0], n));
  for (const unsigned z : corners.zero)
    nodes.push_back(StencilNode::corner(z));
  std::vector<Nodes> result;
  add(result, {nodes[0], nodes[1], nodes[2], nodes[3]});
  return result;
}

/// Two inner corners, one outer, one on the surface: a pyramid over the face without the latter.
std::vector<Nodes> pyramid(const Corners& corners, const DiagonalOrder& order) {
  const unsigned p = corners.inner[0], q = corners.inner[1], n = corners.outer[0];
  const unsigned start = diagonal_corner(p, q, n, order), other = p + q - start;
  const StencilNode apex = StencilNode::corner(corners.zero[0]), from = StencilNode::corner(start),
                    to = StencilNode::cut(other, n);
  std::vector<Nodes> result;
  add(result, {from, to, StencilNode::corner(other), apex});
  add(result, {from, to, StencilNode::cut(start, n), apex});
  return result;
}

/// Three inner corners over their cut points.
std::vector<Nodes> blunt(const Corners& corners, const DiagonalOrder& order) {
  std::array<StencilNode, 3> top{}, bottom{};
  std::array<std::array<bool, 3>, 3> from{};
  const unsigned n = corners.outer[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const unsigned p = corners.inner[i];
    top[i] = StencilNode::corner(p);
    bottom[i] = StencilNode::cut(p, n);
    for (std::size_t j = 0; j < 3; ++j)
      if (i != j)
        from[i][j] = diagonal_corner(p, corners.inner[j], n, order) == p;
  }
  return cut_prism(top, bottom, from);
}

/// Two inner corners, two outer: a wedge along the inner edge. The diagonal of the quadrilateral on
/// the surface is free; `start` says at which of the first corner's two cut points it starts.
std::vector<Nodes> wedge(const Corners& corners, const DiagonalOrder& order, std::size_t start) {
  const unsigned p = corners.inner[0], q = corners.inner[1];
  std::array<StencilNode, 3> top{StencilNode::corner(p)}, bottom{StencilNode::corner(q)};
  std::array<std::array<bool, 3>, 3> from{};
  for (std::size_t i = 1; i < 3; ++i) {
    const unsigned n = corners.outer[i - 1];
    top[i] = StencilNode::cut(p, n);
    bottom[i] = StencilNode::cut(q, n);
    from[0][i] = diagonal_corner(p, q, n, order) == p;
    from[i][0] = !from[0][i];
  }
  from[start][3 - start] = true;
  return cut_prism(top, bottom, from);
}

void copy(const std::vector<Nodes>& from, StencilTetrahedra& to) {
  std::copy(from.begin(), from.end(), to.begin());
}

Stencil make_stencil(const std::array<int, 4>& signs, const DiagonalOrder& order) {
  Corners corners;
  for (unsigned i = 0; i < 4; ++i)
    (signs[i] > 0 ? corners.inner : signs[i] == 0 ? corners.zero : corners.outer).push_back(i);
  std::vector<Nodes> tetrahedra, other;
  if (corners.inner.size() == 1 || (!corners.inner.empty() && corners.outer.empty()))
    tetrahedra = one_piece(corners);
  else if (corners.inner.size() == 2 && corners.outer.size() == 1)
    tetrahedra = pyramid(corners, order);
  else if (corners.inner.size() == 3)
    tetrahedra = blunt(corners, order);
  else if (corners.inner.size() == 2) {
    tetrahedra = wedge(corners, order, 1);
    other = wedge(corners, order, 2);
    if (tetrahedra.empty())
      tetrahedra.swap(other);
  }
  Stencil result;
  result.count = static_cast<std::uint8_t>(tetrahedra.size());
  result.choice = !other.empty();
  copy(tetrahedra, result.tetrahedra);
  copy(other, result.other);
  return result;
}

/// Order of the body-centred lattice. A diagonal ends at the cut point on a long edge; of two short
/// ones it starts at the even corner (of one long edge exactly one is even: parity rule).
DiagonalOrder lattice_order(bool even0, bool even2) {
  const std::array<bool, 4> even{even0, !even0, even2, !even2};
  DiagonalOrder order{};
  for (unsigned n = 0; n < 4; ++n)
    for (unsigned p = 0; p < 4; ++p)
      order[n][p] = p / 2 == n / 2 ? 2 : even[p] ? 0 : 1;
  return order;
}

std::size_t number(const std::array<int, 4>& signs, std::size_t variant, std::size_t variants) {
  std::size_t key = 0;
  for (const int sign : signs)
    key = 3 * key + static_cast<std::size_t>(sign + 1);
  return variants * key + variant;
}

template <class Visit>
void for_each_signs(Visit&& visit) {
  for (int n = 0; n < 81; ++n)
    visit(std::array<int, 4>{n / 27 - 1, n / 9 % 3 - 1, n / 3 % 3 - 1, n % 3 - 1});
}

std::array<Stencil, std::size_t{4} * 81> make_lattice_stencils() {
  std::array<Stencil, std::size_t{4} * 81> result{};
  for_each_signs([&](const std::array<int, 4>& signs) {
    for (const bool even0 : {false, true})
      for (const bool even2 : {false, true})
        result[number(signs, 2U * even0 + even2, 4)] =
            make_stencil(signs, lattice_order(even0, even2));
  });
  return result;
}

/// The permutations of four corners, by number.
std::vector<std::array<std::uint8_t, 4>> permutations() {
  std::vector<std::array<std::uint8_t, 4>> result;
  std::array<std::uint8_t, 4> one{0, 1, 2, 3};
  do
    result.push_back(one);
  while (std::next_permutation(one.begin(), one.end()));
  return result;
}

/// What distinguishes the orders for given signs: of each pair of inner corners and each outer one,
/// which comes first. At most three such questions have a meaning for one pattern of signs.
std::size_t answers(const std::array<int, 4>& signs, const DiagonalOrder& order) {
  std::size_t bits = 0, count = 0;
  for (unsigned n = 0; n < 4; ++n)
    for (unsigned p = 0; signs[n] < 0 && p < 4; ++p)
      for (unsigned q = p + 1; signs[p] > 0 && q < 4; ++q)
        if (signs[q] > 0 && count < 3)
          bits |= static_cast<std::size_t>(order[n][p] < order[n][q]) << count++;
  return bits;
}

std::array<Stencil, std::size_t{8} * 81> make_ordered_stencils() {
  std::array<Stencil, std::size_t{8} * 81> result{};
  const auto all = permutations();
  for_each_signs([&](const std::array<int, 4>& signs) {
    for (const auto& one : all)
      for (const auto& two : all) {
        // Two outer corners have orders of their own; more have no quadrilateral.
        DiagonalOrder order{one, one, one, one};
        bool first = true;
        for (std::size_t n = 0; n < 4; ++n)
          if (signs[n] < 0) {
            order[n] = first ? one : two;
            first = false;
          }
        result[number(signs, answers(signs, order), 8)] = make_stencil(signs, order);
      }
  });
  return result;
}

} // namespace

const Stencil& stencil(const std::array<int, 4>& signs, bool even0, bool even2) {
  static const std::array<Stencil, std::size_t{4}* 81> table = make_lattice_stencils();
  return table[number(signs, 2U * even0 + even2, 4)];
}

const Stencil& stencil(const std::array<int, 4>& signs, const DiagonalOrder& order) {
  static const std::array<Stencil, std::size_t{8}* 81> table = make_ordered_stencils();
  return table[number(signs, answers(signs, order), 8)];
}

double least_angle_cosine(const std::array<Vec3, 4>& corners) {
  std::array<Vec3, 4> normals;
  for (std::size_t f = 0; f < 4; ++f) {
    const auto& face = tetrahedra::tetrahedron_faces[f];
    const Vec3 normal =
        cross(corners[face[1]] - corners[face[0]], corners[face[2]] - corners[face[0]]);
    normals[f] = normal / norm(normal);
  }
  double largest = -1;
  for (std::size_t f = 0; f < 4; ++f)
    for (std::size_t g = 0; g < f; ++g)
      largest = std::max(largest, -dot(normals[f], normals[g]));
  return largest;
}

} // namespace gewebe::stuffing

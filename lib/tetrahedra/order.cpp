#include "tetrahedra/order.h"

#include "base/error.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/faces.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace gewebe::tetrahedra {

NodeOrder order_nodes(TetMesh& mesh) {
  enum Group : std::uint8_t { surface_corner, surface_middle, inner_corner, inner_middle, unused };
  std::vector<Group> group(mesh.points.size(), unused);
  const auto lower = [&](std::uint32_t node, Group to) { group[node] = std::min(group[node], to); };
  for (const EdgeMiddles& middles : mesh.middles)
    for (const std::uint32_t node : middles)
      lower(node, inner_middle);
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const std::uint32_t node : t)
      lower(node, inner_corner);
  {
    const TetBoundary surface = boundary(mesh);
    for (const auto& middles : surface.middles)
      for (const std::uint32_t node : middles)
        lower(node, surface_middle);
    for (const std::uint32_t node : surface.node)
      lower(node, surface_corner);
  }
  std::array<std::uint32_t, 6> first{};
  for (const Group g : group)
    ++first[g + 1U];
  NodeOrder order;
  order.surface_corners = first[surface_corner + 1];
  order.surface_middles = first[surface_middle + 1];
  order.inner_corners = first[inner_corner + 1];
  order.inner_middles = first[inner_middle + 1];
  order.unused = first[unused + 1];
  for (std::size_t g = 1; g < first.size(); ++g)
    first[g] += first[g - 1];
  order.number.resize(mesh.points.size());
  std::vector<Vec3> points(mesh.points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    order.number[p] = first[group[p]]++;
    points[order.number[p]] = mesh.points[p];
  }
  mesh.points = std::move(points);
  const auto renumber = [&](auto& elements) {
    for (auto& element : elements)
      for (std::uint32_t& node : element)
        node = order.number[node];
  };
  renumber(mesh.tetrahedra);
  renumber(mesh.middles);
  return order;
}

void make_quadratic(TetMesh& mesh) {
  if (!mesh.middles.empty())
    throw Error("tetrahedra of ten nodes, expected four");
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    if (has_equal_corners(mesh.tetrahedra[t]))
      throw Error("tetrahedron " + std::to_string(t) + " has equal corners, expected four points");
  // First the number of the first side of each edge, then that of its node.
  std::vector<EdgeMiddles> middles(mesh.tetrahedra.size());
  std::size_t edge_count = 0;
  TetEdges(mesh.points.size(), mesh.tetrahedra)
      .for_each_edge([&](std::uint32_t, std::span<const TetEdge> edge) {
        ++edge_count;
        for (const TetEdge& one : edge)
          middles[one.tetrahedron()][one.edge()] = edge[0].number;
      });
  if (edge_count > UINT32_MAX - mesh.points.size())
    throw Error(std::to_string(mesh.points.size()) + " points and " + std::to_string(edge_count) +
                " edges, expected at most " + std::to_string(UINT32_MAX) + " nodes");
  mesh.points.reserve(mesh.points.size() + edge_count);
  for (std::size_t t = 0; t < middles.size(); ++t)
    for (std::size_t k = 0; k < 6; ++k) {
      const std::uint32_t side = middles[t][k];
      if (side / 6 != t || side % 6 != k) { // seen before, and numbered
        middles[t][k] = middles[side / 6][side % 6];
        continue;
      }
      const auto& edge = tetrahedron_edges[k];
      const Vec3 a = mesh.points[mesh.tetrahedra[t][edge[0]]];
      const Vec3 b = mesh.points[mesh.tetrahedra[t][edge[1]]];
      middles[t][k] = static_cast<std::uint32_t>(mesh.points.size());
      mesh.points.push_back(a * 0.5 + b * 0.5);
    }
  mesh.middles = std::move(middles);
}

TetMesh linear_parts(TetMesh mesh) {
  if (mesh.middles.empty())
    return mesh;
  // Nodes 0 to 3 are the corners, 4 to 9 the middles in the order of EdgeMiddles.
  constexpr std::array<std::array<std::uint8_t, 4>, 8> parts{{{0, 4, 6, 7},
                                                              {4, 1, 5, 8},
                                                              {6, 5, 2, 9},
                                                              {7, 8, 9, 3},
                                                              {6, 8, 4, 5},
                                                              {6, 8, 5, 9},
                                                              {6, 8, 9, 7},
                                                              {6, 8, 7, 4}}};
  TetMesh result;
  result.points = std::move(mesh.points);
  result.tetrahedra.reserve(8 * mesh.tetrahedra.size());
  result.material.reserve(8 * mesh.material.size());
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const auto node = [&](std::uint8_t k) {
      return k < 4 ? mesh.tetrahedra[t][k] : mesh.middles[t][k - 4U];
    };
    for (const auto& [a, b, c, d] : parts)
      result.tetrahedra.push_back({node(a), node(b), node(c), node(d)});
    if (!mesh.material.empty())
      result.material.insert(result.material.end(), 8, mesh.material[t]);
  }
  return result;
}

} // namespace gewebe::tetrahedra

#include "collision/surface.h"

#include "base/error.h"

#include <algorithm>
#include <string>

namespace gewebe::collision {

namespace {

template <std::size_t n>
void check(const CollisionSurface& surface,
           const std::vector<std::array<std::uint32_t, n>>& primitives, const char* name) {
  for (std::size_t k = 0; k < primitives.size(); ++k)
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t vertex = primitives[k][i];
      if (vertex >= surface.size())
        throw Error(std::string(name) + " " + std::to_string(k) + " has vertex " +
                    std::to_string(vertex) + " of " + std::to_string(surface.size()));
      for (std::size_t j = 0; j < i; ++j)
        if (primitives[k][j] == vertex)
          throw Error(std::string(name) + " " + std::to_string(k) + " has vertex " +
                      std::to_string(vertex) + " twice");
      if (surface.owner[vertex] != surface.owner[primitives[k][0]])
        throw Error(std::string(name) + " " + std::to_string(k) +
                    " has vertices of two owners, expected one");
    }
}

std::array<std::uint32_t, 2> ascending(std::uint32_t a, std::uint32_t b) {
  return a < b ? std::array{a, b} : std::array{b, a};
}

void list_triangles_around(CollisionSurface& surface) {
  std::vector<std::uint32_t>& first = surface.first_around;
  first.assign(surface.size() + 1, 0);
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t vertex : triangle)
      ++first[vertex + 1];
  for (std::size_t vertex = 0; vertex < surface.size(); ++vertex)
    first[vertex + 1] += first[vertex];
  surface.triangles_around.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t k = 0; k < surface.triangles.size(); ++k)
    for (const std::uint32_t vertex : surface.triangles[k])
      surface.triangles_around[next[vertex]++] = k;
}

/// \param sides  of all triangles, ascending, with repetitions
void find_overlap(CollisionSurface& surface, std::span<const std::array<std::uint32_t, 2>> sides) {
  const auto excess = [&](std::uint32_t a, std::uint32_t b) { // over one of an edge's triangles
    const auto same = std::ranges::equal_range(sides, ascending(a, b));
    const auto count = static_cast<double>(same.size());
    return (count - 1) / count;
  };
  surface.overlap.clear();
  std::vector<double> of_vertex(surface.size(), 1); // to be 1 in all
  for (const auto& triangle : surface.triangles) {
    std::array<double, 6>& overlap = surface.overlap.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      overlap[k] = -excess(triangle[k], triangle[(k + 1) % 3]);
    for (std::size_t k = 0; k < 3; ++k)
      of_vertex[triangle[k]] -= 1 + overlap[k] + overlap[(k + 2) % 3];
  }
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = surface.triangles[t][k];
      surface.overlap[t][3 + k] =
          of_vertex[vertex] / static_cast<double>(surface.triangles_of(vertex).size());
    }
}

} // namespace

void complete_surface(CollisionSurface& surface) {
  const std::size_t n = surface.size();
  if (surface.owner.empty())
    surface.owner.assign(n, 0);
  if (surface.radius.empty())
    surface.radius.assign(n, 0);
  if (surface.owner.size() != n || surface.radius.size() != n ||
      (!surface.fixed.empty() && surface.fixed.size() != n))
    throw Error("collision surface: lists of vertices differ in length");
  check(surface, surface.triangles, "triangle");
  check(surface, surface.edges, "edge");
  for (const std::uint32_t vertex : surface.points)
    if (vertex >= n)
      throw Error("point " + std::to_string(vertex) + " is no vertex of " + std::to_string(n));

  std::vector<std::array<std::uint32_t, 2>> sides;
  for (const auto& [a, b, c] : surface.triangles)
    sides.insert(sides.end(), {ascending(a, b), ascending(b, c), ascending(a, c)});
  std::sort(sides.begin(), sides.end());
  list_triangles_around(surface);
  find_overlap(surface, sides);
  sides.erase(std::unique(sides.begin(), sides.end()), sides.end());
  for (auto& [a, b] : surface.edges)
    if (a > b)
      std::swap(a, b);
  surface.edges.insert(surface.edges.end(), sides.begin(), sides.end());
  std::sort(surface.edges.begin(), surface.edges.end());
  surface.edges.erase(std::unique(surface.edges.begin(), surface.edges.end()), surface.edges.end());

  surface.lone_edges.clear();
  std::vector<std::uint8_t> listed(n), of_edge(n);
  for (std::size_t k = 0; k < surface.edges.size(); ++k) {
    if (!std::binary_search(sides.begin(), sides.end(), surface.edges[k]))
      surface.lone_edges.push_back(static_cast<std::uint32_t>(k));
    for (const std::uint32_t vertex : surface.edges[k])
      of_edge[vertex] = listed[vertex] = 1;
  }
  for (const std::uint32_t vertex : surface.points)
    listed[vertex] = 1;
  surface.points.clear();
  surface.lone_points.clear();
  for (std::uint32_t vertex = 0; vertex < n; ++vertex)
    if (listed[vertex] != 0) {
      surface.points.push_back(vertex);
      if (of_edge[vertex] == 0)
        surface.lone_points.push_back(vertex);
    }
}

} // namespace gewebe::collision

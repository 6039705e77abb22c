#include "model/usable_surface.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "mesh/repeated_faces.h"

#include <algorithm>
#include <atomic>
#include <span>

namespace gewebe::model {
namespace {

constexpr std::uint32_t unused = UINT32_MAX;
constexpr std::size_t grain = 1 << 15;

/// Those of the numbers [0, count) for which it is true, ascending.
template <class Test>
std::vector<std::uint32_t> those(const Context& context, std::size_t count, const Test& test) {
  std::vector<std::size_t> first((count + grain - 1) / grain + 1); // of each block
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    std::size_t some = 0;
    for (std::size_t n = begin; n < end; ++n)
      some += test(n) ? 1 : 0;
    first[begin / grain + 1] = some;
  });
  for (std::size_t block = 1; block < first.size(); ++block)
    first[block] += first[block - 1];
  std::vector<std::uint32_t> found(first.back());
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    std::size_t at = first[begin / grain];
    for (std::size_t n = begin; n < end; ++n)
      if (test(n))
        found[at++] = static_cast<std::uint32_t>(n);
  });
  return found;
}

/// Do two faces have the same corners? Then they have them at each of their edges.
bool any_twice(const UsableSurface& s, const Context& context) {
  std::atomic<bool> found = false;
  parallel_blocks(context, s.edges.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> opposite;
    for (std::size_t e = begin; e < end; ++e) {
      const std::span<const std::uint32_t> around = s.edges.around(e);
      if (around.size() < 2)
        continue;
      opposite.clear();
      for (const std::uint32_t corner : around)
        opposite.push_back(s.triangles[corner / 3][corner % 3]);
      std::ranges::sort(opposite);
      if (std::ranges::adjacent_find(opposite) != opposite.end())
        found = true;
    }
  });
  return found;
}

/// Leaves out all but the first of faces with the same corners.
void take_once(UsableSurface& s) {
  const std::vector<bool> twice =
      mesh::repeated_faces(s.point_of_node.size(), s.triangles, mesh::SameFace::corners);
  std::size_t kept = 0;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    if (twice[t])
      continue;
    s.triangles[kept] = s.triangles[t];
    s.face_of_triangle[kept++] = s.face_of_triangle[t];
  }
  s.duplicate_faces = s.triangles.size() - kept;
  s.triangles.resize(kept);
  s.face_of_triangle.resize(kept);
}

} // namespace

UsableSurface usable_surface(const TriangleMesh& mesh, const Context& context) {
  UsableSurface s;
  s.face_of_triangle = those(context, mesh.triangles.size(), [&](std::size_t f) {
    return !mesh::has_equal_corners(mesh.triangles[f]);
  });
  s.degenerate_faces = mesh.triangles.size() - s.face_of_triangle.size();
  if (s.face_of_triangle.empty())
    throw Error("no triangle, expected a surface");
  reserve_touched(context, s.triangles, s.face_of_triangle.size());
  s.triangles.resize(s.face_of_triangle.size());
  std::vector<std::uint32_t> node_of_point(mesh.points.size(), unused);
  parallel_blocks(context, s.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      s.triangles[t] = mesh.triangles[s.face_of_triangle[t]];
      for (const std::uint32_t p : s.triangles[t])
        std::atomic_ref(node_of_point[p]).store(0, std::memory_order_relaxed);
    }
  });
  s.point_of_node =
      those(context, mesh.points.size(), [&](std::size_t p) { return node_of_point[p] != unused; });
  s.isolated_points = mesh.points.size() - s.point_of_node.size();
  if (s.isolated_points > 0) {
    for (std::size_t n = 0; n < s.point_of_node.size(); ++n)
      node_of_point[s.point_of_node[n]] = static_cast<std::uint32_t>(n);
    parallel_blocks(context, s.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t)
        for (std::uint32_t& corner : s.triangles[t])
          corner = node_of_point[corner];
    });
  }
  s.edges = mesh::edge_table(s.triangles, s.point_of_node.size(), context);
  if (any_twice(s, context)) {
    take_once(s);
    s.edges = mesh::edge_table(s.triangles, s.point_of_node.size(), context);
  }
  return s;
}

} // namespace gewebe::model

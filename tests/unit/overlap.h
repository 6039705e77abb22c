#pragma once
// How deep closed surfaces are in each other or in themselves, by a geometry of its own: winding
// numbers (of solid angles) and distances, of nodes and of points along edges.

#include "geometry/mesh.h"
#include "larger.h"
#include "mesh/nearest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

namespace gewebe::test {

/// Of nodes, and of all of their edges, over the mean edge at rest.
struct Overlap {
  double nodes = 0, edges = 0;

  void add(const Overlap& o) {
    nodes = numeric::larger(nodes, o.nodes);
    edges = numeric::larger(edges, o.edges);
  }
};

inline double mean_edge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      sum += norm(mesh.points[t[c]] - mesh.points[t[(c + 1) % 3]]);
  return sum / (3 * static_cast<double>(mesh.triangles.size()));
}

/// How often the surface goes round p (A. Van Oosterom, J. Strackee, The solid angle of a plane
/// triangle, IEEE Trans. Biomed. Eng. 30(2), 1983).
inline double turns_round(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.points[t[0]] - p, b = mesh.points[t[1]] - p, c = mesh.points[t[2]] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

namespace overlap {

inline double distance(const TriangleMesh& mesh, const Triangle& t, const Vec3& p) {
  return norm(
      p -
      mesh::nearest_on_triangle(p, mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]).point);
}

inline std::set<std::pair<std::uint32_t, std::uint32_t>> edges_of(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      edges.insert(std::minmax(t[c], t[(c + 1) % 3]));
  return edges;
}

constexpr int parts_of_edge = 8;

/// Places along an edge, without its ends.
inline std::vector<Vec3> along(const Vec3& a, const Vec3& b) {
  std::vector<Vec3> all;
  for (int k = 1; k < parts_of_edge; ++k)
    all.push_back(a + static_cast<double>(k) / parts_of_edge * (b - a));
  return all;
}

inline double depth(const TriangleMesh& in, const std::array<Vec3, 2>& box, const Vec3& p) {
  for (int a = 0; a < 3; ++a)
    if (p[a] < box[0][a] || p[a] > box[1][a])
      return 0;
  if (turns_round(in, p) < 0.5)
    return 0;
  double least = HUGE_VAL;
  for (const Triangle& t : in.triangles)
    least = numeric::smaller(least, distance(in, t, p));
  return least;
}

} // namespace overlap

/// How deep nodes and edges of the one are in the other, over an edge.
inline Overlap depth_inside(const TriangleMesh& one, const TriangleMesh& other, double edge) {
  std::array<Vec3, 2> box{other.points[other.triangles[0][0]], other.points[other.triangles[0][0]]};
  for (const Triangle& t : other.triangles)
    for (const std::uint32_t i : t)
      for (int a = 0; a < 3; ++a) {
        box[0][a] = numeric::smaller(box[0][a], other.points[i][a]);
        box[1][a] = numeric::larger(box[1][a], other.points[i][a]);
      }
  Overlap most;
  for (const auto& [a, b] : overlap::edges_of(one)) {
    const Vec3 &from = one.points[a], &to = one.points[b];
    for (const Vec3& p : {from, to})
      most.nodes = numeric::larger(most.nodes, overlap::depth(other, box, p) / edge);
    for (const Vec3& p : overlap::along(from, to))
      most.edges = numeric::larger(most.edges, overlap::depth(other, box, p) / edge);
  }
  return most;
}

/// How deep edges of a surface pass through triangles of it elsewhere, which share no node with
/// the triangles around the edge's ends, over an edge: by the end that is nearer to the triangle's
/// plane, and of the triangle by the edge that is nearer to the line.
inline double depth_in_itself(const TriangleMesh& mesh, double edge) {
  std::vector<std::set<std::uint32_t>> around(mesh.points.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t i : t)
      around[i].insert(t.begin(), t.end());
  double most = 0;
  for (const auto& [i, j] : overlap::edges_of(mesh)) {
    const Vec3 &p = mesh.points[i], &q = mesh.points[j];
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
      const Vec3 n = cross(b - a, c - a);
      const double of_p = dot(n, p - a), of_q = dot(n, q - a);
      if ((of_p > 0) == (of_q > 0))
        continue;
      const Vec3 at = p + of_p / (of_p - of_q) * (q - p);
      double within = numeric::smaller(std::abs(of_p), std::abs(of_q)) / norm(n);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &from = mesh.points[t[k]], &to = mesh.points[t[(k + 1) % 3]];
        const Vec3 across = cross(q - p, to - from);
        const double inside = dot(cross(n, to - from), at - from);
        const double off = std::abs(dot(across, at - from)) / norm(across);
        within = numeric::smaller(within, inside > 0 ? off : 0);
      }
      if (!(within > most))
        continue;
      if (std::ranges::none_of(t, [&](std::uint32_t corner) {
            return around[i].contains(corner) || around[j].contains(corner);
          }))
        most = within;
    }
  }
  return most / edge;
}

} // namespace gewebe::test

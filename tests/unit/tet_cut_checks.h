#pragma once
// What must hold of every solid that a blade has cut, by code that knows nothing of how it is done.

#include "incision/cut_tetrahedra.h"
#include "larger.h"
#include "tetrahedra/check.h"
#include "tetrahedra/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace gewebe::test {

inline std::array<Vec3, 4> places_of(const tetrahedra::TetMesh& mesh, std::size_t t) {
  const Tetrahedron& c = mesh.tetrahedra[t];
  return {mesh.points[c[0]], mesh.points[c[1]], mesh.points[c[2]], mesh.points[c[3]]};
}

inline double volume_at(const tetrahedra::TetMesh& mesh, std::size_t t) {
  const auto [a, b, c, d] = places_of(mesh, t);
  return tetrahedra::tetrahedron_volume(a, b, c, d);
}

/// How far its dihedral angles keep from 0 and 180 degrees.
inline double least_margin(const tetrahedra::TetMesh& mesh, std::size_t t) {
  const auto [a, b, c, d] = places_of(mesh, t);
  double least = 180;
  for (const double angle : tetrahedra::dihedral_angles(a, b, c, d)) {
    const double degrees = angle * 180 / std::numbers::pi;
    least = numeric::smaller(least, numeric::smaller(degrees, 180 - degrees));
  }
  return least;
}

inline double area(const tetrahedra::TetMesh& mesh, const Triangle& t) {
  return norm(cross(mesh.points[t[1]] - mesh.points[t[0]], mesh.points[t[2]] - mesh.points[t[0]])) /
         2;
}

inline double wall_area(const incision::TetCut& cut) {
  double sum = 0;
  for (const incision::WallTriangle& wall : cut.wall)
    sum += area(cut.mesh, wall.corners[0]);
  return sum;
}

inline std::map<std::int32_t, long double> volumes(const tetrahedra::TetMesh& mesh) {
  std::map<std::int32_t, long double> sums;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    sums[mesh.material.empty() ? 0 : mesh.material[t]] += volume_at(mesh, t);
  return sums;
}

inline Triangle turned(Triangle face) {
  std::ranges::rotate(face, std::ranges::min_element(face));
  return face;
}

/// Faces of one tetrahedron, counter-clockwise from outside, each turned so that its least corner
/// comes first.
inline std::set<Triangle> outer_faces(const tetrahedra::TetMesh& mesh) {
  std::vector<std::array<Triangle, 2>> all; // ascending, turned
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& face : tetrahedra::tetrahedron_faces) {
      const Triangle corners{t[face[0]], t[face[1]], t[face[2]]};
      all.push_back({corners, turned(corners)});
      std::ranges::sort(all.back()[0]);
    }
  std::ranges::sort(all);
  std::set<Triangle> outer;
  for (std::size_t n = 0; n < all.size(); ++n)
    if ((n == 0 || all[n - 1][0] != all[n][0]) &&
        (n + 1 == all.size() || all[n + 1][0] != all[n][0]))
      outer.insert(outer.end(), all[n][1]);
  return outer;
}

inline std::array<double, 3> key_of(const Vec3& p) {
  return {p.x, p.y, p.z};
}

/// Does a place lie in a tetrahedron, to rounding?
inline bool is_within(const tetrahedra::TetMesh& mesh, std::size_t t, const Vec3& place) {
  const std::array<Vec3, 4> p = places_of(mesh, t);
  const double whole = tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]);
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<Vec3, 4> q = p;
    q[k] = place;
    if (!(tetrahedra::tetrahedron_volume(q[0], q[1], q[2], q[3]) >= -1e-9 * whole))
      return false;
  }
  return true;
}

/// Nodes in the middles of a triangle's edges 01, 12, 20.
inline Triangle middles_of(const tetrahedra::TetMesh& mesh, std::uint32_t t,
                           const Triangle& corners) {
  Triangle middles{};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < 6; ++k) {
      const std::set<std::uint32_t> edge{mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][0]],
                                         mesh.tetrahedra[t][tetrahedra::tetrahedron_edges[k][1]]};
      if (edge == std::set<std::uint32_t>{corners[c], corners[(c + 1) % 3]})
        middles[c] = mesh.middles[t][k];
    }
  return middles;
}

/// The first thing that is wrong, or "".
inline std::string fault_of(const tetrahedra::TetMesh& before, const incision::TetCut& cut,
                            double least_angle) {
  const tetrahedra::TetMesh& mesh = cut.mesh;
  const auto at = [](const char* what, std::size_t n) { return what + (" " + std::to_string(n)); };
  tetrahedra::check_mesh(mesh);
  const double size = norm(tetrahedra::bounding_box(before).size());
  if (cut.origin.size() != mesh.points.size() || cut.tetrahedron.size() != mesh.tetrahedra.size())
    return "sizes of origins";
  // Nodes stand where their origin says, tetrahedra have their parent's material, and shape.
  for (std::size_t n = 0; n < mesh.points.size(); ++n) {
    const incision::TetNodeOrigin& from = cut.origin[n];
    const bool node = from.node < before.points.size();
    if (node == (from.tetrahedron < before.tetrahedra.size()))
      return at("origin of node", n);
    if (n < before.points.size() && node && from.node != n)
      return at("number of node", n);
    double sum = 0;
    for (const double weight : from.weights) {
      sum += weight;
      if (!(weight >= -0.2 && weight <= 1.2))
        return at("weights of node", n);
    }
    if (!node && !(std::fabs(sum - 1) <= 1e-12))
      return at("weights of node", n);
  }
  const std::vector<Vec3> carried = incision::carry_over(before, cut.origin, before.points);
  for (std::size_t n = 0; n < mesh.points.size(); ++n)
    if (!(norm(mesh.points[n] - carried[n]) <= 1e-12 * (norm(carried[n]) + size)))
      return at("place of node", n);
  std::set<std::array<double, 3>> moved;
  for (const std::uint32_t t : cut.changed)
    for (const std::uint32_t corner : before.tetrahedra[t])
      if (cut.origin[corner].node == incision::TetNodeOrigin::none)
        moved.insert(key_of(mesh.points[corner]));
  std::vector<bool> changed(before.tetrahedra.size());
  for (const std::uint32_t t : cut.changed)
    changed[t] = true;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const std::uint32_t parent = cut.tetrahedron[t];
    if (parent >= before.tetrahedra.size() || (t < before.tetrahedra.size() && parent != t))
      return at("parent of tetrahedron", t);
    if (!before.material.empty() && mesh.material[t] != before.material[parent])
      return at("material of tetrahedron", t);
    if (!changed[parent] &&
        (mesh.tetrahedra[t] != before.tetrahedra[parent] ||
         places_of(mesh, t) != places_of(before, parent) ||
         (!before.middles.empty() && mesh.middles[t] != before.middles[parent])))
      return at("tetrahedron told to be unchanged", t);
    if (!(volume_at(mesh, t) > 0))
      return at("inverted tetrahedron", t);
    if (changed[parent] &&
        !(least_margin(mesh, t) >= std::min(least_angle, least_margin(before, parent)) - 1e-9))
      return at("angles of tetrahedron", t);
    // Corners that weren't one of the parent's stand in it, but for those that have moved.
    const Tetrahedron& own = before.tetrahedra[parent];
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t corner = mesh.tetrahedra[t][k];
      if (cut.origin[corner].node != incision::TetNodeOrigin::none
              ? std::ranges::find(own, cut.origin[corner].node) == own.end()
              : !moved.contains(key_of(mesh.points[corner])) &&
                    !is_within(before, parent, mesh.points[corner]))
        return at("corners of tetrahedron", t);
    }
  }
  const std::map<std::int32_t, long double> old_volumes = volumes(before);
  std::map<std::int32_t, long double> new_volumes = volumes(mesh);
  for (const auto& [material, volume] : old_volumes)
    if (!(std::fabs(static_cast<double>(new_volumes[material] - volume)) <=
          1e-12 * static_cast<double>(volume)))
      return at("volume of material", static_cast<std::size_t>(material));
  const tetrahedra::TetReport was = tetrahedra::examine_tetrahedra(before),
                              is = tetrahedra::examine_tetrahedra(mesh);
  if (!is.sound())
    return "faces that are crowded or overlap";
  if (was.manifold_boundary() && !is.manifold_boundary())
    return at("boundary of edges", is.nonmanifold_edges.count) +
           at(", of points", is.nonmanifold_points.count);
  if (is.curved_edges.count > was.curved_edges.count)
    return at("curved edge", is.curved_edges.first);
  if (is.unused_points.count > was.unused_points.count)
    return at("unused point", is.unused_points.first);
  // Walls are on the boundary, on either side of the same place, and all that is new on it.
  const std::set<Triangle> outer = outer_faces(mesh);
  std::set<Triangle> walls;
  for (std::size_t w = 0; w < cut.wall.size(); ++w) {
    const incision::WallTriangle& wall = cut.wall[w];
    for (std::size_t side = 0; side < 2; ++side) {
      if (!outer.contains(turned(wall.corners[side])))
        return at("wall inside the tissue", w);
      if (!walls.insert(turned(wall.corners[side])).second)
        return at("wall told twice", w);
      const Tetrahedron& t = mesh.tetrahedra[wall.tetrahedron[side]];
      for (const std::uint32_t corner : wall.corners[side])
        if (std::ranges::find(t, corner) == t.end())
          return at("tetrahedron of wall", w);
      if (!mesh.middles.empty() &&
          wall.middles[side] != middles_of(mesh, wall.tetrahedron[side], wall.corners[side]))
        return at("middles of wall", w);
    }
    bool same = true;
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh.points[wall.corners[0][k]] != mesh.points[wall.corners[1][2 - k]])
        return at("sides of wall", w);
      same = same && wall.corners[0][k] == wall.corners[1][2 - k];
    }
    if (same)
      return at("wall that is joined", w);
  }
  // The surface: what is told, and the faces that it does not replace, are all that is beside
  // walls.
  std::set<Triangle> replaced, rest;
  for (const incision::CutFace& face : cut.surface) {
    const auto n = static_cast<std::size_t>(&face - cut.surface.data());
    if (face.face_before / 4 != cut.tetrahedron[face.tetrahedron])
      return at("tetrahedron of surface", n);
    const Tetrahedron& t = before.tetrahedra[face.face_before / 4];
    const auto& old = tetrahedra::tetrahedron_faces[face.face_before % 4];
    replaced.insert(turned({t[old[0]], t[old[1]], t[old[2]]}));
    if (!rest.insert(turned(face.corners)).second)
      return at("surface told twice", n);
    for (std::size_t c = 0; c < 3; ++c) {
      Vec3 place;
      for (std::size_t k = 0; k < 3; ++k)
        place += before.points[t[old[k]]] * face.weights[c][k];
      if (!(norm(place - mesh.points[face.corners[c]]) <= 1e-12 * size))
        return at("weights of surface", n);
    }
    if (!mesh.middles.empty() && face.middles != middles_of(mesh, face.tetrahedron, face.corners))
      return at("middles of surface", n);
  }
  const std::set<Triangle> old_outer = outer_faces(before);
  for (const Triangle& face : replaced)
    if (!old_outer.contains(face))
      return "surface that was inside";
  for (const Triangle& face : old_outer)
    if (!replaced.contains(face) && !rest.insert(face).second)
      return "surface told twice";
  for (const Triangle& face : walls)
    if (!rest.insert(face).second)
      return "surface that is a wall";
  if (rest != outer)
    return "surface that is left out";
  double old_area = 0, rest_area = 0;
  for (const Triangle& face : old_outer)
    old_area += area(before, face);
  for (const Triangle& face : outer)
    rest_area += walls.contains(face) ? 0 : area(mesh, face);
  if (!(std::fabs(rest_area - old_area) <= 1e-11 * old_area))
    return "area of what was the boundary before";
  return "";
}

/// A rectangle about `centre` spanned by two vectors, as a strip of `steps` quadrilaterals along u.
inline TriangleMesh blade_strip(const Vec3& centre, const Vec3& u, const Vec3& v,
                                std::uint32_t steps = 1) {
  TriangleMesh blade;
  for (std::uint32_t n = 0; n <= steps; ++n) {
    const Vec3 at = centre + u * (2.0 * n / steps - 1);
    blade.points.push_back(at - v);
    blade.points.push_back(at + v);
    if (n > 0) {
      const std::uint32_t p = 2 * n - 2;
      blade.triangles.push_back({p, p + 2, p + 1});
      blade.triangles.push_back({p + 2, p + 3, p + 1});
    }
  }
  return blade;
}

} // namespace gewebe::test

#include "tetrahedra/clip.h"

#include "base/error.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

namespace gewebe::tetrahedra {
namespace {

/// A corner of what is left, while its number is not known: a node by its number, a crossing by
/// both ends of its edge, in the order that points are to have.
using Corner = std::uint64_t;

bool is_crossing(Corner corner) {
  return corner >> 32U != 0;
}
Corner crossing_of(std::uint32_t a, std::uint32_t b) {
  const auto [low, high] = std::minmax(a, b);
  return (Corner{low} + 1) << 32U | high;
}
std::array<std::uint32_t, 2> ends_of(Corner crossing) {
  return {static_cast<std::uint32_t>((crossing >> 32U) - 1), static_cast<std::uint32_t>(crossing)};
}

Vec3 unit_normal(const ClipPlane& plane) {
  const Vec3& n = plane.normal;
  const double largest = std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)});
  if (!is_finite(plane.point) || !is_finite(n) || !(largest > 0))
    throw Error(
        "a plane that is not finite or whose normal is 0, expected a point and a direction");
  const Vec3 scaled = n / largest;
  return scaled / norm(scaled);
}

/// Polygons of up to 4 corners.
struct Polygon {
  std::array<Corner, 4> corners{};
  std::size_t size = 0;

  void add(Corner corner) { corners[size++] = corner; }
  Corner after(std::size_t k) const { return corners[k + 1 == size ? 0 : k + 1]; }
};

class Clipper {
public:
  Clipper(const TetMesh& mesh, const ClipPlane& plane) : mesh_(mesh) {
    const Vec3 normal = unit_normal(plane), &q = plane.point;
    constexpr double unit = 4 * std::numeric_limits<double>::epsilon();
    distance_.reserve(mesh.points.size());
    side_.reserve(mesh.points.size());
    for (const Vec3& p : mesh.points) {
      const double distance = dot(normal, p - q);
      if (!std::isfinite(distance))
        throw Error("point " + std::to_string(distance_.size()) +
                    " is not at a finite distance from the plane, expected it nearer");
      double open = 0;
      for (int axis = 0; axis < 3; ++axis)
        open += std::fabs(normal[axis]) * (std::fabs(p[axis]) * unit + std::fabs(q[axis]) * unit);
      distance_.push_back(distance);
      side_.push_back(!(std::fabs(distance) > open) ? 0 : distance < 0 ? -1 : 1);
    }
  }

  TetClip clip() {
    add_boundary();
    result_.cut_begin = triangles_.size();
    add_cut();
    number_points();
    return std::move(result_);
  }

private:
  bool stays(std::uint32_t t) const {
    return std::ranges::any_of(mesh_.tetrahedra[t],
                               [&](std::uint32_t node) { return side_[node] < 0; });
  }

  /// What stays of a face with a node on that side.
  Polygon part_of(const Triangle& face) const {
    Polygon part;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % 3];
      if (side_[a] <= 0)
        part.add(a);
      if (side_[a] * side_[b] < 0)
        part.add(crossing_of(a, b));
    }
    return part;
  }

  bool in_plane(Corner corner) const { return is_crossing(corner) || side_[corner] == 0; }

  /// The polygon in the plane, seen from outside, that closes what the faces of a tetrahedron
  /// leave: their sides in the plane, each the other way round. None has fewer than 3 corners.
  Polygon section_of(std::uint32_t t) const {
    std::array<std::array<Corner, 2>, 4> sides{};
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < 4; ++k) {
      const Triangle face = corners_of(t, k);
      if (std::ranges::none_of(face, [&](std::uint32_t node) { return side_[node] < 0; }))
        continue;
      const Polygon part = part_of(face);
      for (std::size_t c = 0; c < part.size; ++c)
        if (in_plane(part.corners[c]) && in_plane(part.after(c)))
          sides[count++] = {part.after(c), part.corners[c]};
    }
    Polygon section;
    if (count < 3)
      return section;
    Corner at = sides[0][0];
    while (section.size < count) {
      section.add(at);
      for (const auto& [from, to] : std::span(sides).first(count))
        if (from == at) {
          at = to;
          break;
        }
    }
    return section;
  }

  Triangle corners_of(std::uint32_t t, std::uint32_t k) const {
    const Tetrahedron& corners = mesh_.tetrahedra[t];
    const auto& face = tetrahedron_faces[k];
    return {corners[face[0]], corners[face[1]], corners[face[2]]};
  }

  void add(const Polygon& polygon, std::uint32_t t) {
    for (std::size_t k = 2; k < polygon.size; ++k) {
      triangles_.push_back({polygon.corners[0], polygon.corners[k - 1], polygon.corners[k]});
      result_.tetrahedron.push_back(t);
      if (!mesh_.material.empty())
        result_.mesh.material.push_back(mesh_.material[t]);
    }
  }

  void add_boundary() {
    const TetBoundary surface = boundary(mesh_);
    for (std::size_t f = 0; f < surface.tetrahedron.size(); ++f) {
      const Triangle& own = surface.mesh.triangles[f];
      const Triangle face{surface.node[own[0]], surface.node[own[1]], surface.node[own[2]]};
      const std::uint32_t t = surface.tetrahedron[f];
      const auto is = [&](int side) {
        return [this, side](std::uint32_t node) { return side_[node] == side; };
      };
      if (std::ranges::any_of(face, is(-1)) || (std::ranges::all_of(face, is(0)) && stays(t)))
        add(part_of(face), t);
    }
  }

  /// Tetrahedra that stay and meet one that goes in a face in the plane, ascending.
  std::vector<std::uint32_t> faces_in_plane() const {
    std::vector<std::pair<Triangle, std::uint32_t>> faces;
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::uint32_t k = 0; k < 4; ++k) {
        Triangle face = corners_of(t, k);
        if (std::ranges::any_of(face, [&](std::uint32_t node) { return side_[node] != 0; }))
          continue;
        std::ranges::sort(face);
        faces.emplace_back(face, t);
      }
    std::ranges::sort(faces);
    std::vector<std::uint32_t> found;
    for (std::size_t n = 1; n < faces.size(); ++n) {
      const std::uint32_t a = faces[n - 1].second, b = faces[n].second;
      if (faces[n - 1].first == faces[n].first && stays(a) != stays(b))
        found.push_back(stays(a) ? a : b);
    }
    std::ranges::sort(found);
    return found;
  }

  void add_cut() {
    const std::vector<std::uint32_t> faced = faces_in_plane();
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      if (!stays(t)) {
        ++result_.tetrahedra_removed;
        continue;
      }
      const bool cut = std::ranges::any_of(mesh_.tetrahedra[t],
                                           [&](std::uint32_t node) { return side_[node] > 0; });
      result_.tetrahedra_cut += cut ? 1 : 0;
      if (cut || std::ranges::binary_search(faced, t))
        add(section_of(t), t);
    }
  }

  /// On the line between the ends, from the nearer one.
  ClipPoint origin_of(Corner corner) const {
    if (!is_crossing(corner))
      return {static_cast<std::uint32_t>(corner), static_cast<std::uint32_t>(corner), 0};
    auto [near, far] = ends_of(corner);
    if (!(std::fabs(distance_[near]) <= std::fabs(distance_[far])))
      std::swap(near, far);
    return {near, far, distance_[near] / (distance_[near] - distance_[far])};
  }
  Vec3 place_of(const ClipPoint& point) const {
    const auto& [near, far, share] = point;
    if (near == far)
      return mesh_.points[near];
    const Vec3 place = mesh_.points[near] + (mesh_.points[far] - mesh_.points[near]) * share;
    if (!is_finite(place))
      throw Error("the edge from point " + std::to_string(near) + " to " + std::to_string(far) +
                  " is too long to be cut");
    return place;
  }

  void number_points() {
    std::vector<Corner> corners;
    corners.reserve(3 * triangles_.size());
    for (const auto& triangle : triangles_)
      corners.insert(corners.end(), triangle.begin(), triangle.end());
    std::ranges::sort(corners);
    const auto [last, end] = std::ranges::unique(corners);
    corners.erase(last, end);
    if (corners.size() >= UINT32_MAX)
      throw Error(std::to_string(corners.size()) + " points, expected fewer than " +
                  std::to_string(UINT32_MAX));
    TriangleMesh& mesh = result_.mesh;
    mesh.points.reserve(corners.size());
    result_.origin.reserve(corners.size());
    for (const Corner corner : corners) {
      result_.origin.push_back(origin_of(corner));
      mesh.points.push_back(place_of(result_.origin.back()));
    }
    mesh.triangles.reserve(triangles_.size());
    const auto number = [&](Corner corner) {
      return static_cast<std::uint32_t>(std::ranges::lower_bound(corners, corner) -
                                        corners.begin());
    };
    for (const auto& [a, b, c] : triangles_)
      mesh.triangles.push_back({number(a), number(b), number(c)});
  }

  const TetMesh& mesh_;
  std::vector<double> distance_;  // of each node, mm
  std::vector<std::int8_t> side_; // -1 stays, 0 in the plane, 1 goes
  std::vector<std::array<Corner, 3>> triangles_;
  TetClip result_;
};

} // namespace

TetClip clip_tetrahedra(const TetMesh& mesh, const ClipPlane& plane) {
  return Clipper(mesh, plane).clip();
}

} // namespace gewebe::tetrahedra

#pragma once
// Convex polyhedra: the cores of instruments that are meshes. Faces are flat polygons, whatever
// triangles they came as, so that neither an edge nor a corner lies within a flat part.

#include "contact/instrument.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

class ConvexCore {
public:
  struct Face {
    Vec3 normal;                        ///< of unit length, out
    double offset = 0;                  ///< normal·y of its points; no corner is beyond
    std::vector<std::uint32_t> corners; ///< counter-clockwise seen from outside
    bool operator==(const Face&) const = default;
  };
  struct Edge {
    std::uint32_t a = 0, b = 0;        ///< a < b
    std::uint32_t left = 0, right = 0; ///< faces: one goes from a to b, the other back
  };
  /// The point of the surface that is nearest to a point.
  struct Nearest {
    Vec3 point, normal;  ///< the normal of unit length, out, to where the point is or should be
    double distance = 0; ///< below 0 inside
  };

  /// Of a mesh whose triangles go round as one, either way, and share their corners; triangles
  /// within 1e-6 of its size (the diagonal of its box) of a plane make one face.
  /// \throw Error if it has no or over 20,000 triangles, is not closed, not convex (by 1e-5 of its
  /// size at an edge or a point, which are named), or flat: thinner than 1e-3 of its size
  explicit ConvexCore(const TriangleMesh& mesh);

  std::span<const Vec3> corners() const noexcept { return corners_; }
  std::span<const Face> faces() const noexcept { return faces_; }
  std::span<const Edge> edges() const noexcept { return edges_; }
  const Box3& box() const noexcept { return box_; }
  double size() const { return norm(box_.size()); }
  /// Of the corner that is farthest from the origin.
  double reach() const noexcept { return reach_; }

  Nearest nearest(const Vec3& p) const;
  bool operator==(const ConvexCore& other) const {
    return corners_ == other.corners_ && faces_ == other.faces_;
  }

private:
  std::vector<Vec3> corners_;
  std::vector<Face> faces_;
  std::vector<Edge> edges_;
  std::vector<std::vector<std::uint32_t>> faces_at_; ///< by corner
  Box3 box_;
  double reach_ = 0;
};

/// Weights of a and b at the point between them that is nearest to p.
std::array<double, 2> weights_on_segment(const Vec3& p, const Vec3& a, const Vec3& b);

} // namespace gewebe::contact

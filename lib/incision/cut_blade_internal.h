#pragma once
// Surface swept by a blade, and its intersections with edges.

#include "collision/bvh.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe::incision {

/// Intersection of an edge with the surface.
struct BladeCrossing {
  std::size_t passes = 0;
  int direction = 0; ///< upward minus downward passes; 0: both ends are on one side
  double share = 0;  ///< position of the middle pass along the edge, 0 … 1
};

/// The swept surface, with a hierarchy of its triangles.

class Blade {
public:
  /// \throw Error as cut_tetrahedra, of the blade
  explicit Blade(const TriangleMesh& surface);

  /// Bounding box; empty without triangles.
  const Box3& box() const { return tree_.box(); }

  /// Whether the box of a triangle of the surface meets the given box.
  bool meets(const Box3& box) const;

  /// Intersection of the edge between two points. The order of the ends must depend on the edge
  /// alone, so that all callers get the same result. \pre coordinates as
  /// geometry/exact_predicates.h requires
  BladeCrossing crossing(const Vec3& from, const Vec3& to) const;

private:
  struct Side {
    std::uint32_t low = 0, high = 0;
    bool backward = false, border = false;
  };
  struct Leaf {
    Triangle corners{};
    std::array<Side, 3> sides{};
  };
  struct Pass {
    double share = 0;
    int direction = 0;
  };
  std::optional<Pass> pass(const Leaf& leaf, const Vec3& p, const Vec3& q) const;

  std::vector<Vec3> points_;
  std::vector<Leaf> leaves_;
  collision::Bvh tree_; // of the leaves
};

} // namespace gewebe::incision

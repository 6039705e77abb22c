#pragma once
// The surface that a blade has swept: which edges pass through it.

#include "base/mesh.h"
#include "base/vec3.h"
#include "collision/bvh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe {

/// How an edge passes through it.
struct BladeCrossing {
  std::size_t passes = 0;
  int direction = 0; ///< upward minus downward passes; 0: both ends are on one side
  double share = 0;  ///< of the way at the middle one of the passes, 0 … 1
};

class Blade {
public:
  /// \throw Error as cut_tetrahedra, of the blade
  explicit Blade(const TriangleMesh& surface);

  /// Of all of it; empty without triangles.
  const Box3& box() const { return tree_.box(); }

  /// May the surface come into the box? (By boxes of its triangles.)
  bool meets(const Box3& box) const;

  /// On the way between two points. Which end of an edge comes first must depend on the edge alone,
  /// so that all who ask hear the same. \pre coordinates that the predicates take
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

} // namespace gewebe

#pragma once
// The nodes of a model's surface in blocks of neighbours, each with the box of its shape, so that
// who looks for nodes near something asks few of them.

#include "base/vec3.h"
#include "contact/instrument.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// By node: the normal at rest that points into the object, as long as the area around; 0 without
/// triangles.
std::vector<Vec3> inward_directions(const Model& model);

class SurfaceBlocks {
public:
  /// Of all nodes but the central ones and those inside of tetrahedra. \pre check_model(model)
  /// passes
  explicit SurfaceBlocks(const Model& model);

  /// The shape from now on: 3 n displacements from rest.
  void set_shape(const Model& model, std::span<const double> displacement);

  const Box3& box() const noexcept { return box_; }

  /// Calls visit(node) for all nodes in the box, and for others near it.
  template <class Visit>
  void visit_near(const Box3& box, Visit&& visit) const {
    if (!near(box, box_))
      return;
    for (std::size_t b = 0; b < boxes_.size(); ++b)
      if (near(box, boxes_[b]))
        for (std::size_t k = first_[b]; k < first_[b + 1]; ++k)
          visit(nodes_[k]);
  }

private:
  std::vector<std::uint32_t> nodes_;
  std::vector<std::size_t> first_; ///< of each block, and the end
  std::vector<Box3> boxes_;
  Box3 box_;
};

} // namespace gewebe

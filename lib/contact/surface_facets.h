#pragma once
// The surface of a model in blocks of neighbouring pieces, each with the box of its shape, so that
// who looks for surface near something asks little of it.

#include "base/vec3.h"
#include "contact/instrument.h"
#include "contact/node_reach.h"
#include "contact/surface_point.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// By node: the normal at rest that points into the object, as long as the area around; 0 without
/// triangles.
std::vector<Vec3> inward_directions(const Model& model);

/// The box of 3 n displacements; passes over a NaN.
Box3 range_of(std::span<const double> displacement);

class SurfaceFacets {
public:
  /// Of all triangles, and of each node that has none, but for central nodes and those inside of
  /// tetrahedra. \pre check_model(model) passes
  explicit SurfaceFacets(const Model& model);

  /// The shape from now on: 3 n displacements from rest, of the nodes of the surface at least.
  void set_shape(const Model& model, std::span<const double> displacement);
  /// As set_shape for whoever looks near these places alone: boxes of pieces apart from all of them
  /// are larger than what they hold, and box() is. Takes a fraction of the time.
  void set_shape_near(const Model& model, std::span<const double> displacement,
                      std::span<const Box3> places);

  // For whoever knows the shape in part, block by block.
  /// Boxes that hold all pieces, however they are displaced within this reach.
  void set_reach(const NodeReach& reach);
  /// Boxes of pieces at these nodes hold the nodes where they are.
  void add_places(const Model& model, std::span<const double> displacement,
                  std::span<const std::uint32_t> nodes);
  /// Of which pieces may reach into one of these places.
  std::vector<std::size_t> blocks_near(std::span<const Box3> places) const;
  std::span<const std::uint32_t> nodes_of(std::size_t block) const {
    return std::span(nodes_).subspan(first_node_[block],
                                     first_node_[block + 1] - first_node_[block]);
  }
  /// The boxes of these blocks alone; box() stays.
  void set_boxes(const Model& model, std::span<const double> displacement,
                 std::span<const std::size_t> blocks);

  const Box3& box() const noexcept { return box_; }
  /// range_of the shape, if set_shape_near has had to know it.
  const std::optional<Box3>& range() const noexcept { return range_; }
  std::span<const Facet> facets() const noexcept { return facets_; }
  /// Numbers of the pieces at a node, ascending.
  std::span<const std::uint32_t> at_node(std::uint32_t node) const {
    return std::span(of_node_).subspan(first_of_node_[node],
                                       first_of_node_[node + 1] - first_of_node_[node]);
  }

  /// Calls visit(number) for all pieces that may reach into the box.
  template <class Visit>
  void visit_near(const Box3& box, Visit&& visit) const {
    if (!near(box, box_))
      return;
    for (std::size_t b = 0; b < boxes_.size(); ++b)
      if (near(box, boxes_[b]))
        for (std::size_t k = first_[b]; k < first_[b + 1]; ++k)
          visit(static_cast<std::uint32_t>(k));
  }

private:
  Box3 box_of(const Model& model, std::span<const double> displacement, std::size_t block) const;

  void group_blocks(const NodeReach& reach);

  std::vector<Facet> facets_;
  std::vector<std::size_t> first_; ///< piece of each block, and the end
  std::vector<Box3> boxes_, rest_;
  std::vector<std::uint32_t> nodes_;    ///< of the blocks' pieces, ascending in each
  std::vector<std::size_t> first_node_; ///< of each block, and the end
  std::shared_ptr<const std::vector<std::uint32_t>> group_; ///< of nodes, that the next are of
  std::vector<std::uint32_t> block_groups_;                 ///< ascending in each block
  std::vector<std::size_t> first_group_;                    ///< of each block, and the end
  Box3 box_, rest_box_;
  std::optional<Box3> range_;
  std::vector<std::uint32_t> of_node_;
  std::vector<std::size_t> first_of_node_;
};

} // namespace gewebe

#pragma once
// Check for implausible shapes: inverted triangles and lost volume.

#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::statics {

/// Faults of a shape.
struct ShapeFaults {
  std::size_t turned = 0;     ///< number of triangles that are inverted against their neighbours
  std::uint32_t triangle = 0; ///< the first of them
  double volume = 0;          ///< change over the volume at rest; 0 for an open surface
  double strain = 0;          ///< largest change of an edge's length over its length
  std::uint32_t i = 0, j = 0; ///< that edge
};

/// Compares shapes with the model at rest. A triangle counts as inverted if its normal points
/// against the sum of the normals at its corners, weighted by area, and at rest it did not. A body
/// that rotates as a whole has no inverted triangle.
class ShapeCheck {
public:
  explicit ShapeCheck(const model::Model& model);
  /// Finds the faults of a shape. Time is linear in nodes, triangles and edges.
  /// \pre the model is that of the constructor; `displacement` has 3 numbers for each of its nodes,
  /// or for the first ones, with all corners of triangles and ends of springs among them
  ShapeFaults look(const model::Model& model, std::span<const double> displacement) const;
  double shortest_edge() const noexcept { return shortest_edge_; }

private:
  std::vector<bool> turned_; ///< by triangle, at rest
  bool closed_ = false;
  double volume_ = 0, shortest_edge_ = 0;
};

} // namespace gewebe::statics

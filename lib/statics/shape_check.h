#pragma once
// Whether a shape is still that of the body it began as: faces turned over, volume lost.

#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// What of a shape no tissue would do.
struct ShapeFaults {
  std::size_t turned = 0;     ///< triangles that are turned over against those around
  std::uint32_t triangle = 0; ///< the first of them
  double volume = 0;          ///< change over the volume at rest; 0 for an open surface
  double strain = 0;          ///< largest change of an edge's length over its length
  std::uint32_t i = 0, j = 0; ///< that edge
};

/// A model at rest, kept to compare its shapes with. A triangle counts as turned over if its normal
/// points against the sum of the normals at its corners, weighted by area, where at rest it did
/// not: so a body that turns as a whole has none.
class ShapeCheck {
public:
  explicit ShapeCheck(const Model& model);
  /// Time grows with nodes, triangles and edges. \pre the model is the one given, `displacement`
  /// has 3 numbers for each of its nodes, or for the first ones, with all corners of triangles and
  /// ends of springs among them
  ShapeFaults look(const Model& model, std::span<const double> displacement) const;
  double shortest_edge() const noexcept { return shortest_edge_; }

private:
  std::vector<bool> turned_; ///< by triangle, at rest
  bool closed_ = false;
  double volume_ = 0, shortest_edge_ = 0;
};

} // namespace gewebe

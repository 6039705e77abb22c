#pragma once
// Selection of springs and edges for a cut: springs between nodes, a plane, the area that a blade
// sweeps, springs that tear.
//
// A triangle is on the side of its centre. Edges between triangles of different sides are opened if
// their midpoints project into the area. A triangle that would hang by one edge goes to the other
// side, so that the rim has no loose teeth. A spring without a triangle is severed if it pierces
// the area. At a node with triangles it starts in their centres, because the node itself is on the
// cut.

#include "cutting/cut.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::cutting {

/// Springs of any kind from a node of `from` to one of `to`; both ascend.
/// \throw Error if there is none
Cut springs_between(const model::Model& model, std::span<const std::uint32_t> from,
                    std::span<const std::uint32_t> to);

struct CutPlane {
  Vec3 point, normal; ///< normal != 0

  bool operator==(const CutPlane&) const = default;
};

/// Cut by a plane through the model at rest; with `nodes` (ascending, not empty) only of edges with
/// both ends among them, and of springs from these to central nodes.
/// \throw Error if the plane misses the model
Cut plane_cut(const model::Model& model, const CutPlane& plane,
              std::span<const std::uint32_t> nodes);

/// Corners of an area, in order.
using SweptQuad = std::array<Vec3, 4>;

/// Cut by areas, with nodes displaced from rest by 3 n numbers (empty: at rest). It may be empty.
Cut swept_cut(const model::Model& model, std::span<const double> displacement,
              std::span<const SweptQuad> areas);

/// Tears at springs that are longer than (1 + strain) times their rest length. An edge of the
/// surface opens the surface across itself, at the end with the larger pull of springs. If that is
/// impossible the edge is removed; other springs are removed too. It may be empty. \pre strain > 0
Cut torn_cut(const model::Model& model, std::span<const double> displacement, double strain);

} // namespace gewebe::cutting

#pragma once
// What a cut severs: springs between nodes, a plane, the area that a blade sweeps, springs that
// tear.
//
// A triangle is on the side of the area on which its middle lies. Edges between triangles of
// different sides come apart where their midpoints project into the area. A triangle that would
// hang by one edge goes to the other side, which leaves a rim without loose teeth. A spring without
// a triangle is severed if it pierces the area; of a node with triangles it starts in their
// middles, for the node itself stands on the cut.

#include "model/cut.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Springs of any kind from a node of `from` to one of `to`; both ascend.
/// \throw Error if there is none
Cut springs_between(const Model& model, std::span<const std::uint32_t> from,
                    std::span<const std::uint32_t> to);

struct CutPlane {
  Vec3 point, normal; ///< normal != 0

  bool operator==(const CutPlane&) const = default;
};

/// Where the plane passes through the model at rest; with `nodes` (ascending, not empty) only edges
/// with both ends among them, and springs to central nodes from these. \throw Error if it misses
Cut plane_cut(const Model& model, const CutPlane& plane, std::span<const std::uint32_t> nodes);

/// Corners of an area, one after the other round it.
using SweptQuad = std::array<Vec3, 4>;

/// What lies in the areas when nodes are displaced from rest by these 3 n numbers (none: not); may
/// be empty.
Cut swept_cut(const Model& model, std::span<const double> displacement,
              std::span<const SweptQuad> areas);

/// What gives way where springs are longer than (1 + strain) times their rest length. An edge of
/// the surface opens the surface at that end where springs pull more, across itself; where it
/// can't, it is removed, and so are other springs. May be empty. \pre strain > 0
Cut torn_cut(const Model& model, std::span<const double> displacement, double strain);

} // namespace gewebe

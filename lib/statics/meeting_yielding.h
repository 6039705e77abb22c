#pragma once
// Surfaces that touch each other, or themselves, as what gives way to instruments: an object whose
// nodes push each other by pairs of a node and a triangle (contact/surface_pairs.h), unilateral and
// with Coulomb friction. What presses the node along the normal presses the triangle's corners the
// other way, by the weights of the point, so that action is reaction to rounding.
//
// In turn: the pairs' points and normals where the nodes were last; their forces (contact_solver.h)
// with the Delassus operator B W Bᵀ, B the weights of nodes and corners; where these put the nodes,
// until the points stay. Who asks what instruments can do meets the object with the pairs that push
// held together, W - W Cᵀ (C W Cᵀ)⁻¹ C W. Nodes that are behind a triangle in the whole shape join,
// then what has passed each other on the way there, nodes and triangles or two edges, and it begins
// again: nothing passes unless it is told that the forces are not solved. What overlaps when a step
// begins comes apart by a twentieth of an edge a step.

#include "contact/surface_pairs.h"
#include "statics/static_contact.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

/// The instrument of a NodeTouch that another surface is.
inline constexpr std::uint32_t other_surface = UINT32_MAX;

/// Of an edge: so deep is not inside.
inline constexpr double surface_depth = 1e-4;

/// A pair and the force on its first part; the second has the opposite one.
struct SurfacePush {
  SurfacePair pair;
  Vec3 force{};
  bool fresh = false; ///< points and normal are taken as they are, once
};

class MeetingYielding final : public Yielding {
public:
  /// Keeps references. \param held whether a node gives way along no axis \param was displacements
  /// when the step began \param kept of the last step \param most_turns behind which its forces are
  /// told not to be exact
  MeetingYielding(Yielding& object, SurfacePairs& pairs, std::function<bool(std::uint32_t)> held,
                  std::span<const double> was, std::vector<SurfacePush> kept, int most_turns = 400);
  ~MeetingYielding() override;

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  std::span<const double> shape() override;

  /// Sums of the pairs' forces on nodes, by ascending ones.
  std::vector<NodeTouch> touches() const;
  /// Those that push or nearly touch, for the next step.
  std::vector<SurfacePush> kept() const;
  /// Whether the last forces meet the conditions.
  bool solved() const noexcept;
  TouchCounts counts() const;

private:
  class Work;
  std::unique_ptr<Work> work_;
};

} // namespace gewebe

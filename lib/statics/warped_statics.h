#pragma once
// Corotational statics: elastostatic method of a solid with large rotations. It uses
// statics/rotation_warp.h over the compliance of the linear method, by stored columns or a factor.
//
// Forces on up to 64 nodes, reactions of displaced nodes and forces on touched nodes are applied by
// the nodes' columns. Weight, and forces on more nodes or on inner ones, are rotated back and
// solved for. The iteration starts from the last answer. An answer is therefore a value, and a
// rollback restores it. The same start and load give the same answer, to the bit.

#include "base/context.h"
#include "contact/load.h"
#include "model/model.h"
#include "statics/rotation_warp.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::compliance {
class ComplianceSource;
} // namespace gewebe::compliance

namespace gewebe::statics {

/// Stopping criterion: largest change by an iteration, over the largest displacement.
inline constexpr double warp_tolerance = 1e-3;

/// Solution for a load, and start of the next iteration.
struct WarpedAnswer {
  contact::Load load;
  contact::Load whole; ///< the part of `load` that is solved for, not applied by columns
  WarpState state;
};

/// Work of a WarpedStatics.
struct WarpedCounts {
  std::uint64_t updates = 0, unchanged = 0, shapes = 0; ///< as ElastostaticCounts
  std::uint64_t solves = 0, factors = 0, columns_read = 0;
  std::uint64_t rounds = 0; ///< iterations
  double change = 0;        ///< largest change by a last iteration, relative: as WarpState
};

/// Corotational elastostatic solver of one solid.
class WarpedStatics {
public:
  /// Keeps a reference to the model.
  /// \param source  of its compliance; null: K is factorised
  /// \pre check_model(model) passes; the source belongs to the model
  /// \throw Error if the model has no tetrahedra, or a node that belongs to none; as RotationStrain
  /// and the factor
  WarpedStatics(const model::Model& model, std::shared_ptr<compliance::ComplianceSource> source,
                const Context& context);
  ~WarpedStatics();
  WarpedStatics(WarpedStatics&&) noexcept;

  /// Computes the answer to `load`. For the last load nothing is done.
  /// \param touched  further nodes whose columns apply forces, ascending
  /// \throw Error if a displaced or touched node is inside, there are more than 1,000 of them,
  /// columns can't be read, or the answer isn't finite
  void update(const contact::Load& load, std::span<const std::uint32_t> touched = {});
  std::shared_ptr<const WarpedAnswer> answer() const noexcept;
  /// Rolls back to an earlier answer; null: to none.
  void restore(std::shared_ptr<const WarpedAnswer> answer);

  /// Displacement of the first surface_count(model) nodes: 3 numbers each, mm. Displaced nodes have
  /// exactly their prescribed displacements.
  std::span<const double> surface_displacement();
  /// The same of all nodes. It needs one solve for each answer.
  std::span<const double> displacement();
  /// Displacements of all nodes whose small strains are those of the shape, in frames that rotate
  /// with it.
  std::span<const double> local_displacement();
  /// Reactions of the displaced nodes, by ascending node.
  std::vector<contact::NodeVector> holding_forces() const;

  /// Compliance of the nodes near the last answer, the Delassus operator: 3 m × 3 m.
  /// \pre the nodes were among `touched` of the last update
  std::vector<double> compliance_at(std::span<const std::uint32_t> nodes);

  WarpedCounts counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::statics

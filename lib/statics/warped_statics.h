#pragma once
// The elastostatic method of a solid that turns far: solid/rotation_warp.h over the compliance that
// the linear method has, stored columns and factor alike.
//
// Forces on up to 64 nodes, and what holds displaced ones or those that instruments touch, count by
// the nodes' columns; weight, forces on more nodes and on inner ones are turned back and solved
// for. An answer starts from the one before, so it is kept as a value: going back to it is going
// back to how things go on. From the same answer and load comes the same one, to the bit.

#include "base/context.h"
#include "contact/load.h"
#include "model/model.h"
#include "solid/rotation_warp.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

class ComplianceSource;

/// How far rounds go on: until one changes the answer by less, over the largest displacement.
inline constexpr double warp_tolerance = 1e-3;

struct WarpedAnswer {
  Load load;
  Load whole; ///< what of it is solved for
  WarpState state;
};

struct WarpedCounts {
  std::uint64_t updates = 0, unchanged = 0, shapes = 0; ///< as ElastostaticCounts
  std::uint64_t solves = 0, factors = 0, columns_read = 0;
  std::uint64_t rounds = 0;
  double change = 0; ///< largest of a last round, over the largest displacement: as WarpState
};

class WarpedStatics {
public:
  /// Keeps a reference to the model. \param source null: K is factorised
  /// \pre check_model(model) passes; the source belongs to it   \throw Error if it has no
  /// tetrahedra, or a node of none; as RotationStrain and the factor
  WarpedStatics(const Model& model, std::shared_ptr<ComplianceSource> source,
                const Context& context);
  ~WarpedStatics();
  WarpedStatics(WarpedStatics&&) noexcept;

  /// The answer to `load`; the last one if it is to that. \param touched further nodes, ascending,
  /// by whose columns forces are to come \throw Error if a displaced or touched node is inside,
  /// there are more than 1,000 of them, columns can't be read, or the answer isn't finite
  void update(const Load& load, std::span<const std::uint32_t> touched = {});
  std::shared_ptr<const WarpedAnswer> answer() const noexcept;
  /// As if that had been the last answer; null: none.
  void restore(std::shared_ptr<const WarpedAnswer> answer);

  /// Of the first surface_count(model) nodes, and of all: 3 numbers each, mm; displaced nodes stand
  /// exactly where they must. The latter by a solve, once for each answer.
  std::span<const double> surface_displacement();
  std::span<const double> displacement();
  /// The displacements of all nodes whose small strains are those of the shape, in frames that turn
  /// with it.
  std::span<const double> local_displacement();
  /// What holds the displaced nodes, by ascending node.
  std::vector<NodeVector> holding_forces() const;

  /// How nodes give way to forces near the last answer, as the Delassus operator has it: 3 m × 3 m.
  /// \pre they were among `touched` of the last update
  std::vector<double> compliance_at(std::span<const std::uint32_t> nodes);

  WarpedCounts counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe

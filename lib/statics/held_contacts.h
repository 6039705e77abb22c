#pragma once
// Solver for prescribed displacements that holds their axes in K: K_ff u_f = f - K_fc d, f_c = K_cf
// u_f + K_cc d.

#include "base/context.h"
#include "columns/column_cache.h"
#include "compliance/axis_solver.h"
#include "compliance/shape_modes.h"
#include "contact/load.h"
#include "fem/model_stiffness.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// Shapes and reactions under prescribed displacements. It caches the factor for the last nodes.
class HeldContacts {
public:
  /// Keeps a reference to the model.
  /// \param free  whether K is singular; displacements may then fail to hold the model
  HeldContacts(const Model& model, const Context& context, bool free)
      : model_(model), context_(context), free_(free), axes_(3 * model.nodes.size()) {}
  HeldContacts(const HeldContacts&) = delete;
  HeldContacts& operator=(const HeldContacts&) = delete;

  /// Computes the shape under a load. \return reactions of its displaced nodes, by ascending node
  /// \throw Error as the factor
  /// \throw SingularStiffness if a free model can move nevertheless
  std::vector<NodeVector> meet(const Load& now, std::vector<double>& u);
  /// Columns of the compliance with the nodes of the last load held. \pre a load was met
  const ColumnCache& columns(std::span<const std::uint32_t> nodes);

  std::uint64_t factors() const noexcept { return factors_; }
  std::uint64_t solves() const noexcept { return solves_; }

private:
  void refactor(const Load& now);
  void solve(std::span<double> over_axes, std::size_t columns);
  void shape_under(std::span<const double> f, std::span<const double> prescribed,
                   std::vector<double>& shape);

  const Model& model_;
  const Context& context_;
  bool free_;
  std::size_t axes_; ///< 3 n
  std::optional<StiffnessOperator> stiffness_;
  std::map<std::uint32_t, Vec3> nodes_;
  std::optional<AxisSolver> held_; ///< empty if no axis is free
  std::optional<ColumnCache> columns_;
  ShapeModes modes_; ///< displacements to shape
  std::map<std::uint32_t, Vec3> base_force_;
  Vec3 base_gravity_;
  std::vector<double> base_; ///< the shape with all displacements 0, under these; empty: unknown
  std::uint64_t factors_ = 0, solves_ = 0;
};

} // namespace gewebe

#pragma once
// Solver for prescribed displacements that holds their axes in K: K_ff u_f = f - K_fc d, f_c = K_cf
// u_f + K_cc d.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "columns/column_cache.h"
#include "compliance/axis_solver.h"
#include "compliance/shape_modes.h"
#include "contact/load.h"
#include "fem/model_stiffness.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::statics {

/// Shapes and reactions under prescribed displacements. It caches the factor for the last nodes.
class HeldContacts {
  struct Held;

public:
  /// Shapes of rigid motions, whose bits depend on the displacements before, and the factor for
  /// their nodes. Copies share them.
  struct Past {
    std::shared_ptr<Held> held{};
    CopyOnWrite<compliance::ShapeModes> modes{}; ///< displacements to shape
  };
  const Past& past() const noexcept { return now_; }
  void restore(const Past& past) { now_ = past; }

  /// Keeps a reference to the model.
  /// \param free  whether K is singular; displacements may then fail to hold the model
  HeldContacts(const model::Model& model, const Context& context, bool free)
      : model_(model), context_(context), free_(free), axes_(3 * model.nodes.size()) {}
  HeldContacts(const HeldContacts&) = delete;
  HeldContacts& operator=(const HeldContacts&) = delete;

  /// Computes the shape under a load. \return reactions of its displaced nodes, by ascending node
  /// \throw Error as the factor
  /// \throw SingularStiffness if a free model can move nevertheless
  std::vector<contact::NodeVector> meet(const contact::Load& now, std::vector<double>& u);
  /// Columns of the compliance with the nodes of the last load held. \pre a load was met
  const columns::ColumnCache& columns(std::span<const std::uint32_t> nodes);

  std::uint64_t factors() const noexcept { return factors_; }
  std::uint64_t solves() const noexcept { return solves_; }

private:
  void refactor(const contact::Load& now);
  void solve(const Held& held, std::span<double> over_axes, std::size_t columns);
  void shape_under(std::span<const double> f, std::span<const double> prescribed,
                   std::vector<double>& shape);

  const model::Model& model_;
  const Context& context_;
  bool free_;
  std::size_t axes_; ///< 3 n
  std::optional<fem::StiffnessOperator> stiffness_;
  /// What follows from the displaced nodes.
  struct Held {
    std::map<std::uint32_t, Vec3> nodes;
    std::optional<compliance::AxisSolver> solver; ///< empty if no axis is free
    std::optional<columns::ColumnCache> columns;
    std::map<std::uint32_t, Vec3> base_force;
    Vec3 base_gravity;
    std::vector<double> base; ///< the shape with all displacements 0, under these; empty: unknown
  };
  Past now_;
  std::uint64_t factors_ = 0, solves_ = 0;
};

} // namespace gewebe::statics

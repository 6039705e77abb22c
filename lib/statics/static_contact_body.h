#pragma once
// Elastostatic objects as the contact solver sees them (contact/step.h): x_free is the shape under
// the load without contact, W the compliance C between vertices.

#include "contact/contact_body.h"
#include "contact/island.h"
#include "contact/load.h"
#include "geometry/vector_at.h"
#include "model/model.h"
#include "statics/elastostatic.h"
#include "statics/two_step.h"
#include "statics/warped_statics.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace gewebe::statics {

/// Displacement of an object, and forces on it.
struct StaticContactState {
  const model::Model* model = nullptr;
  const contact::ModelSurface* surface = nullptr;
  const contact::Load* load = nullptr; ///< at the end of the step
  /// At its beginning, of the surface: of node i at 3 i, or of vertex k at 3 place[k] where given.
  std::span<const double> displacement{};
  std::span<const std::uint32_t> place{};
  std::vector<contact::VertexForce> forces{}; ///< contact forces at its beginning
  /// Throws if a shape before contact is so far off that no contact could be found.
  std::function<void(std::span<const double>)> require_shape{};
};

/// Base of the contact bodies of all static methods. Nonlinear bodies move by their quadratic
/// models, so that they pass through no other body, until the models agree with the shape under the
/// forces.
class StaticContactBody : public contact::ContactBody {
public:
  explicit StaticContactBody(StaticContactState state);

  std::size_t vertex_count() const override { return state_.surface->node.size(); }
  void positions(std::span<Vec3> x) override;
  double linearise(std::span<const contact::VertexForce> forces, std::span<Vec3> step) override;
  std::vector<contact::VertexForce> last_forces() const override { return state_.forces; }
  void compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                  std::span<contact::Block3> blocks) override;
  void move(double share, std::span<const contact::VertexForce> forces) override;
  bool keep_momentum(double room) override;
  bool is_led() const override { return !state_.load->displacement.empty(); }
  double typical_force() const override { return state_.surface->typical.force; }
  double vertex_stiffness() const override { return state_.surface->typical.stiffness; }

  /// Displacement of the surface's nodes, laid out as that of the state.
  std::span<const double> displacement() const { return displacement_; }
  /// That of a vertex.
  Vec3 displacement_of(std::uint32_t vertex) const {
    return vector_at(std::span<const double>(displacement_), place_of(vertex));
  }
  /// Load with contact forces.
  const contact::Load& acting() const { return acting_; }

protected:
  const contact::Load& load() const { return *state_.load; }
  const model::Model& model() const { return *state_.model; }

private:
  std::uint32_t place_of(std::size_t vertex) const {
    return state_.place.empty() ? state_.surface->node[vertex] : state_.place[vertex];
  }
  /// Displacement under a load, of the surface's nodes at least.
  virtual std::span<const double> shape_under(const contact::Load& load) = 0;
  /// Error of shape_under, over the largest displacement.
  virtual double shape_tolerance() const { return 0; }
  /// Blocks [row][force] of the compliance near the last shape. \param nodes  rows
  virtual void blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                         std::span<contact::Block3> blocks) = 0;
  void act(std::span<const contact::VertexForce> forces);

  StaticContactState state_;
  contact::Load acting_;
  std::vector<double> displacement_, begin_, step_;
  // Of the quadratic model.
  std::vector<double> shape_; ///< under `forces_`
  std::vector<contact::VertexForce> forces_;
  std::vector<std::uint32_t> rows_; ///< vertices whose compliance was computed
};

/// Body of the linear method.
class ElastostaticContactBody final : public StaticContactBody {
public:
  /// \param solver  called when the solver is needed
  /// \param clusters  that the displacement is of, where it is not that of the surface: then loads
  /// are forces alone
  ElastostaticContactBody(StaticContactState state, std::function<Elastostatic&()> solver,
                          std::span<const std::uint32_t> clusters = {})
      : StaticContactBody(std::move(state)), solver_(std::move(solver)), clusters_(clusters) {}
  bool is_linear() const override { return true; }
  std::uint64_t matrix_id() const override { return solver_().compliance_id(load()); }

private:
  std::span<const double> shape_under(const contact::Load& load) override;
  void blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                 std::span<contact::Block3> blocks) override;
  std::function<Elastostatic&()> solver_;
  std::span<const std::uint32_t> clusters_;
  std::vector<double> shape_; ///< of these
};

/// Body of the two-step method: linear for a given share of both stages.
class TwoStepContactBody final : public StaticContactBody {
public:
  using Stages = std::function<std::pair<Elastostatic&, TwoStep&>()>;
  TwoStepContactBody(StaticContactState state, Stages stages)
      : StaticContactBody(std::move(state)), stages_(std::move(stages)) {}
  bool is_linear() const override { return false; }

private:
  std::span<const double> shape_under(const contact::Load& load) override;
  void blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                 std::span<contact::Block3> blocks) override;
  Stages stages_;
};

/// Body with large rotations.
class WarpedContactBody final : public StaticContactBody {
public:
  WarpedContactBody(StaticContactState state, std::function<WarpedStatics&()> solver)
      : StaticContactBody(std::move(state)), solver_(std::move(solver)) {}
  bool is_linear() const override { return false; }

private:
  std::span<const double> shape_under(const contact::Load& load) override;
  double shape_tolerance() const override { return warp_tolerance; }
  void blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                 std::span<contact::Block3> blocks) override;
  std::function<WarpedStatics&()> solver_;
  std::vector<std::uint32_t> touched_;
  std::vector<double> compliance_; ///< between these
};

} // namespace gewebe::statics

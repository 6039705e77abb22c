#pragma once
// A solid, or a net with implicit steps, as the contact solver sees it. Its compliance is that of
// the quadratic models of integrator/solid_motion.h, in frames that rotate with the nodes or in the
// fixed frame.

#include "base/context.h"
#include "contact/contact_body.h"
#include "contact/island.h"
#include "integrator/solid_motion.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::dynamics {

/// Contact body of one SolidMotion.
class SolidContactBody final : public contact::ContactBody {
public:
  /// \param vertices  nodes of the collision surface, ascending. Keeps references to all.
  SolidContactBody(integrator::SolidMotion& motion, const std::vector<std::uint32_t>& vertices,
                   std::size_t nodes)
      : motion_(motion), vertices_(vertices), axes_(3 * nodes) {}

  /// Begins a step, at rest if h is infinite. \pre SolidMotion::begin_step was called
  /// \param last  forces at the end of the last step
  /// \param typical  force, and stiffness without inertia, see ContactBody
  void begin(double h, std::vector<contact::VertexForce> last,
             const contact::TypicalContact& typical, const Context& context);
  /// Calls `set_load` before each model is built, for a load that follows positions; null: none
  /// does.
  void follow(std::function<void()> set_load) { set_load_ = std::move(set_load); }
  /// The step's contact forces over the 3 n axes.
  std::span<const double> forces() const { return forces_; }

  std::size_t vertex_count() const override { return vertices_.size(); }
  void positions(std::span<Vec3> x) override;
  double linearise(std::span<const contact::VertexForce> forces, std::span<Vec3> step) override;
  std::vector<contact::VertexForce> last_forces() const override { return last_; }
  void prepare(std::span<const std::uint32_t> vertices) override;
  void compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                  std::span<contact::Block3> blocks) override;
  contact::Block3 frame(std::uint32_t vertex) const override {
    return motion_.frame_of(vertices_[vertex]);
  }
  std::uint64_t matrix_id() const override {
    return motion_.relaxation() == 1 ? motion_.matrix_version() : 0;
  }
  void move(double share, std::span<const contact::VertexForce> forces) override;
  bool keep_momentum(double room) override {
    return motion_.keep_momentum(forces_, room, context_);
  }
  bool model_holds() override { return motion_.model_holds(forces_, context_); }
  void sharpen() override { motion_.sharpen(); }
  bool solve_alone() override;
  void begin_again() override { motion_.begin_iterate_again(); }
  std::optional<contact::EnergyGain> energy_gain() override;
  void slow_down(double factor) override { inner_factor_ = factor; }
  /// Of speeds at the end of the step.
  double inner_factor() const { return inner_factor_; }
  bool is_led() const override { return motion_.moves_held(); }
  bool is_linear() const override { return false; }
  double typical_force() const override { return typical_force_; }
  double vertex_stiffness() const override { return stiffness_; }

private:
  void make_room(std::span<const std::uint32_t> vertices, std::size_t more);
  void spread(std::span<const contact::VertexForce> forces);

  integrator::SolidMotion& motion_;
  const std::vector<std::uint32_t>& vertices_;
  std::size_t axes_;
  Context context_;
  double h_ = 0, typical_force_ = 0, stiffness_ = 0, inner_factor_ = 1;
  std::function<void()> set_load_;
  std::vector<contact::VertexForce> last_;
  std::vector<double> step_, forces_;
  std::vector<double> linearised_; ///< forces of the quadratic model's state, 3 n
  /// Responses to unit forces with one matrix.
  struct Columns {
    std::uint64_t version = 0;
    /// By vertex: at all vertices in their frames, three columns of 3 numbers.
    std::map<std::uint32_t, std::vector<double>> of;
  };
  Columns columns_, others_; ///< of the present matrix, and of the one before: the constant matrix
                             ///< serves again behind a tangent
};

} // namespace gewebe::dynamics

#pragma once
// Elastodynamic method: integration of masses and springs (report 3.1.3).
//
// Semi-implicit Euler, with all F of the old state:
//
//   v' = v + h/m (F(u, v) + f + m g),   u' = u + h v'.
//
// Models that are too stiff for this use the implicit steps of solids (dynamics/solid_dynamic.h).
// Axes that the model holds do not move. A displaced node stands at its displacement with velocity
// 0, or is on its way there. Results are the same bytes for any number of threads.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "contact/load.h"
#include "dynamics/body_motion.h"
#include "dynamics/spring_force.h"
#include "dynamics/spring_layout.h"
#include "model/model.h"

#include <any>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::dynamics {

/// The default integration step over safe_step(model): below 1, since stability is proven for the
/// model at rest alone.
inline constexpr double safe_step_fraction = 0.9;

/// Explicit integration of a net.
class Elastodynamic final : public BodyMotion {
public:
  /// Starts at rest. Keeps a reference to the model.
  /// \pre check_model(model) passes   \throw Error if a node can move but has no mass
  explicit Elastodynamic(const model::Model& model);

  void set_load(const contact::Load& load, double time = 0) override;
  std::uint64_t advance(double duration, const TimeSteps& of, const Context& context,
                        double start = 0) override;

  /// The object is at rest if its velocity is zero, and its acceleration times the square of the
  /// step is less than 1e-15 of its size.
  bool resting() const noexcept override { return resting_; }
  void wake() override { resting_ = false; }

  std::span<const NodeMotion> motion() const override;
  void set_motion(std::span<const NodeMotion> motion) override;

  /// Contents of a snapshot.
  struct State {
    std::shared_ptr<const contact::Load> load;
    double time = 0, loaded = 0;
    CopyOnWrite<std::vector<NodeRow>> rows;
    bool resting = false;
  };
  /// Rows are shared until a step writes them.
  State state() const;
  /// Goes back. \pre a state of this object
  void restore(const State& state);
  std::any snapshot() const override { return state(); }
  void go_back(const std::any& snapshot) override {
    restore(std::any_cast<const State&>(snapshot));
  }

  std::vector<contact::NodeVector> contact_forces() const override;

private:
  /// A row whose force changes with time or shape.
  struct Driven {
    std::uint32_t node = 0;
    Vec3 steady, pulsing;
    double period = 0;
    contact::NodePressure pressure;
    std::vector<Triangle> around; ///< if there is a pressure
  };
  struct RampedNode {
    std::uint32_t node = 0;
    contact::Ramp way;
  };
  struct Drive { ///< of a block
    std::vector<Driven> driven;
    std::vector<RampedNode> ramped;
  };

  void apply_load();
  void copy_held_rows();
  bool found_at_rest(double h, double time) const;
  template <class At>
  Vec3 outer_force(const Driven& driven, double time, const At& position) const;
  void run_steps(std::uint64_t steps, double h, double start, const Context& context);
  bool step_block(std::size_t block, const NodeRow* now, NodeRow* next, double h, double time,
                  CpuLevel cpu);
  Vec3 outer_force(std::uint32_t node, double time) const;
  [[noreturn]] void fail(double time, const char* what) const;

  const model::Model& model_;
  SpringNetwork network_;
  SpringLayout layout_;
  std::shared_ptr<const contact::Load> load_ = std::make_shared<const contact::Load>();
  double time_ = 0;   ///< of the state
  double loaded_ = 0; ///< when the load was last applied
  std::vector<NodeTraits> traits_;
  CopyOnWrite<std::vector<NodeRow>> rows_, next_;
  std::vector<Drive> drives_; ///< by block; empty if all loads of the block are constant
  mutable std::vector<NodeMotion> motion_;
  mutable bool motion_shown_ = false; ///< motion_ is that of rows_
  double size_ = 0;                   ///< longest side of the box at rest
  bool resting_ = false;
};

} // namespace gewebe::dynamics

#pragma once
// The elastodynamic method: masses and springs in time (report 3.1.3).
//
// Semi-implicit Euler, with all F of the old state:
//
//   v' = v + h/m (F(u, v) + f + m g),   u' = u + h v'
//
// or, for models too stiff for that, backward Euler with F of the new state
// (dynamics/implicit_euler.h). Axes that the model holds stay, a displaced node stands at its
// displacement with velocity 0, or is on its way there. The same bytes for any number of threads.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "base/error.h"
#include "contact/load.h"
#include "dynamics/dynamic_contact.h"
#include "dynamics/implicit_contact.h"
#include "dynamics/implicit_euler.h"
#include "dynamics/spring_force.h"
#include "dynamics/spring_layout.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// The default integration step over safe_step(model): below 1, since stability is proven for the
/// model at rest alone.
inline constexpr double safe_step_fraction = 0.9;

enum class Integration { semi_implicit, implicit };

/// The state of an object can't be continued.
class MotionError : public Error {
public:
  MotionError(std::uint32_t node, double time, const std::string& what)
      : Error(what), node_(node), time_(time) {}
  std::uint32_t node() const noexcept { return node_; }
  double time() const noexcept { return time_; }

private:
  std::uint32_t node_;
  double time_;
};

class Elastodynamic {
public:
  /// At rest. Keeps a reference to the model.
  /// \pre check_model(model) passes   \throw Error if a node can move but has no mass
  explicit Elastodynamic(const Model& model, Integration integration = Integration::semi_implicit);

  /// What acts from now on. Displaced nodes stand where they must at once. An unchanged load wakes
  /// nobody. \pre nodes exist, no displacement along an axis that the model holds
  void set_load(const Load& load, double time = 0);

  /// Integrates from `start` over `duration` in equal steps of at most `largest_step`. An object
  /// that rests (see resting()) takes none. \return steps taken
  /// \pre duration >= 0, largest_step > 0, start >= 0
  /// \throw Error if there would be over 1e9 steps; MotionError that names the node and the time
  /// where the state is no longer finite, or an implicit step has no solution; Cancelled
  std::uint64_t advance(double duration, double largest_step, const Context& context,
                        double start = 0);

  /// Whether the object was found at rest: no speed, and acceleration (times the square of the
  /// step) under 1e-15 of its size; so it stays until its load changes.
  bool resting() const noexcept { return resting_; }

  /// By node of the model. \pre not from two threads at once
  std::span<const NodeMotion> motion() const;
  /// Gives the nodes another state; it wakes. \pre as many as nodes; 0 where the model holds them
  void set_motion(std::span<const NodeMotion> motion);

  /// All that decides how it goes on, but for what is kept to be quick (see renew).
  struct State {
    std::shared_ptr<const Load> load;
    double time = 0, loaded = 0;
    CopyOnWrite<std::vector<NodeRow>> rows;
    bool resting = false;
    std::optional<DynamicContact::State> touch;
  };
  /// Rows are shared until a step writes them.
  State state() const;
  /// Goes back. \pre a state of this object
  void restore(const State& state);
  /// Forgets an implicit step's matrix and factor, which serve for several steps.
  void renew();

  /// What holds the displaced nodes: the force on the object, per node in ascending order; 0 along
  /// axes that the model holds.
  std::vector<NodeVector> contact_forces() const;

  /// Instruments during the advances to come, by number; none of them: no cost. Wakes nobody.
  void set_instruments(std::vector<std::optional<MovingInstrument>> instruments);
  void wake() { resting_ = false; }
  /// That it rests for `duration` s more, in place of an advance. \pre resting()
  void rest_on(double duration);
  /// Impulses (forces times s) of the instruments since the last call, by ascending node and
  /// instrument.
  std::vector<NodeTouch> take_impulses();
  /// Whether the forces of instruments in implicit steps so far meet the conditions.
  bool touches_exact() const { return !touch_ || touch_->state().exact; }
  /// The forces of the instruments, if it rested for these last `duration` s, all since that call.
  std::optional<std::vector<NodeTouch>> held_touches(double duration) const;

private:
  /// A row whose force changes with time or shape.
  struct Driven {
    std::uint32_t node = 0;
    Vec3 steady, pulsing;
    double period = 0;
    NodePressure pressure;
    std::vector<Triangle> around; ///< if there is a pressure
  };
  struct RampedNode {
    std::uint32_t node = 0;
    Ramp way;
  };
  struct Drive { ///< of a block
    std::vector<Driven> driven;
    std::vector<RampedNode> ramped;
  };

  void apply_load();
  void copy_held_rows();
  bool found_at_rest(double h, double time, std::vector<NodeTouch>& touches) const;
  template <class At>
  Vec3 outer_force(const Driven& driven, double time, const At& position) const;
  void run_steps(std::uint64_t steps, double h, double start, const Context& context);
  void run_implicit(std::uint64_t steps, double h, double start, const Context& context);
  bool step_implicit(std::uint64_t step, std::uint64_t steps, double h, double start,
                     std::span<NodeMotion> now, const ImplicitContact::Step& what,
                     const Context& context, std::uint32_t& worst);
  bool step_block(std::size_t block, const NodeRow* now, NodeRow* next, double h, double time,
                  CpuLevel cpu);
  Vec3 outer_force(std::uint32_t node, double time) const;
  [[noreturn]] void fail(double time, const char* what) const;

  const Model& model_;
  SpringNetwork network_;
  SpringLayout layout_;
  std::shared_ptr<const Load> load_ = std::make_shared<const Load>();
  double time_ = 0;   ///< of the state
  double loaded_ = 0; ///< when the load was last applied
  std::vector<NodeTraits> traits_;
  CopyOnWrite<std::vector<NodeRow>> rows_, next_;
  std::vector<Drive> drives_; ///< by block; empty where nothing changes
  std::unique_ptr<ImplicitEuler> implicit_;
  std::unique_ptr<DynamicContact> touch_;           ///< while there are instruments
  std::unique_ptr<ImplicitContact> implicit_touch_; ///< of implicit_, when needed
  mutable std::vector<NodeMotion> motion_;
  mutable bool motion_shown_ = false; ///< motion_ is that of rows_
  double size_ = 0;                   ///< longest side of the box at rest
  bool resting_ = false;
};

} // namespace gewebe

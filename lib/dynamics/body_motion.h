#pragma once
// Interface of elastodynamic bodies: nets (dynamics/elastodynamic.h) and solids
// (dynamics/solid_dynamic.h).

#include "base/context.h"
#include "base/error.h"
#include "contact/contact_body.h"
#include "contact/island.h"
#include "contact/load.h"
#include "dynamics/spring_force.h"

#include <any>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::dynamics {

/// Error of an integration that can't continue.
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

/// Work of implicit integration, of solids and of nets.
struct SolidStepCounts {
  std::uint64_t steps = 0, rounds = 0; ///< integration steps; linear solves in them
  std::uint64_t factors = 0;           ///< factorisations
  std::uint64_t unfinished = 0;        ///< steps that ran out of iterations
  std::uint64_t limited = 0;           ///< steps whose speeds were lowered, see SolidMotion::step
  double seconds = 0;                  ///< by the clock
};

struct MotionEnergies {
  double kinetic = 0, elastic = 0; ///< 1e-9 J
};

/// Steps of an integration: of at most `largest` s, of first or of second order.
struct TimeSteps {
  double largest = 0;
  int order = 1;

  TimeSteps(double step, int of_order = 1) : largest(step), order(of_order) {} // NOLINT: a length
};

/// State of motion of one body, and its integration.
class BodyMotion {
public:
  BodyMotion() = default;
  BodyMotion(const BodyMotion&) = delete;
  BodyMotion& operator=(const BodyMotion&) = delete;
  virtual ~BodyMotion() = default;

  /// Sets the load from now on. Displaced nodes get their displacement at once. An unchanged load
  /// does not wake the object.
  /// \pre nodes exist, no displacement along an axis that the model holds
  virtual void set_load(const contact::Load& load, double time) = 0;

  /// Integrates from `start` over `duration` in equal steps. An object at rest (see resting())
  /// makes no step. \return number of steps
  /// \pre duration >= 0, steps.largest > 0, start >= 0; steps.order is 1, or has_contact_steps()
  /// \throw Error if there would be over 1e9 steps
  /// \throw MotionError with node and time, if the state is no longer finite or an implicit step
  /// has no solution
  /// \throw Cancelled
  virtual std::uint64_t advance(double duration, const TimeSteps& steps, const Context& context,
                                double start) = 0;

  /// Whether the object was found at rest. It stays at rest until its load changes.
  virtual bool resting() const noexcept = 0;
  virtual void wake() = 0;

  /// State of each node of the model. \pre not called from two threads at once
  virtual std::span<const NodeMotion> motion() const = 0;
  /// Sets the state of all nodes, and wakes the object.
  /// \pre one entry for each node; 0 along axes that the model holds
  virtual void set_motion(std::span<const NodeMotion> motion) = 0;

  /// Everything that determines the future motion, to the bit. Copies share large parts of it.
  virtual std::any snapshot() const = 0;
  /// Rolls back to a snapshot. \pre a snapshot of this object
  virtual void go_back(const std::any& snapshot) = 0;

  /// Reactions of the displaced nodes: the force on the object, per node in ascending order; 0
  /// along
  /// axes that the model holds.
  virtual std::vector<contact::NodeVector> contact_forces() const = 0;

  /// What a viscoelastic body remembers; nothing of others.
  virtual std::any memory() { return {}; }
  /// As if it had come where it is by that. \pre memory() of a body with the same elements
  virtual void remember(const std::any& /*memory*/) {}

  // ---- contact

  /// Whether the object can make steps with contact.
  virtual bool has_contact_steps() const { return false; }
  /// Its collision surface, by nodes of the model. \pre has_contact_steps()
  virtual const contact::ModelSurface& collision_surface();
  /// Begins a step with contact, or a stage of one. What is not ended has no effect.
  /// \return body for the contact solver, valid until the step ends
  /// \pre has_contact_steps(), step.to > step.from
  /// \throw as advance
  virtual contact::ContactBody& begin_contact_step(const contact::Interval& step,
                                                   const Context& context);
  /// Whether the last step with contact was a first stage that a second one may follow.
  virtual bool has_first_stage() const { return false; }
  /// Ends the step.
  /// \param forces  contact forces on vertices, by ascending vertex
  /// \param still  velocities and time stay as they were
  virtual void end_contact_step(std::span<const contact::VertexForce> forces, bool still,
                                const Context& context);
  /// To be called for a step without contact: drops the contact forces of the last step.
  virtual void clear_contact() {}

  /// Work of implicit integration since the last call.
  virtual SolidStepCounts take_counts() { return {}; }
  /// Energies of a body with implicit steps. Empty for explicit steps: elastic_energy sums over the
  /// springs.
  virtual std::optional<MotionEnergies> energies() const { return std::nullopt; }
};

} // namespace gewebe::dynamics

#pragma once
// What moves in time, whatever it consists of: nets (dynamics/elastodynamic.h) and solids
// (dynamics/solid_dynamic.h). Each says how.

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

namespace gewebe {

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

/// What solids, and nets that move implicitly, took to move.
struct SolidStepCounts {
  std::uint64_t steps = 0, rounds = 0; ///< of integration; solutions with a factor in them
  std::uint64_t factors = 0;
  std::uint64_t unfinished = 0; ///< steps whose rounds ran out
  std::uint64_t limited = 0;    ///< steps whose speeds were lowered, see SolidMotion::step
  double seconds = 0;           ///< by the clock
};

struct MotionEnergies {
  double kinetic = 0, elastic = 0; ///< 1e-9 J
};

class BodyMotion {
public:
  BodyMotion() = default;
  BodyMotion(const BodyMotion&) = delete;
  BodyMotion& operator=(const BodyMotion&) = delete;
  virtual ~BodyMotion() = default;

  /// What acts from now on. Displaced nodes stand where they must at once. An unchanged load wakes
  /// nobody. \pre nodes exist, no displacement along an axis that the model holds
  virtual void set_load(const Load& load, double time) = 0;

  /// Integrates from `start` over `duration` in equal steps of at most `largest_step`. An object
  /// that rests (see resting()) takes none. \return steps taken
  /// \pre duration >= 0, largest_step > 0, start >= 0
  /// \throw Error if there would be over 1e9 steps; MotionError that names the node and the time
  /// where the state is no longer finite, or an implicit step has no solution; Cancelled
  virtual std::uint64_t advance(double duration, double largest_step, const Context& context,
                                double start) = 0;

  /// Whether the object was found at rest; so it stays until its load changes.
  virtual bool resting() const noexcept = 0;
  virtual void wake() = 0;

  /// By node of the model. \pre not from two threads at once
  virtual std::span<const NodeMotion> motion() const = 0;
  /// Gives the nodes another state; it wakes. \pre as many as nodes; 0 where the model holds them
  virtual void set_motion(std::span<const NodeMotion> motion) = 0;

  /// All that decides how it goes on, but for what is kept to be quick (see renew), and back.
  virtual std::any snapshot() const = 0;
  /// \pre a snapshot of this object
  virtual void go_back(const std::any& snapshot) = 0;
  /// Forgets what is kept to be quick: factors, guesses.
  virtual void renew() = 0;

  /// What holds the displaced nodes: the force on the object, per node in ascending order; 0 along
  /// axes that the model holds.
  virtual std::vector<NodeVector> contact_forces() const = 0;

  // ---- contact

  /// Whether it can make steps with contact.
  virtual bool has_contact_steps() const { return false; }
  /// Its collision surface, by nodes of the model. \pre has_contact_steps()
  virtual const contact::ModelSurface& collision_surface();
  /// Begins a step with contact. A step that was begun and not ended leaves no trace.
  /// \return valid until the step ends \pre has_contact_steps(), to > from \throw as advance
  virtual contact::ContactBody& begin_contact_step(double from, double to, const Context& context);
  /// Ends it. \param forces  contact forces on vertices, by ascending vertex
  /// \param still  velocities stay as they were, and so does the time
  virtual void end_contact_step(std::span<const contact::VertexForce> forces, bool still,
                                const Context& context);
  /// A step without contact came behind steps with it.
  virtual void clear_contact() {}

  /// Of what moves by the steps of solids, since the last call.
  virtual SolidStepCounts take_counts() { return {}; }
  /// Of the same; those of a net that moves explicitly are sums over its springs.
  virtual std::optional<MotionEnergies> energies() const { return std::nullopt; }
};

} // namespace gewebe

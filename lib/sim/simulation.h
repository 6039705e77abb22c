#pragma once
// A scene in time: objects, what acts on them, events. Elastodynamic objects move from event to
// event, elastostatic ones take their shape when it is asked for, at the end of a step.

#include "base/context.h"
#include "model/model.h"
#include "sim/command.h"
#include "sim/elastodynamic.h"
#include "sim/elastostatic.h"
#include "sim/load.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace gewebe {

struct SetForce {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 force; ///< on each; 0 takes it away
};
struct SetDisplacement {
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
  Vec3 displacement;
};
struct Release { ///< of force and displacement
  std::size_t object = 0;
  std::vector<std::uint32_t> nodes;
};
struct SetGravity {
  Vec3 gravity;
};
struct SetTimestep {
  double dt = 0;
};
struct Emit {
  bool forces = false; ///< else shapes
};
using Change = std::variant<SetForce, SetDisplacement, Release, SetGravity, SetTimestep, Emit>;

struct SimulationOptions {
  bool measure_error = false;                     ///< see ElastostaticOptions
  std::function<void(const std::string&)> warn{}; ///< told of each trouble once per object
};

struct SimulationCounts {
  std::uint64_t steps = 0;         ///< of the scene
  std::uint64_t integration = 0;   ///< integration steps of elastodynamic objects
  std::uint64_t resting = 0;       ///< advances that an object at rest did not need
  ElastostaticCounts elastostatic; ///< of all objects: sums, largest errors
};

class Simulation {
public:
  Simulation(const Context& context, SimulationOptions options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// An object at rest, under the present gravity. \param parts for ffe: what is stored of it
  /// \pre check_model(model) passes   \throw Error if there is one of that name, or it can't be
  /// simulated by this method; Cancelled
  void add_object(const std::string& name, Model model, Method method, StiffnessParts parts = {});

  std::size_t object_count() const noexcept { return objects_.size(); }
  const std::string& name(std::size_t object) const;
  const Model& model(std::size_t object) const;
  Method method(std::size_t object) const;
  /// \throw Error naming those there are
  std::size_t find(const std::string& name) const;

  /// Takes effect now. \pre objects and nodes exist, numbers are finite
  /// \throw Error if a node should move along an axis that the model holds
  void apply(const Change& change);
  /// Takes effect at `time`, which is now or later, behind what was scheduled for it earlier.
  /// \throw Error as apply, and if the time is past
  void schedule(double time, const Change& change);
  std::size_t pending() const noexcept { return events_.size(); }

  double time() const noexcept { return time_; }
  /// The integration step asked for by SetTimestep.
  std::optional<double> timestep() const noexcept { return timestep_; }
  bool emits_forces() const noexcept { return emit_forces_; }
  bool emits_shapes() const noexcept { return emit_shapes_; }

  /// Goes on by dt >= 0, or to `time` (now or later), through the events up to and at its end.
  /// Times add up without the rounding of each sum. \throw Error "object NAME at T s: …", Cancelled
  void step(double dt);
  void step_to(double time);

  /// Of the last step: 3 n numbers, mm, and what holds the displaced nodes.
  std::span<const double> displacement(std::size_t object) const;
  const std::vector<NodeVector>& contact_forces(std::size_t object) const;

  SimulationCounts counts() const;

private:
  struct Object;
  void check(const Change& change) const;
  void advance(double to);
  template <class Work>
  void at_object(const Object& object, Work&& work); ///< names object and time in an Error
  void show(Object& object);
  void warn_of_range(Object& object);
  double integration_step(Object& object);

  Context context_;
  SimulationOptions options_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::multimap<double, Change> events_;
  Vec3 gravity_;
  std::optional<double> timestep_;
  double time_ = 0;
  double sum_ = 0, lost_ = 0; ///< of the steps so far, and what rounding took from it
  bool emit_forces_ = false, emit_shapes_ = false;
  SimulationCounts counts_;
};

} // namespace gewebe

#pragma once
// The commands of a scene, scene(5), as data.

#include "integrator/solid_motion.h"
#include "model/selector.h"
#include "scene/change.h"

#include <optional>
#include <string>
#include <variant>

namespace gewebe::formats {

struct ObjectCommand {
  std::string name, model, store; ///< files as the scene names them; no store: ""
  scene::Method method = scene::Method::ela;
  scene::Integration integration = scene::Integration::semi_implicit;
  bool warp = false;             ///< large rotations
  integrator::SolidChoice solid; ///< how a solid moves
};
/// A change, without the numbers of named things, which scene_change() finds.
struct ChangeCommand {
  scene::Change change;
  std::string object{}, other{}, instrument{};
  std::optional<model::Selector> nodes{}, others{};
  bool total = false;  ///< a force or mass is divided among the nodes
  std::string stage{}; ///< file of the second stage's model; none: ""
  std::string mesh{};  ///< file of an instrument's mesh; none: ""
};
/// Writes the model as it is now, at rest.
struct EmitModelCommand {
  std::string object, file;
};
/// Answers tell stresses of a solid from now on, at these nodes or all; results hold them.
struct EmitStressCommand {
  std::string object;
  std::optional<model::Selector> nodes;
};
constexpr double default_step = 1.0 / 60; ///< s
struct StepCommand {
  std::optional<double> dt; ///< >= 0; absent: the timestep that is set, or default_step
};
struct RunCommand {
  double until = 0, every = 0; ///< every > 0
};

/// Requests the time of the scene, without a step.
struct SyncCommand {};

/// Requests information; nothing changes.
struct QueryCommand {
  enum class Kind {
    nodes,      ///< of an object: number, and positions if requested
    select,     ///< of an object: those that a selector names
    objects,    ///< all of them
    instruments ///< that are there
  };
  enum class Positions { none, rest, now };
  Kind kind = Kind::nodes;
  std::string object{};
  std::optional<model::Selector> nodes{};
  Positions positions = Positions::none;
};

/// What follows is not read.
struct EndCommand {};

struct Command {
  std::optional<double> at; ///< when; absent: now
  bool every = false;       ///< at every multiple of it
  std::variant<ObjectCommand, ChangeCommand, EmitModelCommand, EmitStressCommand, StepCommand,
               RunCommand, SyncCommand, QueryCommand, EndCommand>
      what;
};

} // namespace gewebe::formats

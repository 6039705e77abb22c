#pragma once
// The commands of a scene, scene(5), as data.

#include "base/vec3.h"
#include "contact/instrument.h"
#include "model/cut_select.h"
#include "model/selector.h"

#include <optional>
#include <string>
#include <variant>

namespace gewebe {

enum class Method { ffe, ela }; ///< elastostatic (with stored stiffness), elastodynamic

/// "ffe", "ela".
constexpr const char* method_name(Method method) {
  return method == Method::ffe ? "ffe" : "ela";
}

struct ObjectCommand {
  std::string name, model, store; ///< files as the scene names them; no store: ""
  Method method = Method::ela;
  bool implicit = false;
};
struct ForceCommand {
  std::string object;
  Selector nodes;
  Vec3 force;
  bool total = false; ///< divided among the nodes
  double period = 0;  ///< of its pulse, s; 0: none
};
struct PressureCommand {
  std::string object;
  Selector nodes;
  double pressure = 0; ///< Pa, along the normals
  double period = 0;
};
struct AttachCommand {
  std::string object;
  Selector nodes;
  std::string other;
  Selector others;
  double stiffness = 0; ///< > 0
};
struct DisplaceCommand {
  std::string object;
  Selector nodes;
  Vec3 displacement;
  double over = 0; ///< s that the way takes
};
struct ReleaseCommand {
  std::string object;
  Selector nodes;
};
struct InstrumentCommand {
  std::string name;
  InstrumentShape shape;
  Pose pose;
};
struct MoveCommand {
  std::string instrument;
  Vec3 place;
  std::optional<Quaternion> turn; ///< from how it came to the scene; none: as it is
  double over = 0;                ///< s
};
struct GraspCommand {
  std::string object;
  Selector nodes;
  std::string instrument;
};
struct WithdrawCommand {
  std::string instrument;
};
struct GravityCommand {
  Vec3 gravity;
};
struct TimestepCommand {
  double dt = 0; ///< > 0
};
struct TwoStepCommand {
  std::string object;
  double threshold = 0; ///< > 0
  bool series = false;
};
struct EmitCommand {
  bool forces = false;      ///< else shapes
  bool instruments = false; ///< rather
};
/// Writes the model as it is now, at rest.
struct EmitModelCommand {
  std::string object, file;
};
struct StepCommand {
  std::optional<double> dt; ///< >= 0
};
struct RunCommand {
  double until = 0, every = 0; ///< every > 0
};

struct MethodCommand {
  std::string object;
  Method method = Method::ela;
};
struct RenewCommand {
  std::string object;
};

struct CutCommand {
  std::string object;
  std::optional<CutPlane> plane; ///< none: springs
  std::optional<Selector> nodes; ///< that a plane may pass; springs start at these
  std::optional<Selector> others;
};
struct TearCommand {
  std::string object;
  double strain = 0; ///< 0: none any more
};
struct RestoreCommand {
  std::string object;
};

struct Command {
  std::optional<double> at; ///< when; absent: now. Never for object, step, run
                            ///< and renew.
  bool every = false;       ///< at every multiple of it
  std::variant<ObjectCommand, ForceCommand, PressureCommand, DisplaceCommand, AttachCommand,
               ReleaseCommand, InstrumentCommand, MoveCommand, GraspCommand, WithdrawCommand,
               GravityCommand, TimestepCommand, TwoStepCommand, EmitCommand, EmitModelCommand,
               StepCommand, RunCommand, MethodCommand, RenewCommand, CutCommand, TearCommand,
               RestoreCommand>
      what;
};

} // namespace gewebe

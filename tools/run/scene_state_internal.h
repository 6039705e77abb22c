#pragma once
// What a run of a scene keeps, and what it does with one command.

#include "base/digest.h"
#include "base/error.h"
#include "formats/scene/command.h"
#include "tools/results/scene_estimate.h"
#include "tools/results/scene_result.h"
#include "tools/results/scene_shapes.h"
#include "tools/results/scene_stress.h"
#include "tools/run/instrument_check.h"
#include "tools/run/scene_checks.h"
#include "tools/run/scene_run.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

/// A file that a line names may be wrong in a place of its own: both places count.
std::string with_place(const Error& error);

/// A line of the input, or of the client of this number.
struct LinePlace {
  std::uint64_t line = 0, client = 0;

  bool operator==(const LinePlace&) const = default;
};

/// A file of an object, read late, is the fault of the line that named it.
struct WrongFile {
  LinePlace at;
  std::string text;
};

struct SceneRun::State {
  std::string name;
  SceneOptions options;
  scene::Simulation simulation;
  SceneCounts counts;
  Digest digest;
  LinePlace line;
  std::uint64_t steps = 0;
  bool ended = false;
  std::map<std::string, std::string> lists;     // node lists that the line named
  std::optional<formats::RunCommand> under_way; // of a run of several steps, as far as it came
  Error first_error{""};
  SceneChecks checks;
  InstrumentCheck instrument_check;
  SceneStress stress;
  SceneEstimates estimates;
  Vec3 gravity, answered_gravity; ///< now, and at the last answer or accepted line
  std::optional<SceneResult> result;
  std::optional<SceneShapes> shared;
  std::vector<std::string> stores; ///< by object; "" where it has none
  std::vector<std::string> models; ///< files that objects were made of

  State(std::string n, const Context& context, SceneOptions o);

  scene::SimulationOptions simulation_options();
  void warn(const std::string& text);
  void distrust(const std::string& text);
  /// \throw Error without one
  void require_object() const;

  // One command, scene_commands.cpp. Each throws Error if it can't be carried out.
  void execute(const formats::Command& command);
  void add(const formats::ObjectCommand& c);
  /// Two-step takes the second stage from the object's store, unless it has a model.
  void add_stage(scene::SetTwoStep& set, const std::string& file);
  void write(const formats::EmitModelCommand& c);
  void tell_stress(const formats::EmitStressCommand& c);
  void schedule(const formats::Command& command, const formats::ChangeCommand& what);
  void step(const formats::StepCommand& c);
  void run(const formats::RunCommand& c);
  /// A step and its answer, behind the first frame. Only when the step is done, so that one that
  /// fails leaves nothing.
  template <class Step>
  void go_on(Step&& step);

  // What follows, scene_run.cpp.
  void sync();
  void tell(const formats::QueryCommand& query);
  void answer();
  void acknowledge();
  void measure();
  /// The line was carried out.
  void accept(std::string_view text, const formats::Command& command);
  /// The line was not carried out, or only in part if it has many steps.
  void refuse(const LinePlace& at, const std::string& text);
  /// How messages name it.
  std::string named(const LinePlace& at) const;
};

} // namespace gewebe::cli

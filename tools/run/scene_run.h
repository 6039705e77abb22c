#pragma once
// Runs a scene line by line: parses, loads files when they are needed, simulates, answers.

#include "base/context.h"
#include "base/error.h"
#include "compliance/compliance_source.h"
#include "formats/results/results_writer.h"
#include "model/selector.h"
#include "scene/simulation.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::formats {
class SharedShapes;
struct EstimateAnswer;
} // namespace gewebe::formats

namespace gewebe::cli {

class EventLog;
class SceneEstimates;
class SceneRecord;
class StepLatency;

/// How a scene comes to what its file names stand for.
struct SceneFiles {
  /// That the file is there and may be read, without doing so. May be absent. \throw Error
  std::function<void(const std::string& name)> check;
  std::function<model::Model(const std::string& name)> model;
  /// \throw Error, among others if the store is of another model
  std::function<compliance::StoredStiffness(const std::string& name, const model::Model& model)>
      store;
  /// Second stage of the object in the store, read on demand.
  /// \throw Error, among others if it has none
  std::function<std::function<std::shared_ptr<compliance::ComplianceSource>()>(
      const std::string& name, const model::Model& model)>
      second_stage;
  model::LoadNodeList node_list;
  /// An instrument's shape with the mesh of a file; a radius of 0 becomes a hundredth of its size.
  /// \throw Error
  std::function<contact::InstrumentShape(const std::string& name, contact::InstrumentShape shape)>
      instrument;
  /// Writes a model whole or not at all. May be absent. \throw Error
  std::function<void(const std::string& name, const model::Model& model)> write_model;
};

/// Path of a file that a scene names, see scene_files().
std::string scene_file_path(const std::string& scene, const std::string& name);

/// From files; relative names count from the folder of `scene`, or from the working folder where
/// that is "-".
SceneFiles scene_files(const std::string& scene, const Context& context,
                       const std::function<void(const std::string&)>& warn = {});

struct SceneOptions {
  SceneFiles files;
  std::function<void(std::string_view)> reply; ///< gets each complete answer; none: no answers
  bool binary = false;                         ///< answers are frames_binary.h's, else text
  bool acknowledge = false;                    ///< each line is answered by its number, last of all
  std::function<bool()> gone{}; ///< whether no client waits for the steps of a run any more
  bool serve = false;           ///< a wrong line is answered, changes nothing, and the run goes on
  std::function<void(const std::string&)> warn;
  /// Gets, once per object, why its shape is not to be trusted; default: `warn`.
  std::function<void(const std::string&)> distrust{};
  double rate = 0;                         ///< see SimulationOptions
  formats::ResultWriter* result = nullptr; ///< gets objects and frames; none of these is committed
  EventLog* events = nullptr;
  SceneRecord* record = nullptr;
  StepLatency* latency = nullptr;
  formats::SharedShapes* shared = nullptr; ///< gets the shapes of each answer before it is sent
  /// Called behind each answer with the scene's time in s and the frames so far: of the result, or
  /// answers if there is none. May be absent.
  std::function<void(double time, std::uint64_t frames)> progress{};
  bool measure = false;       ///< digest and largest displacement
  bool measure_error = false; ///< of every shape
  bool estimate = false;      ///< answers have errors that meshes cause
  /// Gets these errors after each step. May be absent. What it throws is an error of the line.
  std::function<void(const scene::Simulation&, const SceneEstimates&,
                     std::span<const formats::EstimateAnswer>)>
      estimated{};
  double tolerance = 0; ///< see ElastostaticOptions
};

struct SceneCounts {
  std::uint64_t commands = 0; ///< carried out
  std::uint64_t errors = 0;   ///< lines that were refused
  std::uint64_t frames = 0;   ///< of the result
  std::uint64_t models = 0;   ///< files that were needed and read
  std::uint64_t stores = 0;
  std::uint64_t nodes = 0;         ///< of these models
  double largest_displacement = 0; ///< mm, of any node in any step
  /// Of times, displacements and forces of all steps; an object that is not displaced has none.
  std::string digest;
};

class SceneRun {
public:
  /// `name` is what messages call the scene.
  SceneRun(std::string name, const Context& context, SceneOptions options);
  ~SceneRun();
  SceneRun(const SceneRun&) = delete;
  SceneRun& operator=(const SceneRun&) = delete;

  /// The next line, without its end. \throw Error, place "NAME:LINE": without `serve` if the line
  /// is wrong, the line of the object if it is a file of one; Cancelled; what reply, result and the
  /// logs throw, as it is. The run is over then
  void line(std::string_view text);
  /// A line in place of one that is too long to be kept.
  void overlong_line();
  /// Behind the last line. \throw Error, place NAME, if there was no command or no object
  void finish();
  /// A line ended the scene.
  bool ended() const noexcept;
  /// That were answered.
  std::uint64_t steps() const noexcept;
  /// The lines of another client follow, counted from 1.
  void next_client();
  /// About the lines that were refused under `serve`, naming the first; nothing if there is none.
  std::optional<Error> first_error() const;

  const scene::Simulation& simulation() const;
  SceneCounts counts() const;
  StepLatency* latency() const;

private:
  struct State;
  template <class Work>
  void numbered(Work&& work);
  std::unique_ptr<State> state_;
};

} // namespace gewebe::cli

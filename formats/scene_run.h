#pragma once
// Runs a scene line by line: parses, loads files, simulates, answers.

#include "base/context.h"
#include "formats/results_writer.h"
#include "formats/stream.h"
#include "model/selector.h"
#include "sim/simulation.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace gewebe {

/// How a scene comes to what its file names stand for.
struct SceneFiles {
  std::function<Model(const std::string& name)> model;
  /// \throw Error, among others if the store is of another model
  std::function<StiffnessParts(const std::string& name, const Model& model)> store;
  /// What the store has of the object's second stage, read when asked for.
  /// \throw Error, among others if it has none
  std::function<std::function<StiffnessParts()>(const std::string& name, const Model& model)>
      second_stage;
  LoadNodeList node_list;
};

/// From files; relative names count from the folder of `scene`, or from the working folder where
/// that is "-".
SceneFiles scene_files(const std::string& scene, const Context& context);

struct SceneOptions {
  SceneFiles files;
  std::function<void(std::string_view)> reply; ///< told each answer, whole; none: not answered
  std::function<void(const std::string&)> warn;
  ResultWriter* result = nullptr; ///< gets objects and frames, is not committed
  bool measure = false;           ///< backward errors, digest and largest displacement
};

struct SceneCounts {
  std::uint64_t commands = 0;
  std::uint64_t frames = 0; ///< of the result
  std::uint64_t nodes = 0;
  double largest_displacement = 0; ///< mm, of any node in any step
  std::string digest;              ///< of times, displacements and forces of all steps
};

class SceneRun {
public:
  /// `name` is what messages call the scene.
  SceneRun(std::string name, const Context& context, SceneOptions options);
  ~SceneRun();
  SceneRun(const SceneRun&) = delete;
  SceneRun& operator=(const SceneRun&) = delete;

  /// The next line, without its end. \throw Error, place "NAME:LINE"; what reply and result throw,
  /// as it is; the run is over then
  void line(std::string_view text);
  /// Behind the last line. \throw Error, place NAME, if there was no command or no object
  void finish();

  const Simulation& simulation() const;
  SceneCounts counts() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Feeds every line of the input to the run as soon as it is there, then finishes.
/// \throw Error as SceneRun, and where a line exceeds 1 MiB
void run_scene(Input& input, SceneRun& run);

} // namespace gewebe

#pragma once
// Bytes become lines of a scene.

#include "formats/stream/stream.h"
#include "tools/run/scene_run.h"

#include <cstdint>
#include <string>
#include <utility>

namespace gewebe {

/// Hands each line to a run as soon as its end is there.
class SceneLines {
public:
  /// Keeps a reference. \param name what messages call the input
  SceneLines(SceneRun& run, std::string name) : run_(run), name_(std::move(name)) {}

  /// \throw Error as the run, and for a line of over 1 GiB
  void take(char c);
  /// The last line may have no end.
  void end();
  /// What has come of a line is forgotten.
  void drop();

private:
  SceneRun& run_;
  std::string name_, line_;
  std::uint64_t size_ = 0; ///< of the line, also of what is not kept
};

/// Feeds every line of the input to the run as soon as it is there. \throw Error as SceneLines
void run_lines(Input& input, SceneRun& run);
/// The same, then finishes it.
void run_scene(Input& input, SceneRun& run);

} // namespace gewebe

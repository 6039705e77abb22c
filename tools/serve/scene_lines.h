#pragma once
// Bytes become lines of a scene.

#include "formats/stream/stream.h"
#include "tools/run/scene_run.h"

#include <cstdint>
#include <string>

namespace gewebe::cli {

/// Hands each line to a run as soon as its end is there.
class SceneLines {
public:
  explicit SceneLines(SceneRun& run) : run_(run) {} ///< keeps a reference

  /// False, and nothing is done, where a line is over 1 GiB long. \throw Error as the run
  bool take(char c);
  /// The last line may have no end.
  void end();
  /// What has come of a line is forgotten.
  void drop();

private:
  SceneRun& run_;
  std::string line_;
  std::uint64_t size_ = 0; ///< of the line, also of what is not kept
};

/// Feeds every line of the input, up to one that ends it, to the run as soon as it is there.
/// \param awake wait for lines as Input::wait_awake   \throw Error as the run, and for a line of
/// over 1 GiB
void run_lines(formats::Input& input, SceneRun& run, bool awake = false);
/// The same, then finishes it.
void run_scene(formats::Input& input, SceneRun& run);

} // namespace gewebe::cli

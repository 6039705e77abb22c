#pragma once
// Progress of a scene that runs: simulated time, real-time factor, frames, time left.

#include "tools/cli/progress_bar.h"

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

namespace gewebe::cli {

/// Finds the simulated time in s at which a scene ends, from its steps and runs, without carrying
/// them out. Wrong lines are passed over.
/// \param path  of the scene; "-" is standard input, which is left where it is
/// \return nothing if the scene is no regular file (a pipe, a terminal) or cannot be read
std::optional<double> find_scene_end(const std::string& path);

/// Shows how far a scene is.
class SceneProgress {
public:
  /// Keeps a reference to the bar. \param end  simulated time at the end, s; absent: unknown
  SceneProgress(cli::ProgressBar& bar, std::optional<double> end);

  /// A step is done. \param time  simulated, s
  void advance(double time, std::uint64_t frames);
  /// The last step is done: draws once more, if anything was drawn.
  void finish();

private:
  struct Sample {
    double clock, time;
  };
  void draw(double clock);

  cli::ProgressBar& bar_;
  std::optional<double> end_;
  std::deque<Sample> samples_; ///< the last ones that were drawn, for the speed of now
  bool stepped_ = false;
  double time_ = 0, speed_ = 0; ///< simulated, s; s of it in one s
  std::uint64_t frames_ = 0;
};

/// Begins to show progress, if there is a bar. A scene that is typed at a terminal shows none by
/// default: what is typed would stand behind the bar.
/// \param bar  null: no bar \param scene  path, or "-" \param listens  clients determine its
/// end
void start_progress(std::optional<SceneProgress>& progress, cli::ProgressBar* bar,
                    const std::string& scene, bool listens);

} // namespace gewebe::cli

#pragma once
// How far a program is, on standard error.

#include <mutex>
#include <string>

namespace gewebe::cli {

/// s of a clock that never goes back.
double now_seconds();

/// A bar with rate and remaining time.
class ProgressBar {
public:
  /// \param at_once else from the second second on
  ProgressBar(std::string tool, bool at_once);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// \param done 0 … 1; less than before begins another phase. May be called from any thread
  void update(double done);

private:
  std::string tool_;
  std::mutex mutex_;
  double start_, quiet_until_, next_ = 0, last_ = 0;
  bool drawn_ = false;
};

/// Of --progress: auto shows it to a terminal, unless the result goes into a pipe.
bool progress_wanted(const std::string& mode);

} // namespace gewebe::cli

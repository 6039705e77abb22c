#pragma once
// How far a program is, on standard error.

#include <mutex>
#include <optional>
#include <string>

namespace gewebe::cli {

/// s of a clock that never goes back.
double now_seconds();

/// A progress bar, drawn at most ten times a second. Messages erase it, see erase_progress().
class ProgressBar {
public:
  /// \param always  draws from the first update on, else from the second second on
  ProgressBar(std::string tool, bool always);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Draws percentage, rate and remaining time, if it is time to draw.
  /// \param done 0 … 1; less than before begins another phase. May be called from any thread
  void update(double done);

  // For programs that have figures of their own, from one thread.
  bool always() const noexcept { return always_; }
  /// Whether it is time to draw; true begins the pause until the next time.
  bool is_due();
  /// Draws now.
  /// \param done     0 … 1; absent: unknown, so that there are figures without a bar
  /// \param figures  text behind the bar, cut to the width of a terminal
  void draw(std::optional<double> done, const std::string& figures);
  /// Whether anything was drawn, even if it is erased by now.
  bool was_drawn() const noexcept { return was_drawn_; }

private:
  bool is_due(double now);

  std::string tool_;
  bool always_;
  std::mutex mutex_;
  double start_, quiet_until_, next_ = 0, last_ = 0;
  bool was_drawn_ = false;
};

/// Erases the bar that is on the screen, if there is one, so that a line can begin there. The next
/// update draws it again.
void erase_progress();
/// The bytes that do so, for a message that leaves in one piece; "" if there is no bar.
const char* progress_eraser();

/// Of --progress: auto shows it to a terminal, unless the result goes into a pipe.
bool progress_wanted(const std::string& mode);

} // namespace gewebe::cli

#include "tools/cli/progress_bar.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace gewebe::cli {

double now_seconds() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since_start).count();
}

namespace {

std::atomic<bool> on_screen{false};

/// 0: standard error is no terminal.
std::size_t terminal_width() {
  winsize size{};
  return ::ioctl(2, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

} // namespace

const char* progress_eraser() {
  return on_screen.exchange(false) ? "\r\033[K" : "";
}

void erase_progress() {
  (void)std::fputs(progress_eraser(), stderr);
}

ProgressBar::ProgressBar(std::string tool, bool always)
    : tool_(std::move(tool)), always_(always), start_(now_seconds()),
      quiet_until_(always ? 0 : start_ + 1) {}
ProgressBar::~ProgressBar() {
  erase_progress();
}

bool ProgressBar::is_due(double now) {
  if (now < quiet_until_ || now < next_)
    return false;
  next_ = now + 0.1;
  return true;
}

bool ProgressBar::is_due() {
  return is_due(now_seconds());
}

void ProgressBar::update(double done) {
  const std::lock_guard lock(mutex_);
  const double now = now_seconds();
  if (done < last_)
    start_ = now; // a new phase
  last_ = done;
  if (!is_due(now))
    return;
  const double elapsed = now - start_;
  const double rate = elapsed > 0 ? done / elapsed : 0;
  const double left = rate > 0 ? (1 - done) / rate : 0;
  std::array<char, 64> figures{};
  (void)std::snprintf(figures.data(), figures.size(), "%.1f %%/s  %.0f s left", 100 * rate, left);
  draw(done, figures.data());
}

void ProgressBar::draw(std::optional<double> done, const std::string& figures) {
  constexpr std::size_t widest = 30, narrowest = 5;
  const std::size_t columns = terminal_width();
  std::string line = tool_ + " ";
  if (done) {
    const std::size_t rest = line.size() + figures.size() + 12; // brackets, percentage, a margin
    const std::size_t width =
        columns == 0 ? widest : std::clamp(std::max(columns, rest) - rest, narrowest, widest);
    const double share = std::clamp(*done, 0.0, 1.0);
    std::string bar(width, '.');
    std::fill_n(bar.begin(), static_cast<std::ptrdiff_t>(static_cast<double>(width) * share), '#');
    std::array<char, 16> percent{};
    (void)std::snprintf(percent.data(), percent.size(), "] %3.0f %%  ", 100 * share);
    line += "[" + bar + percent.data();
  }
  line += figures;
  if (columns > 1 && line.size() >= columns)
    line.resize(columns - 1); // a second row would stay behind
  was_drawn_ = true;
  on_screen = true;
  (void)std::fprintf(stderr, "\r%s\033[K", line.c_str());
}

bool progress_wanted(const std::string& mode) {
  if (mode != "auto")
    return mode == "always";
  struct stat info {};
  const bool piped = ::fstat(1, &info) == 0 && S_ISFIFO(info.st_mode);
  return ::isatty(2) != 0 && !piped;
}

} // namespace gewebe::cli

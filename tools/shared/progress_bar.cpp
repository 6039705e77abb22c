#include "tools/shared/progress_bar.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace gewebe::cli {

double now_seconds() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since_start).count();
}

ProgressBar::ProgressBar(std::string tool, bool at_once)
    : tool_(std::move(tool)), start_(now_seconds()), quiet_until_(at_once ? 0 : start_ + 1) {}
ProgressBar::~ProgressBar() {
  if (drawn_)
    (void)std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(double done) {
  const std::lock_guard lock(mutex_);
  const double now = now_seconds();
  if (done < last_)
    start_ = now; // a new phase
  last_ = done;
  if (now < quiet_until_ || now < next_)
    return;
  next_ = now + 0.1;
  drawn_ = true;
  const double elapsed = now - start_;
  const double rate = elapsed > 0 ? done / elapsed : 0;
  const double left = rate > 0 ? (1 - done) / rate : 0;
  std::string bar(30, '.');
  std::fill_n(bar.begin(), static_cast<std::ptrdiff_t>(30 * std::clamp(done, 0.0, 1.0)), '#');
  (void)std::fprintf(stderr, "\r%s [%s] %3.0f %%  %.1f %%/s  %.0f s left\033[K", tool_.c_str(),
                     bar.c_str(), 100 * done, 100 * rate, left);
}

bool progress_wanted(const std::string& mode) {
  if (mode != "auto")
    return mode == "always";
  struct stat info {};
  const bool piped = ::fstat(1, &info) == 0 && S_ISFIFO(info.st_mode);
  return ::isatty(2) != 0 && !piped;
}

} // namespace gewebe::cli

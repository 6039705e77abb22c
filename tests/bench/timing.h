#pragma once
// Medians of times, for the benchmarks.

#include "base/context.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <utility>
#include <vector>

namespace gewebe::timing {

struct Times {
  double median, fastest, slowest; // ms
};

/// \pre at least one time
inline Times times_of(std::vector<double> times) {
  std::ranges::sort(times);
  return {times[times.size() / 2], times.front(), times.back()};
}

inline double milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// What the process itself worked, which other programs on the machine disturb less. For work on
/// one thread.
inline double processor_milliseconds(const std::function<void()>& work) {
  const auto now = [] {
    timespec t{};
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

inline Times measure(const std::function<void()>& work, int runs = 7) {
  std::vector<double> times;
  for (int run = 0; run < runs; ++run)
    times.push_back(milliseconds(work));
  return times_of(std::move(times));
}

inline Context with_threads(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

} // namespace gewebe::timing

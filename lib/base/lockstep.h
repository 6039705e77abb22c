#pragma once
// A few threads that do many short steps together: they meet after each one, which costs under a
// microsecond where a parallel loop would cost several.

#include <atomic>
#include <cstdint>
#include <functional>

namespace gewebe {

/// Where threads wait for each other: with patience where another program has the core.
class MeetingPoint {
public:
  explicit MeetingPoint(int threads) : threads_(threads) {}

  /// Returns when all have called it; what they wrote before is seen by all. \param round the
  /// caller's own count of meetings, 0 at first
  void meet(std::uint32_t& round) noexcept;

private:
  const int threads_;
  std::atomic<int> arrived_{0};
  std::atomic<std::uint32_t> round_{0};
};

/// Calls work(thread, threads, point) on up to `threads` threads at once, fewer where the system
/// has no more of them. \pre work does not throw, and all meet equally often
void in_lockstep(int threads,
                 const std::function<void(int thread, int threads, MeetingPoint& point)>& work);

} // namespace gewebe

#pragma once
// Spin barrier for a few threads that do many short steps together. A wait at the barrier after
// each step costs less than a microsecond; a parallel loop would cost several.

#include <atomic>
#include <cstdint>
#include <functional>

namespace gewebe {

/// Barrier at which threads wait for each other. They yield the core if another program needs it.
class MeetingPoint {
public:
  explicit MeetingPoint(int threads) : threads_(threads) {}

  /// Returns when all threads have called it. Their earlier writes are then visible to all.
  /// \param round  the caller's own count of calls, 0 at first
  void meet(std::uint32_t& round) noexcept;

private:
  const int threads_;
  std::atomic<int> arrived_{0};
  std::atomic<std::uint32_t> round_{0};
};

/// Calls work(thread, threads, point) on up to `threads` threads at once, or fewer if the system
/// grants fewer. \pre work does not throw, and all threads wait at the barrier equally often
void in_lockstep(int threads,
                 const std::function<void(int thread, int threads, MeetingPoint& point)>& work);

} // namespace gewebe

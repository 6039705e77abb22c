#include "base/lockstep.h"

#include <condition_variable>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

namespace gewebe {

namespace {

constexpr int patience = 4000; // rounds of looking before the core is offered to others

} // namespace

void MeetingPoint::meet(std::uint32_t& round) noexcept {
  ++round;
  if (arrived_.fetch_add(1, std::memory_order_acq_rel) + 1 == threads_) {
    arrived_.store(0, std::memory_order_relaxed);
    round_.store(round, std::memory_order_release);
    return;
  }
  for (int tries = 0; round_.load(std::memory_order_acquire) != round; ++tries)
    if (tries < patience)
      __builtin_ia32_pause();
    else
      std::this_thread::yield();
}

void in_lockstep(int threads,
                 const std::function<void(int thread, int threads, MeetingPoint& point)>& work) {
  // How many there are is known only when all are made, so they wait for the start.
  std::mutex mutex;
  std::condition_variable started;
  std::optional<MeetingPoint> point;
  int count = 1;
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) {
    try {
      others.emplace_back([&, t] {
        {
          std::unique_lock lock(mutex);
          started.wait(lock, [&] { return point.has_value(); });
        }
        work(t, count, *point);
      });
    } catch (const std::system_error&) {
      break;
    }
  }
  {
    const std::lock_guard lock(mutex);
    count = static_cast<int>(others.size()) + 1;
    point.emplace(count);
  }
  started.notify_all();
  work(0, count, *point);
  for (std::thread& other : others)
    other.join();
}

} // namespace gewebe

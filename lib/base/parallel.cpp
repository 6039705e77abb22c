#include "base/parallel.h"

#include "base/error.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace gewebe {

namespace {

// ThreadSanitizer doesn't see how TBB's library, which it can't look into, starts tasks and waits
// for them: what stands before `told` comes before what stands after `heard` at the same place.
void told([[maybe_unused]] char& place) {
#ifdef __SANITIZE_THREAD__
  __tsan_release(&place);
#endif
}
void heard([[maybe_unused]] char& place) {
#ifdef __SANITIZE_THREAD__
  __tsan_acquire(&place);
#endif
}

/// How many of `wanted` threads live at once beside this one.
int threads_to_be_had(int wanted) {
  std::mutex mutex;
  std::condition_variable ready;
  bool counted = false;
  std::vector<std::thread> others;
  try {
    others.reserve(static_cast<std::size_t>(wanted));
    while (static_cast<int>(others.size()) < wanted)
      others.emplace_back([&] {
        std::unique_lock lock(mutex);
        ready.wait(lock, [&] { return counted; });
      });
  } catch (const std::system_error&) { // no more than these
  } catch (const std::bad_alloc&) {
  }
  {
    const std::lock_guard lock(mutex);
    counted = true;
  }
  ready.notify_all();
  for (std::thread& other : others)
    other.join();
  return static_cast<int>(others.size());
}

/// TBB ends the program when a thread that it may have is refused, so it is told before how many
/// there are; OpenVDB's own loops keep to it, too.
int arena_threads(int wanted) {
  static const int available = [] {
    const int cores = oneapi::tbb::info::default_concurrency();
    const int threads = 1 + (cores > 1 ? threads_to_be_had(cores - 1) : 0);
    if (threads < cores) {
      using oneapi::tbb::global_control;
      static const global_control limit(global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
    }
    return threads;
  }();
  // More threads than cores would only make TBB print a warning.
  return std::min(wanted, available);
}

} // namespace

int thread_count(const Context& context) noexcept {
  return context.threads > 0 ? context.threads : oneapi::tbb::info::default_concurrency();
}

void parallel_blocks(const Context& context, std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  const std::size_t blocks = count / grain + (count % grain != 0 ? 1 : 0);
  std::size_t done = 0;
  std::mutex mutex;
  const auto run_block = [&](std::size_t block) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    body(block * grain, std::min(count, (block + 1) * grain));
    if (context.progress) {
      const std::lock_guard lock(mutex);
      context.progress(static_cast<double>(++done) / static_cast<double>(blocks));
    }
  };
  const int threads = blocks < 2 ? 1 : thread_count(context);
  const int together = threads == 1 ? 1 : arena_threads(threads);
  if (together == 1) {
    for (std::size_t block = 0; block < blocks; ++block)
      run_block(block);
    return;
  }
  oneapi::tbb::task_arena arena(together);
  char start = 0, end = 0;
  told(start);
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::size_t>(0, blocks, 1),
        [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
          heard(start);
          for (std::size_t block = range.begin(); block != range.end(); ++block)
            run_block(block);
          told(end);
        },
        oneapi::tbb::simple_partitioner());
  });
  heard(end);
}

} // namespace gewebe

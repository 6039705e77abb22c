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
#include <exception>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace gewebe {

namespace {

/// Number of threads that the system grants beside this one, at most the given number.
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

/// TBB ends the program if the system refuses a thread within TBB's limit. The limit is therefore
/// set to the number of available threads. It holds for OpenVDB's own loops too.
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

/// Calls `run(block)` for each block on up to `together` threads; the first that throws ends it.
template <class Run>
void run_blocks(int together, std::size_t blocks, const Run& run) {
#ifdef __SANITIZE_THREAD__
  // ThreadSanitizer can't look into TBB's library and takes what it hands over for races. In its
  // builds plain threads take the blocks, so that what it sees are those of the blocks themselves.
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t block; (block = next++) < blocks;)
        run(block);
    } catch (...) {
      next = blocks;
      const std::lock_guard lock(mutex);
      if (!failure)
        failure = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  while (static_cast<int>(others.size()) + 1 < together)
    others.emplace_back(work);
  work();
  for (std::thread& other : others)
    other.join();
  if (failure)
    std::rethrow_exception(failure);
#else
  oneapi::tbb::task_arena arena(together);
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::size_t>(0, blocks, 1),
        [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
          for (std::size_t block = range.begin(); block != range.end(); ++block)
            run(block);
        },
        oneapi::tbb::simple_partitioner());
  });
#endif
}

} // namespace

int thread_count(const Context& context) noexcept {
  return context.threads > 0 ? context.threads : oneapi::tbb::info::default_concurrency();
}

void parallel_blocks(const Context& context, std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  parallel_blocks_if(true, context, count, grain, body);
}

void parallel_blocks_if(bool worth, const Context& context, std::size_t count, std::size_t grain,
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
  const int threads = blocks < 2 || !worth ? 1 : thread_count(context);
  const int together = threads == 1 ? 1 : arena_threads(threads);
  if (together == 1) {
    for (std::size_t block = 0; block < blocks; ++block)
      run_block(block);
    return;
  }
  run_blocks(together, blocks, run_block);
}

} // namespace gewebe

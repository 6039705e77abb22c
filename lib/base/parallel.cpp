#include "base/parallel.h"

#include "base/error.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <mutex>

namespace gewebe {

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
  const int threads = thread_count(context);
  if (threads == 1 || blocks < 2) {
    for (std::size_t block = 0; block < blocks; ++block)
      run_block(block);
    return;
  }
  // More threads than cores would only make TBB print a warning.
  oneapi::tbb::task_arena arena(std::min(threads, oneapi::tbb::info::default_concurrency()));
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::size_t>(0, blocks, 1),
        [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
          for (std::size_t block = range.begin(); block != range.end(); ++block)
            run_block(block);
        },
        oneapi::tbb::simple_partitioner());
  });
}

} // namespace gewebe

#pragma once
// Parallel loops whose result doesn't depend on the number of threads: blocks are cut by `grain`
// alone, each block writes its own slots, and whoever needs a sum adds the slots in order
// afterwards.

#include "base/context.h"

#include <cstddef>
#include <functional>

namespace gewebe {

/// Calls `body(begin, end)` for consecutive blocks [0,grain), [grain,2 grain), … of [0,count), at
/// most context.threads at a time or what the system gives. Reports progress, honours cancelling.
/// \pre grain > 0; body touches nothing that another block writes.
/// \throw what the body throws (one of them), Cancelled
void parallel_blocks(const Context& context, std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t begin, std::size_t end)>& body);

/// The same blocks: as above where they are `worth` it, else one behind the other on this thread.
/// To wake other threads and wait for them takes some 10 us on a quiet machine and the slice of its
/// scheduler on one that has other work, so that what takes less than some 200 us is quicker alone.
void parallel_blocks_if(bool worth, const Context& context, std::size_t count, std::size_t grain,
                        const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Threads that a context stands for: context.threads, or the machine's where that is 0.
int thread_count(const Context& context) noexcept;

} // namespace gewebe

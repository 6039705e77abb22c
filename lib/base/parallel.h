#pragma once
// Parallel loops whose result does not depend on the number of threads. `grain` alone determines
// the blocks, and each block writes its own slots. A caller that needs a sum adds the slots in
// order afterwards.

#include "base/context.h"

#include <cstddef>
#include <functional>

namespace gewebe {

/// Calls `body(begin, end)` for consecutive blocks [0,grain), [grain,2 grain), … of [0,count), at
/// most context.threads at a time, or fewer if the system grants fewer threads. Reports progress
/// and checks for cancellation.
/// \pre grain > 0; body touches nothing that another block writes.
/// \throw what the body throws (one of them), Cancelled
void parallel_blocks(const Context& context, std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t begin, std::size_t end)>& body);

/// The same blocks: in parallel if `worth`, else one after the other on this thread. To wake other
/// threads and to wait for them takes about 10 us on an idle machine, and a scheduler's time slice
/// on a busy one. Work of less than about 200 us is therefore faster on one thread.
void parallel_blocks_if(bool worth, const Context& context, std::size_t count, std::size_t grain,
                        const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Number of threads of a context: context.threads, or that of the machine if it is 0.
int thread_count(const Context& context) noexcept;

} // namespace gewebe

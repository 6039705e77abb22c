#pragma once
// Context of a long computation: number of threads, progress, cancellation, limit of memory.

#include "base/cpu.h"

#include <cstdint>
#include <functional>

namespace gewebe {

struct Context {
  int threads = 0; ///< 0: all of the machine
  std::function<void(double)>
      progress; ///< called with the done fraction 0…1, from any thread, never concurrently
  std::function<bool()> cancelled; ///< called between blocks; true ends the call with Cancelled
  std::uint64_t max_memory = UINT64_MAX; ///< bytes; an estimate beyond it is refused
  CpuLevel cpu = best_cpu_level();       ///< kernels to use, at most the machine's level
};

/// \throw Error "needs 12.3 GiB, --max-memory is 4.0 GiB" when `bytes` exceeds the context's limit.
/// `what` names the thing that needs them ("the grid of 1024 x 1024 x 1024 voxels").
void require_memory(const Context& context, double bytes, const char* what);

} // namespace gewebe

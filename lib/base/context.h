#pragma once
// What a caller tells every long computation: how many threads, whom to tell of progress, when to
// stop, how much memory.

#include "base/cpu.h"

#include <cstdint>
#include <functional>

namespace gewebe {

struct Context {
  int threads = 0; ///< 0: all that the machine has
  std::function<void(double)>
      progress; ///< told the done fraction 0…1, from any thread, never concurrently
  std::function<bool()> cancelled; ///< asked between blocks; true ends the call with Cancelled
  std::uint64_t max_memory = UINT64_MAX; ///< bytes; an estimate beyond it is refused
  CpuLevel cpu = best_cpu_level();       ///< kernels to use, at most what the machine can do
};

/// \throw Error "needs 12.3 GiB, --max-memory is 4.0 GiB" when `bytes` exceeds the context's limit.
/// `what` names the thing that needs them ("the grid of 1024 x 1024 x 1024 voxels").
void require_memory(const Context& context, double bytes, const char* what);

} // namespace gewebe

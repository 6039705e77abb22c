#pragma once
// Results of runs that failed or were killed.

#include "formats/results/results_writer.h"

#include <cstdint>
#include <string>

namespace gewebe::formats {

struct PartialFrames {
  std::uint64_t frames = 0;
  double time = 0; ///< s, of the last one
};

/// Puts a result of kind h5 or vtkhdf, which no program has open, back to its last whole frame and
/// sets its attribute `partial` (where the disk has room for it). \throw Error if it holds no frame
PartialFrames mark_partial(const std::string& path, const std::string& why);

/// Finds what a killed run has left of the result `path`: the newest temporary file beside it that
/// no program has locked. Keeps its whole frames as partial_name(path), and removes what else that
/// run has left. h5, vtkhdf and csv alone have something on the disk before they are done.
/// \throw Error if there is none, or it holds no frame
KeptResult recover_result(const std::string& path);

} // namespace gewebe::formats

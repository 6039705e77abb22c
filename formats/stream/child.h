#pragma once
// Work that may crash, hang or eat memory, done in a process of its own.

#include <cstdint>
#include <functional>
#include <string>

namespace gewebe::formats {

struct ChildLimits {
  std::uint64_t memory = 0;  ///< bytes of address space beyond what this process has; 0: no limit
  unsigned cpu_seconds = 10; ///< processor time
  double seconds = 60;       ///< time by the clock, for a child that sleeps
};

/// Whether a child gets all of limits.memory: false where this process has a smaller RLIMIT_AS.
bool has_room_for_child(const ChildLimits& limits);

/// Forks, runs `work` in the child and returns its bytes. The child has default signals, no core
/// file, /dev/null as standard input, output and error, no other open file, and dies with its
/// parent. \pre no other thread of this process holds a lock that `work` needs (glibc's malloc
/// takes care of its own) \throw Error with `work`'s own text if it threw Error; else one that says
/// how it ended: "out of memory", "took over 10 s", "crashed (signal 11)"
std::string run_in_child(const std::function<std::string()>& work, const ChildLimits& limits);

} // namespace gewebe::formats
